//! Growth: from the cores into the valleys around them, up to where two stones meet.

use super::cores::{Ground, spread};
use super::flood::parts;
use super::judge::{Judged, Kind};
use super::{NONE, UNKNOWN};
use crate::settings::ValleySettings;

/// What each vertex grows to belong to: a core, [`NONE`] or [`UNKNOWN`].
///
/// Steps are longer in valleys, so that what grows from two sides meets at the deepest line, and where
/// the surface faces down, as membranes do that a reconstruction spans over what no camera saw. What is no stone starts late: sand lies at the foot
/// of stones, not on their flanks.
pub fn grow(ground: &Ground, cores: &[u32], judged: &[Judged], settings: &ValleySettings) -> Vec<u32> {
    let slowness: Vec<f32> = (0..cores.len())
        .map(|v| {
            // What is not known is taken for as fast as can be: what is in doubt must not come later than it might.
            if ground.is_unknown(v) {
                return 1.0;
            }
            let valley = settings.valley_cost * f64::from(-ground.bends[v].least).max(0.0);
            let down = settings.overhang_cost * f64::from(-ground.normals[v].z).max(0.0);
            (1.0 + valley + down) as f32
        })
        .collect();
    let uphill = |a: usize, b: usize| Some(parts(ground.edges(a, b) * 0.5 * f64::from(slowness[a] + slowness[b])));
    let reach = parts(settings.growth_edges) as u16;
    let late = (parts(settings.sand_delay_edges) as u16).min(reach);
    let start = |v: usize| match cores[v] {
        core if core >= UNKNOWN => None,
        core => match judged[core as usize].kind {
            Kind::Open => None,
            Kind::Stone => Some(0),
            Kind::Fragment | Kind::Sheet => Some(late),
        },
    };
    let doubtful = |v: usize| match cores[v] {
        UNKNOWN => true,
        NONE => false,
        core => judged[core as usize].kind == Kind::Open,
    };
    spread(ground, (&start, &doubtful, &|v| cores[v]), reach, uphill)
}
