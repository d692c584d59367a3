//! Growth: from the cores into the valleys around them, up to where two stones meet.

use super::cores::{Cores, Ground};
use super::flood::parts;
use super::judge::{Judged, Kind};
use super::spread::Spread;
use super::{NONE, UNKNOWN};
use crate::settings::ValleySettings;

/// What has grown from the cores so far.
///
/// Steps are longer in valleys, so that what grows from two sides meets at the deepest line, and where
/// the surface faces down, as membranes do that a reconstruction spans over what no camera saw. What is no stone starts late: sand lies at the foot
/// of stones, not on their flanks.
pub struct Growth<'g> {
    ground: &'g Ground<'g>,
    /// How long a step is at each vertex, edges for each edge.
    slowness: Vec<f32>,
    /// How far cores grow, parts.
    reach: u16,
    /// How far stones have grown when what is no stone starts, parts.
    late: u16,
    spread: Spread,
}

impl<'g> Growth<'g> {
    /// Nothing has grown yet.
    pub fn over(ground: &'g Ground, settings: &ValleySettings) -> Growth<'g> {
        let slowness = |v: usize| {
            // What is not known is taken for as fast as can be: what is in doubt must not come later than it might.
            if ground.is_unknown(v) {
                return 1.0;
            }
            let valley = settings.valley_cost * f64::from(-ground.bends[v].least).max(0.0);
            let down = settings.overhang_cost * f64::from(-ground.normals[v].z).max(0.0);
            (1.0 + valley + down) as f32
        };
        let reach = parts(settings.growth_edges) as u16;
        Growth {
            ground,
            slowness: (0..ground.neighbours.len()).map(slowness).collect(),
            reach,
            late: (parts(settings.sand_delay_edges) as u16).min(reach),
            spread: Spread::over(ground),
        }
    }

    /// Lets the cores grow, with those that have grown already: what each vertex belongs to, a core, [`NONE`] or
    /// [`UNKNOWN`]. Cores and what is in doubt may be added from one time to the next, none taken away.
    pub fn grow(&mut self, cores: &Cores, judged: &[Judged]) -> Vec<u32> {
        let start = |v: usize| match cores.of[v] {
            core if core >= UNKNOWN => None,
            core => match judged[core as usize].kind {
                Kind::Open => None,
                Kind::Stone => Some(0),
                Kind::Fragment | Kind::Sheet => Some(self.late),
            },
        };
        let doubtful = |v: usize| match cores.of[v] {
            UNKNOWN => true,
            NONE => false,
            core => judged[core as usize].kind == Kind::Open,
        };
        let step = |a: usize, b: usize| {
            Some(parts(self.ground.edges(a, b) * 0.5 * f64::from(self.slowness[a] + self.slowness[b])))
        };
        self.spread.rise(self.ground.neighbours, (&start, &doubtful), self.reach, step);
        self.spread.labels(|v| cores.of[v])
    }
}
