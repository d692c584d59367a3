//! What becomes of a core: part of a grain, or dropped.

use super::borders::{Border, borders};
use super::cores::{Cores, Ground, beside_unknown, boxes};
use super::NONE;
use crate::geometry::{DVec3, PlanBox, flatter_than, mean_depth};
use crate::segment::components::Forest;
use crate::settings::{SegmentSettings, ValleySettings};
use rayon::prelude::*;

/// What is decided about the cores of a tile.
pub struct Fates {
    /// The lowest core of the grain that each core belongs to; [`NONE`] for those that are dropped.
    pub group: Vec<u32>,
    /// Whether everything about a grain is known, by its lowest core.
    pub known: Vec<bool>,
}

/// Sums over a core.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    area_m2: f64,
    /// Mean curvature times the square root of the area: above 2 for a ball, 0 for a plane.
    roundness: f64,
    /// Mean of the least bending.
    bend: f64,
}

/// Decides about all cores. `grown` is what grew from each.
pub fn judge(
    ground: &Ground,
    cores: &Cores,
    grown: &[u32],
    (segment, settings): (&SegmentSettings, &ValleySettings),
) -> Fates {
    let count = cores.count();
    let members = cores.members();
    let sums: Vec<Sums> = members.par_iter().map(|members| Sums::of(ground, members)).collect();
    let boxes = boxes(ground.positions, &cores.of, count);
    let too_wide = |bounds: &PlanBox| segment.max_grain_m > 0.0 && bounds.width_m() > segment.max_grain_m;
    // A core that is too wide is none whatever else it is; of one that is not whole nothing else is known.
    let stone: Vec<Option<bool>> = (0..count)
        .into_par_iter()
        .map(|core| match () {
            () if too_wide(&boxes[core]) => Some(false),
            () if cores.open[core] => None,
            () => Some(is_stone(ground, &members[core], &sums[core], settings)),
        })
        .collect();
    let open = beside_unknown(ground.neighbours, grown, count);
    let mut parent: Vec<u32> = (0..count as u32).collect();
    let mut forest = Forest { first: 0, parent: &mut parent };
    let mut known: Vec<bool> = (0..count).map(|core| !open[core] && stone[core].is_some()).collect();
    for ([a, b], border) in borders(ground, grown) {
        let pair = [a as usize, b as usize];
        if pair.iter().any(|&core| stone[core] == Some(false)) {
            continue;
        }
        let smaller_m = sums[pair[0]].area_m2.min(sums[pair[1]].area_m2).sqrt();
        let seen = pair.iter().any(|&core| !open[core]);
        if seen && !may_join(&border, smaller_m, settings) {
            continue;
        }
        if !seen || pair.iter().any(|&core| stone[core].is_none()) {
            pair.iter().for_each(|&core| known[core] = false);
        } else if is_one(ground, pair.map(|core| &members[core][..]), &border, smaller_m, settings) {
            forest.join(a, b);
        }
    }
    let root: Vec<u32> = (0..count as u32).map(|core| forest.root(core)).collect();
    let mut fates = Fates { group: root.clone(), known: vec![true; count] };
    let mut bounds = vec![PlanBox::EMPTY; count];
    for core in 0..count {
        let group = root[core] as usize;
        fates.known[group] &= known[core];
        bounds[group].merge(&boxes[core]);
    }
    for core in 0..count {
        let group = root[core] as usize;
        if stone[core] == Some(false) || too_wide(&bounds[group]) {
            fates.group[core] = NONE;
        }
    }
    fates
}

impl Sums {
    fn of(ground: &Ground, members: &[u32]) -> Sums {
        let (mut area, mut mean, mut least) = (0.0, 0.0, 0.0);
        for &v in members {
            let (of, bend) = (f64::from(ground.area_m2[v as usize]), ground.bends[v as usize]);
            area += of;
            mean += of * f64::from(bend.mean);
            least += of * f64::from(bend.least);
        }
        let over = 1.0 / area.max(f64::MIN_POSITIVE);
        Sums { area_m2: area, roundness: mean * over / ground.mean_edge_m * area.sqrt(), bend: least * over }
    }
}

/// Whether a core is a stone: sheets of sand and membranes over what no camera saw are flat, hollow, or bent downward.
fn is_stone(ground: &Ground, members: &[u32], sums: &Sums, settings: &ValleySettings) -> bool {
    let signs = usize::from(sums.roundness < settings.sand_roundness) + usize::from(sums.bend < -settings.sand_bend);
    // Two more signs need the hull, which is asked only where they could decide.
    if signs == 0 {
        return true;
    }
    let points = at(ground, members);
    let flat = flatter_than(&points, settings.sand_sphericity);
    if flat && signs == 2 {
        return false;
    }
    let hollow = || mean_depth(&points, &points) > settings.sand_hollow * sums.area_m2.sqrt();
    match (flat, signs) {
        (true, 1) | (false, 2) => !hollow(),
        _ => true,
    }
}

/// Whether a border is long enough, and shallow enough, to lie within a stone.
fn may_join(border: &Border, smaller_m: f64, settings: &ValleySettings) -> bool {
    0.5 * border.crossing_m >= settings.join_border * smaller_m && border.bend >= -settings.join_depth
}

/// Whether two cores are one stone: their border lies hardly below the hull of both.
fn is_one(ground: &Ground, cores: [&[u32]; 2], border: &Border, smaller_m: f64, settings: &ValleySettings) -> bool {
    let mut both = at(ground, cores[0]);
    both.extend(at(ground, cores[1]));
    let depth_m = mean_depth(&both, &at(ground, &border.vertices));
    depth_m < settings.join_hollow_edges * ground.mean_edge_m || depth_m < settings.join_hollow * smaller_m
}

fn at(ground: &Ground, vertices: &[u32]) -> Vec<DVec3> {
    vertices.iter().map(|&v| ground.positions[v as usize]).collect()
}
