//! Joins: cores that are parts of one stone, seen in several patches.
//!
//! Two patches of a convex body lie below each other's tangent planes, and nothing else reaches into the hull of both.
//! They need not touch: what lies in front of a stone may part what is seen of it. Where they do touch, nothing lies between
//! them but a bridge that was cut, or a ledge that runs out on the face of one stone.

use super::UNKNOWN;
use super::bend::GAP_EDGES;
use super::cores::Ground;
use super::judge::{Judged, Kind};
use crate::geometry::{DVec3, ExactSum, PlanBox, Supports};
use crate::segment::components::Forest;
use crate::settings::ValleySettings;
use rayon::prelude::*;

/// What cores form grains.
pub struct Joined {
    /// The lowest core of the grain that each core belongs to, itself if it is joined to none.
    pub root: Vec<u32>,
    /// Whether all that could be joined to a core is known.
    pub known: Vec<bool>,
}

/// Of two cores, what lies no further beyond the gap than this, as a share of the square root of the smaller one's
/// area, must agree by itself, if they do not touch.
const RIM: f64 = 0.3;
/// What lies so far within the hull of two cores is inside, mean edge lengths.
const INSIDE_EDGES: f64 = 1.5;

/// Which cores are one. `cores` gives the core of each vertex, `seen` the ground of which every triangle with its centroid
/// there is loaded.
pub fn join(ground: &Ground, cores: &[u32], judged: &[Judged], seen: &PlanBox, settings: &ValleySettings) -> Joined {
    let sure = Sure::of(ground, cores, seen);
    let blocks = Blocks::of(ground, judged);
    let may = |core: usize| matches!(judged[core].kind, Kind::Stone | Kind::Fragment | Kind::Open);
    let farthest = |core: usize| reach_m(ground, judged[core].area_m2, settings);
    let mut order: Vec<usize> = (0..judged.len()).filter(|&core| may(core)).collect();
    order.sort_by(|&a, &b| judged[a].bounds.min[0].total_cmp(&judged[b].bounds.min[0]).then(a.cmp(&b)));
    let widest_m = order.iter().map(|&core| farthest(core)).fold(0.0, f64::max);
    let found: Vec<(usize, usize, Option<bool>)> = order
        .par_iter()
        .enumerate()
        .flat_map_iter(|(place, &first)| {
            let ahead = order[place + 1..]
                .iter()
                .take_while(move |&&other| judged[other].bounds.min[0] <= judged[first].bounds.max[0] + widest_m);
            let (sure, farthest, all) = (&sure, &farthest, (cores, &blocks));
            ahead.filter_map(move |&other| {
                let (a, b) = (first.min(other), first.max(other));
                // Of a core that is not whole the reach is not known, but it is not more than that of the other.
                let open = |core: usize| judged[core].kind == Kind::Open;
                let gap_m = match (open(a), open(b)) {
                    (false, false) => farthest(a).min(farthest(b)),
                    (true, false) => farthest(b),
                    (false, true) => farthest(a),
                    (true, true) => return None,
                };
                if apart(&judged[a].bounds, &judged[b].bounds) > gap_m {
                    return None;
                }
                if open(a) || open(b) {
                    return Some((a, b, None));
                }
                if [a, b].iter().all(|&core| judged[core].kind == Kind::Fragment) {
                    return None;
                }
                let pair = [&judged[a], &judged[b]];
                one(ground, (all, [a, b]), pair, (gap_m, sure), settings).map(|one| (a, b, one))
            })
        })
        .collect();
    let mut parent: Vec<u32> = (0..judged.len() as u32).collect();
    let mut forest = Forest { first: 0, parent: &mut parent };
    // What is not in sight could be joined as well.
    let in_sight = |core: usize| sure.holds(&grown(&judged[core].bounds, farthest(core)));
    let mut known: Vec<bool> = (0..judged.len()).into_par_iter().map(|core| !may(core) || in_sight(core)).collect();
    for (a, b, one) in found {
        match one {
            Some(true) => forest.join(a as u32, b as u32),
            Some(false) => {}
            None => (known[a], known[b]) = (false, false),
        }
    }
    Joined { root: (0..judged.len() as u32).map(|core| forest.root(core)).collect(), known }
}

/// How far from a core of an area something may lie that is joined to it, m.
fn reach_m(ground: &Ground, area_m2: f64, settings: &ValleySettings) -> f64 {
    (settings.join_reach * area_m2.sqrt()).min(settings.join_reach_edges * ground.mean_edge_m)
}

fn apart(a: &PlanBox, b: &PlanBox) -> f64 {
    let along = |i: usize| (a.min[i] - b.max[i]).max(b.min[i] - a.max[i]).max(0.0);
    along(0).hypot(along(1))
}

fn grown(bounds: &PlanBox, by_m: f64) -> PlanBox {
    PlanBox { min: bounds.min.map(|low| low - by_m), max: bounds.max.map(|high| high + by_m) }
}

/// Whether two whole cores are one; none where they are too far apart, nothing where that hangs on what is not in sight.
#[allow(clippy::type_complexity, reason = "each is named where it is used")]
fn one(
    ground: &Ground,
    ((cores, blocks), names): ((&[u32], &Blocks), [usize; 2]),
    [first, second]: [&Judged; 2],
    (farthest_m, sure): (f64, &Sure),
    settings: &ValleySettings,
) -> Option<Option<bool>> {
    let [a, b] = [&first.patch, &second.patch];
    let gaps_m = a.gaps_m(b);
    let gap_m = gaps_m[0].iter().copied().fold(f64::INFINITY, f64::min);
    // Two sides of a tear lie at one place, and a reach of 0 joins none.
    if gap_m >= farthest_m {
        return None;
    }
    let smaller_m2 = first.area_m2.min(second.area_m2);
    let agree = |widest_m: f64| {
        let most = settings.join_rise;
        a.rises_less(&gaps_m[0], widest_m, b, most) && b.rises_less(&gaps_m[1], widest_m, a, most)
    };
    // The rims of cores that touch are the flanks of a ledge, and rise over each other however well the rest agrees.
    let rims_agree = || agree(gap_m + RIM * smaller_m2.sqrt()) || touch(ground, cores, [first, second], names);
    if !agree(f64::INFINITY) || !rims_agree() {
        return Some(Some(false));
    }
    let both: Vec<DVec3> = a.points.iter().chain(&b.points).copied().collect();
    let mut bounds = first.bounds;
    bounds.merge(&second.bounds);
    if !sure.holds(&bounds) {
        return Some(None);
    }
    let hull = Supports::of(&both);
    let mut swallowed = ExactSum::ZERO;
    for v in blocks.near(&bounds).filter(|block| !names.contains(&block.core)).flat_map(|block| block.vertices) {
        let p = ground.positions[*v as usize];
        if bounds.margin_m(p) >= 0.0 && hull.depth(p) > INSIDE_EDGES * ground.mean_edge_m {
            swallowed.add(f64::from(ground.area_m2[*v as usize]));
        }
    }
    Some(Some(swallowed.value() < settings.join_swallowed * smaller_m2))
}

/// Whether some vertices of two cores are neighbours: no valley lies between them there.
fn touch(ground: &Ground, cores: &[u32], [first, second]: [&Judged; 2], [a, b]: [usize; 2]) -> bool {
    let (fewer, other) = if first.vertices.len() <= second.vertices.len() { (first, b) } else { (second, a) };
    let beside = |v: &u32| ground.neighbours.around(*v as usize).iter().any(|w| cores[*w as usize] as usize == other);
    fewer.vertices.iter().any(beside)
}

/// The vertices of all cores in blocks that are small, also those of sheets as wide as the tile.
struct Blocks<'j> {
    /// By the western side of their boxes, ascending.
    all: Vec<Block<'j>>,
    widest_m: f64,
}

/// Some vertices of a core that follow one another, and their box in plan.
struct Block<'j> {
    core: usize,
    vertices: &'j [u32],
    bounds: PlanBox,
}

/// Vertices of a block.
const BLOCK: usize = 256;

impl<'j> Blocks<'j> {
    fn of(ground: &Ground, judged: &'j [Judged]) -> Blocks<'j> {
        let of_core = |(core, judged): (usize, &'j Judged)| {
            judged.vertices.chunks(BLOCK).map(move |vertices| {
                let mut bounds = PlanBox::EMPTY;
                vertices.iter().for_each(|&v| bounds.include(ground.positions[v as usize]));
                Block { core, vertices, bounds }
            })
        };
        let mut all: Vec<Block> = judged.iter().enumerate().flat_map(of_core).collect();
        all.sort_by(|a, b| a.bounds.min[0].total_cmp(&b.bounds.min[0]));
        let widest_m = all.iter().map(|block| block.bounds.width_m()).fold(0.0, f64::max);
        Blocks { all, widest_m }
    }

    /// Blocks that may reach into a box, in no order that matters.
    fn near<'b>(&'b self, bounds: &'b PlanBox) -> impl Iterator<Item = &'b Block<'j>> {
        let first = self.all.partition_point(|block| block.bounds.min[0] < bounds.min[0] - self.widest_m);
        let ahead = self.all[first..].iter().take_while(|block| block.bounds.min[0] <= bounds.max[0]);
        ahead.filter(|block| apart(&block.bounds, bounds) == 0.0)
    }
}

/// Where everything is known.
struct Sure {
    /// All cores that are not loaded lie outside.
    inside: PlanBox,
    /// Side of the squares, m.
    square_m: f64,
    /// Squares that hold unknown vertices, ascending.
    unknown: Vec<[i64; 2]>,
}

impl Sure {
    fn of(ground: &Ground, cores: &[u32], seen: &PlanBox) -> Sure {
        let square_m = 16.0 * ground.mean_edge_m;
        let mut unknown: Vec<[i64; 2]> = Vec::new();
        if ground.unknown.is_some() {
            let square =
                |v: usize| [ground.positions[v].x, ground.positions[v].y].map(|x| (x / square_m).floor() as i64);
            unknown = (0..cores.len()).filter(|&v| cores[v] == UNKNOWN).map(square).collect();
            unknown.sort_unstable();
            unknown.dedup();
        }
        Sure { inside: grown(seen, -GAP_EDGES * ground.mean_edge_m), square_m, unknown }
    }

    /// Whether everything in a box is known.
    fn holds(&self, bounds: &PlanBox) -> bool {
        let within = (0..2).all(|i| bounds.min[i] >= self.inside.min[i] && bounds.max[i] <= self.inside.max[i]);
        let [low, high] = [bounds.min, bounds.max].map(|corner| corner.map(|x| (x / self.square_m).floor() as i64));
        within
            && (low[0]..=high[0]).all(|column| {
                let from = self.unknown.partition_point(|square| *square < [column, low[1]]);
                self.unknown.get(from).is_none_or(|square| *square > [column, high[1]])
            })
    }
}
