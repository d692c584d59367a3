//! The divergence at all vertices of a column of cells, with the work shared.
//!
//! The candidates around a cell are gathered once. Up to five vertices next to one another (4.3 on average, counted on a
//! bed of 481,851) share a narrower list of about 100, which reaches as far as the vertices before needed and some more.
//! Ranks at all thirty stencil points at once ([`super::thresholds`]) give the sets of neighbours, and only these, about
//! 42 for a vertex, are fetched in `f64` and weighted ([`super::weights`]).
//!
//! It is exact because of what it checks, not because of what it guesses: a neighbour within the radius less the
//! offset cannot be outside the list, ranks carry an error bound, and candidates that ranks cannot tell apart are
//! compared by (distance², number) in `f64`. Where the list leaves the gathered block, a wider block is gathered;
//! where nothing helps, [`super::neighbours`] searches. The set is the same whichever way it was found, and so are
//! the sums, bit for bit.
#![allow(clippy::needless_range_loop, reason = "stencil points and axes run through several arrays at once")]

use super::Stencil;
use super::block::{Block, Group};
use super::buffer::{Points, SLACK};
use super::certain::Certain;
use super::grid::Grid;
use super::lanes::{Keys, LANES, Lanes, MOST, Near, Places, Row, TOGETHER};
use super::neighbours::Reserve;
use super::thresholds::{COMPLETE, HIGHEST, search, undecided};
use super::weights::Weighting;
use crate::geometry::DVec3;
use crate::tile::NormalField;

/// Blocks reach this many cells around theirs, in turn.
const RINGS: [i32; 3] = [1, 2, 4];
/// Most candidates of a block.
const BLOCK: usize = 1 << 15;
/// A list reaches this much further than the last one had to.
const SPARE: f64 = 1.04;
/// The list is trusted up to its radius less this part: rounding in `f32` may lose what is nearer to its rim.
const RIM: f64 = 1e-5;

/// Everything that all columns share.
pub(super) struct Job<'a> {
    /// The centroids.
    pub(super) grid: &'a Grid,
    /// The field they come from.
    pub(super) field: &'a NormalField,
    /// Where the divergence is wanted.
    pub(super) points: &'a [DVec3],
    /// The stencil.
    pub(super) stencil: &'a Stencil,
    /// Its weights.
    pub(super) weighting: Weighting,
    /// The exact search, if needed.
    pub(super) reserve: &'a Reserve<'a>,
}

/// Buffers of a thread, and what the vertices before needed.
pub(super) struct Workspace {
    queue: Vec<(u32, u32)>,
    block: Points,
    list: Points,
    places: Places,
    keys: Keys,
    /// For each candidate of the list, the stencil points that it is a neighbour of.
    of: Vec<u32>,
    near: Near,
    /// How far the list reaches, metres.
    radius_m: f64,
    /// Squared distances of the thresholds, m².
    last_m2: [f64; 6],
}

impl Workspace {
    /// Empty buffers.
    pub(super) fn new(stencil: &Stencil) -> Workspace {
        let typical = stencil.typical_radius_m();
        Workspace {
            queue: Vec::new(),
            block: Points::default(),
            list: Points::default(),
            places: Places { a: [[0.0; LANES]; 3], b: [0.0; LANES], scale: 0.0 },
            keys: Keys::new(),
            of: vec![0; MOST + SLACK],
            near: Near::new(),
            radius_m: 1.1 * (typical.hypot(stencil.offset_m) + stencil.offset_m),
            last_m2: [typical * typical; 6],
        }
    }
}

/// Vertices of one column.
pub(super) struct Column<'a, 'j> {
    /// What all columns share.
    pub(super) job: &'a Job<'j>,
    /// Numbers of the vertices.
    pub(super) vertices: &'a [u32],
    /// Their divergence, 1/m.
    pub(super) found: &'a mut [Certain],
    /// Buffers.
    pub(super) work: &'a mut Workspace,
}

enum Outcome {
    Known,
    /// Needs a wider block.
    Further,
    /// Cannot be worked together.
    Hopeless,
}

/// Works a column.
#[inline(always)]
pub(super) fn work<L: Lanes>(lanes: L, column: &mut Column<'_, '_>) {
    let job = column.job;
    let mut queue = std::mem::take(&mut column.work.queue);
    queue.clear();
    queue.extend(column.vertices.iter().enumerate().map(|(i, &v)| (job.place(job.points[v as usize]), i as u32)));
    queue.sort_unstable();
    let mut rest = &queue[..];
    while let Some(&(first, _)) = rest.first() {
        let end = rest.iter().position(|e| e.0 >> 6 != first >> 6).unwrap_or(rest.len());
        cell(lanes, column, &rest[..end]);
        rest = &rest[end..];
    }
    column.work.queue = queue;
}

impl Job<'_> {
    /// Level of the cell and place within it, such that neighbours are mostly next to one another.
    #[inline(always)]
    fn place(&self, p: DVec3) -> u32 {
        let slot = self.grid.slot(p);
        let at = (p - self.grid.centre(slot)) * (4.0 / self.grid.cell_m);
        let part = |x: f64| ((x + 2.0) as i32).clamp(0, 3) as u32;
        let (x, y, z) = (part(at.x), part(at.y), part(at.z));
        let octant = (x >> 1) | (y & 2) | (z & 2) << 1;
        let within = (x & 1) | (y & 1) << 1 | (z & 1) << 2;
        (slot[2] as u32) << 6 | octant << 3 | within
    }

    #[cold]
    #[inline(never)]
    fn searched(&self, p: DVec3) -> Option<f64> {
        self.reserve.divergence(p, self.stencil, &self.weighting)
    }
}

/// Works the vertices of one cell.
#[inline(always)]
fn cell<L: Lanes>(lanes: L, column: &mut Column<'_, '_>, queue: &[(u32, u32)]) {
    let job = column.job;
    let point = |e: &(u32, u32)| job.points[column.vertices[e.1 as usize] as usize];
    let slot = job.grid.slot(point(&queue[0]));
    let mut later: Vec<(u32, u32)> = Vec::new();
    let mut now: Vec<(u32, u32)> = Vec::new();
    for (turn, rings) in RINGS.into_iter().enumerate() {
        let queue = if turn == 0 { queue } else { &now[..] };
        if !job.grid.gather(slot, rings, BLOCK, &mut column.work.block) {
            later = queue.to_vec();
            now.clear();
            break;
        }
        let block = Block::around(job.grid, slot, rings);
        let (mut rest, mut alone) = (queue, 0usize);
        while !rest.is_empty() {
            let parts = rest.len().div_ceil(TOGETHER);
            let size = if alone > 0 { 1 } else { rest.len().div_ceil(parts) };
            let group = &rest[..size];
            match together(lanes, column, &block, group) {
                Outcome::Known => {}
                Outcome::Further => later.extend_from_slice(group),
                Outcome::Hopeless if size > 1 => {
                    alone = size;
                    continue;
                }
                Outcome::Hopeless => column.found[group[0].1 as usize] = job.searched(point(&group[0])).into(),
            }
            alone = alone.saturating_sub(1);
            rest = &rest[size..];
        }
        if later.is_empty() {
            return;
        }
        now.clear();
        std::mem::swap(&mut now, &mut later);
    }
    for e in now.iter().chain(&later) {
        column.found[e.1 as usize] = job.searched(point(e)).into();
    }
}

/// Works a few vertices, [`TOGETHER`] at most, on one list of candidates.
#[inline(always)]
fn together<L: Lanes>(lanes: L, column: &mut Column<'_, '_>, block: &Block, queue: &[(u32, u32)]) -> Outcome {
    let (job, work) = (column.job, &mut *column.work);
    let point = |e: &(u32, u32)| job.points[column.vertices[e.1 as usize] as usize];
    let k = job.stencil.neighbours;
    let offset_m = job.weighting.offset_m;
    let mut at = [DVec3::ZERO; TOGETHER];
    let (mut reach_m, mut size_m) = (f64::INFINITY, 0.0f64);
    for (at, e) in at.iter_mut().zip(queue) {
        *at = point(e) - block.centre;
        reach_m = reach_m.min(job.grid.reach_m(block.slot, block.rings, *at));
        size_m = size_m.max(at.abs().max_element());
    }
    let at = &at[..queue.len()];
    let group = Group::around(at);
    let mut radius_m = work.radius_m.min(reach_m);
    let mut thresholds = Row([0; LANES]);
    let (per_m2, equal) = loop {
        group.narrow(lanes, &work.block, &mut work.list, (radius_m, offset_m));
        let n = work.list.len;
        if n > MOST || radius_m > 1e3 * job.grid.cell_m {
            return Outcome::Hopeless;
        }
        let complete_m = radius_m * (1.0 - RIM) - offset_m;
        if n >= k && complete_m > 0.0 {
            if error_in_ranks(job, size_m, &group, radius_m, complete_m) > 0.45 {
                return Outcome::Hopeless;
            }
            let per_m2 = COMPLETE / (complete_m * complete_m);
            place(&mut work.places, at, &group, offset_m, per_m2);
            lanes.rank(&work.list, &work.places, &mut work.keys);
            let guess = work.last_m2.map(|m2| (m2 * per_m2).min(f64::from(HIGHEST)) as i16);
            for v in 0..TOGETHER {
                thresholds.0[6 * v..6 * v + 6].copy_from_slice(&guess);
            }
            thresholds.0[6 * TOGETHER..].copy_from_slice(&guess[..LANES - 6 * TOGETHER]);
            if let Some(equal) = search(lanes, &work.keys, k as i16, &mut thresholds, &mut work.of[..n]) {
                break (per_m2, equal);
            }
        }
        if radius_m >= reach_m {
            return Outcome::Further;
        }
        radius_m = (1.15 * radius_m).min(reach_m);
    };
    let n = work.list.len;
    work.of[n..n + SLACK].fill(0);
    let m2_per = 1.0 / per_m2;
    let mut total = [0i32; 6];
    let mut farthest = 0;
    for (v, e) in queue.iter().enumerate() {
        let p = point(e);
        let own = &thresholds.0[6 * v..6 * v + 6];
        let mut highest = 0;
        for (t, total) in own.iter().zip(&mut total) {
            *total += i32::from(*t);
            highest = highest.max(*t);
        }
        farthest = farthest.max(highest);
        if equal >> (6 * v) & 63 != 0 {
            for q in (0..6).filter(|q| equal >> (6 * v + q) & 1 == 1) {
                decide(job, work, p, (v, q), own[q]);
            }
        }
        let farthest_m = ((f64::from(highest) + 1.5) * m2_per).sqrt();
        let inside = farthest_m + offset_m < job.field.loaded.margin_m(p) - RIM * radius_m;
        // Not in a closure, which would be compiled without the instruction set.
        column.found[e.1 as usize] = if inside || certain(job, work, p, v) {
            work.near.shift = 6 * v;
            lanes.choose(&work.list, &work.of[..n + SLACK], 63 << (6 * v), &mut work.near);
            let end = work.near.len;
            work.near.of[end..end + 8].fill(0);
            Some(lanes.sums(job.field, p, &mut work.near, &job.weighting).divergence(offset_m))
        } else {
            None
        }
        .into();
    }
    let share = m2_per / queue.len() as f64;
    work.last_m2 = total.map(|t| (f64::from(t) + 0.5) * share);
    work.radius_m = SPARE * (((f64::from(farthest) + 1.5) * m2_per).sqrt() + offset_m);
    Outcome::Known
}

/// Places the stencil points of vertices, relative to their group's centre; idle lanes do what others do.
#[inline(always)]
fn place(places: &mut Places, at: &[DVec3], group: &Group, offset_m: f64, per_m2: f64) {
    let centre = DVec3::from_array(group.centre.map(f64::from));
    let (shift, scale) = ((-2.0 * per_m2 * offset_m) as f32, -2.0 * per_m2);
    for v in 0..TOGETHER {
        let u = at[if v < at.len() { v } else { 0 }] - centre;
        let a = (u * scale).as_vec3();
        let (b, c) = (per_m2 * (u.length_squared() + offset_m * offset_m), u * (2.0 * per_m2 * offset_m));
        // Eight lanes at a time; the next vertex mends the last two.
        let square = [c.x, -c.x, c.y, -c.y, c.z, -c.z, 0.0, 0.0];
        places.b[6 * v..6 * v + 8].copy_from_slice(&square.map(|c| (b + c) as f32));
        for axis in 0..3 {
            let mut own = [a[axis]; 8];
            own[2 * axis] += shift;
            own[2 * axis + 1] -= shift;
            places.a[axis][6 * v..6 * v + 8].copy_from_slice(&own);
        }
    }
    for lanes in places.a.iter_mut().chain([&mut places.b]) {
        lanes.copy_within(0..LANES - 6 * TOGETHER, 6 * TOGETHER);
    }
    places.scale = per_m2 as f32;
}

/// A bound on the error of the ranks of candidates as near as `complete_m`. Coordinates are rounded to `f32` relative to
/// their own cell, to the block's and to the group's centre: each is off by up to `each`, a distance by sqrt(3) times
/// that, and its square by twice that times the distance. The sum then made has the terms c², s² and 2 s·c, of a
/// candidate no further than s + `complete_m` from the group's centre and a stencil point no further than s; nine, five
/// and six roundings lie between them and the rank.
#[inline(always)]
fn error_in_ranks(job: &Job<'_>, size_m: f64, group: &Group, radius_m: f64, complete_m: f64) -> f64 {
    let ulp = 1.01 * f64::from(f32::EPSILON) / 2.0;
    let in_block = size_m + radius_m;
    let sizes = in_block.max(0.5 * job.grid.cell_m) + in_block + group.radius_m + radius_m;
    let each = ulp * sizes + 8.0 * f64::EPSILON * (job.grid.magnitude_m() + in_block + job.grid.cell_m);
    let relative = each / complete_m;
    let s = (group.radius_m + job.weighting.offset_m) / complete_m;
    let c = s + 1.0;
    COMPLETE * (relative * (3.5 + 3.0 * relative) + ulp * (9.0 * c * c + 5.0 * s * s + 12.0 * s * c))
}

/// Where a stencil point is: +x, -x, +y, -y, +z, -z.
#[inline(always)]
pub(super) fn stencil_point(p: DVec3, q: usize, offset_m: f64) -> DVec3 {
    let shift = DVec3::AXES[q / 2] * offset_m;
    if q.is_multiple_of(2) { p + shift } else { p - shift }
}

/// Decides between candidates of about the same distance from a vertex's stencil point by (distance², number) in `f64`.
#[cold]
#[inline(never)]
fn decide(job: &Job<'_>, work: &mut Workspace, p: DVec3, (v, q): (usize, usize), threshold: i16) {
    let place = stencil_point(p, q, job.weighting.offset_m);
    let lane = 6 * v + q;
    let of = &mut work.of[..work.list.len];
    let mut between: Vec<(f64, u32, usize)> = undecided(&work.keys, lane, threshold, of)
        .into_iter()
        .map(|i| {
            let t = work.list.id[i];
            (super::neighbours::distance2(job.field.centroids[t as usize], place), t, i)
        })
        .collect();
    between.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let sure = of.iter().filter(|&&of| of >> lane & 1 == 1).count();
    for &(_, _, i) in between.iter().take(job.stencil.neighbours.saturating_sub(sure)) {
        of[i] |= 1 << lane;
    }
}

/// Whether nothing beyond what was loaded could be as near as the farthest neighbour of each stencil point.
#[cold]
#[inline(never)]
fn certain(job: &Job<'_>, work: &Workspace, p: DVec3, v: usize) -> bool {
    (0..6).all(|q| {
        let place = stencil_point(p, q, job.weighting.offset_m);
        let farthest = (0..work.list.len)
            .filter(|&i| work.of[i] >> (6 * v + q) & 1 == 1)
            .map(|i| super::neighbours::distance2(job.field.centroids[work.list.id[i] as usize], place))
            .fold(0.0, f64::max);
        farthest.sqrt() < job.field.loaded.margin_m(place)
    })
}
