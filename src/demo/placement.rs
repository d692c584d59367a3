//! Dropping stones on sand: largest first, at random places, on a height grid.

use super::bed::Sand;
use super::random::Random;
use super::settings::SceneSettings;
use super::stone::Shape;
use crate::geometry::DVec3;
use glam::DMat3;

/// Cell of the height grid, metres.
const CELL_M: f64 = 1e-3;
/// Places tried for a stone before it is left out.
const TRIES: usize = 80;
/// Draws of a b axis between the limits before it is moved to the nearer one: the limits may coincide.
const B_AXIS_TRIES: usize = 100;
/// Largest share of its own or another stone's plan that an overlap may take.
const MAX_OVERLAP: f64 = 0.3;
/// How far a stone may be lifted by those it lies on, in its own heights.
const MAX_LIFT: f64 = 0.5;
/// How deep stones press into those they lie on, in heights: hides that they touch at one point only.
const BEDDING: f64 = 0.06;

/// The stones of a scene in their places.
pub(super) fn place(settings: &SceneSettings, sand: &Sand) -> Vec<Shape> {
    let mut random = Random::new(settings.seed, 1);
    let mut sizes: Vec<f64> = (0..settings.stones).map(|_| b_axis(settings, &mut random)).collect();
    sizes.sort_by(|a, b| b.total_cmp(a));
    let mut pile = Pile::new(settings.side_m);
    let mut shapes = Vec::with_capacity(sizes.len());
    for b_m in sizes {
        let mut shape = Shape::random(&mut random, b_m);
        let crowded = random.chance(settings.crowding);
        if let Some(rest) = pile.find_rest(&shape, sand, &mut random, crowded) {
            pile.lay(&rest, shapes.len());
            shape.centre = rest.centre;
            shapes.push(shape);
        }
    }
    shapes
}

fn b_axis(settings: &SceneSettings, random: &mut Random) -> f64 {
    let mut b_m = settings.median_b_m;
    for _ in 0..B_AXIS_TRIES {
        b_m = settings.median_b_m * (settings.sigma_ln_b * random.normal()).exp();
        if (settings.min_b_m..=settings.max_b_m).contains(&b_m) {
            break;
        }
    }
    b_m.clamp(settings.min_b_m, settings.max_b_m)
}

/// What lies on top in every cell so far.
struct Pile {
    cells: usize,
    side_m: f64,
    top: Vec<f64>,
    owner: Vec<Option<usize>>,
    /// Cells in the plan of each stone, and those of them that later stones cover.
    plan: Vec<usize>,
    covered: Vec<usize>,
}

/// A place where a stone can stay.
struct Rest {
    centre: DVec3,
    overlap: usize,
    /// Cell and height of the stone's top, where it stands above the sand.
    tops: Vec<(usize, f64)>,
}

impl Pile {
    fn new(side_m: f64) -> Pile {
        let cells = (side_m / CELL_M).ceil() as usize;
        let count = cells * cells;
        Pile {
            cells,
            side_m,
            top: vec![f64::NEG_INFINITY; count],
            owner: vec![None; count],
            plan: vec![],
            covered: vec![],
        }
    }

    /// The first allowed place, or among the first five the one with most contact.
    fn find_rest(&self, shape: &Shape, sand: &Sand, random: &mut Random, crowded: bool) -> Option<Rest> {
        let reach = shape.reach();
        let wanted = if crowded { 5 } else { 1 };
        let mut best: Option<Rest> = None;
        let mut found = 0;
        for _ in 0..TRIES {
            let x = random.range(reach.x, (self.side_m - reach.x).max(reach.x));
            let y = random.range(reach.y, (self.side_m - reach.y).max(reach.y));
            let burial = random.range(0.1, 0.6);
            let Some(rest) = self.drop(shape, sand, [x, y], burial) else { continue };
            found += 1;
            if best.as_ref().is_none_or(|b| rest.overlap > b.overlap) {
                best = Some(rest);
            }
            if found == wanted {
                break;
            }
        }
        best
    }

    /// The height at which the stone comes to rest, if it lies there without hiding too much.
    fn drop(&self, shape: &Shape, sand: &Sand, at: [f64; 2], burial: f64) -> Option<Rest> {
        let chords = Chords::new(shape);
        let height = 2.0 * chords.half_height;
        let ground = sand.height_m(at[0], at[1]);
        let free = ground + height * (0.5 - burial);
        let mut lift = 0.0f64;
        let mut columns = Vec::new();
        let reach = shape.reach();
        for j in self.span(at[1], reach.y) {
            for i in self.span(at[0], reach.x) {
                let offset = [(i as f64 + 0.5) * CELL_M - at[0], (j as f64 + 0.5) * CELL_M - at[1]];
                let Some((low, high)) = chords.at(offset) else { continue };
                let cell = j * self.cells + i;
                columns.push((cell, high));
                if self.owner[cell].is_some() {
                    lift = lift.max(self.top[cell] - (free + low) - BEDDING * height);
                }
            }
        }
        if lift > MAX_LIFT * height {
            return None;
        }
        let z = free + lift;
        let tops: Vec<(usize, f64)> =
            columns.into_iter().map(|(cell, high)| (cell, z + high)).filter(|&(_, top)| top > ground).collect();
        let overlap = self.overlap(&tops)?;
        Some(Rest { centre: DVec3::new(at[0], at[1], z), overlap, tops })
    }

    /// Cells shared with other stones; none where too much of either would be hidden.
    fn overlap(&self, tops: &[(usize, f64)]) -> Option<usize> {
        let mut shared = 0;
        let mut hidden: Vec<(usize, usize)> = Vec::new();
        for &(cell, top) in tops {
            let Some(owner) = self.owner[cell] else { continue };
            shared += 1;
            if top > self.top[cell] {
                match hidden.iter_mut().find(|(stone, _)| *stone == owner) {
                    Some((_, count)) => *count += 1,
                    None => hidden.push((owner, 1)),
                }
            }
        }
        let much = |part: usize, whole: usize| part as f64 > MAX_OVERLAP * whole as f64;
        let allowed = !much(shared, tops.len())
            && hidden.iter().all(|&(stone, count)| !much(self.covered[stone] + count, self.plan[stone]));
        allowed.then_some(shared)
    }

    fn lay(&mut self, rest: &Rest, stone: usize) {
        self.plan.push(rest.tops.len());
        self.covered.push(0);
        for &(cell, top) in &rest.tops {
            if top > self.top[cell] {
                if let Some(owner) = self.owner[cell] {
                    self.covered[owner] += 1;
                }
                self.top[cell] = top;
                self.owner[cell] = Some(stone);
            }
        }
    }

    fn span(&self, centre: f64, reach: f64) -> std::ops::Range<usize> {
        let low = ((centre - reach) / CELL_M).floor().max(0.0) as usize;
        let high = ((centre + reach) / CELL_M).ceil().max(0.0) as usize;
        low..high.min(self.cells)
    }
}

/// Vertical chords through the ellipsoid under a stone: bumps and exponents matter little for its rest.
struct Chords {
    form: DMat3,
    half_height: f64,
}

impl Chords {
    fn new(shape: &Shape) -> Chords {
        let r = shape.rotation;
        let form = r * DMat3::from_diagonal((shape.half * shape.half).recip()) * r.transpose();
        Chords { form, half_height: shape.reach().z / 1.3 }
    }

    /// Bottom and top relative to the centre, above an offset in plan.
    fn at(&self, [x, y]: [f64; 2]) -> Option<(f64, f64)> {
        let m = self.form;
        let a = m.z_axis.z;
        let b = m.x_axis.z * x + m.y_axis.z * y;
        let c = m.x_axis.x * x * x + 2.0 * m.x_axis.y * x * y + m.y_axis.y * y * y - 1.0;
        let square = b * b - a * c;
        (square > 0.0).then(|| ((-b - square.sqrt()) / a, (-b + square.sqrt()) / a))
    }
}
