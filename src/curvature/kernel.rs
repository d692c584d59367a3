//! The divergence at all vertices of a column of cells, with the work shared.
//!
//! The candidates around a cell are gathered once. Vertices that share an eighth of the cell share a narrower list;
//! and all six stencil points of a vertex share one ball of about 65 candidates. Its radius is what the vertex before
//! needed and 4 % more. Ranks at the six points ([`super::thresholds`]) give the sets of neighbours, and only these,
//! about 45, are fetched in `f64` and weighted ([`super::weights`]).
//!
//! It is exact because of what it checks, not because of what it guesses: a neighbour within the radius less the
//! offset cannot be outside the ball, ranks carry an error bound, and candidates that ranks cannot tell apart are
//! compared by (distance², number) in `f64`. Where the ball leaves the gathered block, a wider block is gathered;
//! where nothing helps, [`super::neighbours`] searches. The set is the same whichever way it was found, and so are
//! the sums, bit for bit.
#![allow(clippy::needless_range_loop, reason = "stencil points and axes run through several arrays at once")]

use super::Stencil;
use super::block::Block;
use super::buffer::Points;
use super::grid::Grid;
use super::lanes::{Keys, Lanes, MOST, Near, Set, WORDS};
use super::neighbours::Reserve;
use super::thresholds::{COMPLETE, Thresholds, search, undecided};
use super::weights::{Sum, Weighting, divergence_of};
use crate::geometry::DVec3;
use crate::tile::NormalField;

/// Blocks reach this many cells around theirs, in turn.
const RINGS: [i32; 3] = [1, 2, 4];
/// Most candidates of a block.
const BLOCK: usize = 1 << 15;
/// A ball is this much wider than the last one had to be.
const SPARE: f64 = 1.04;
/// The ball is trusted up to its radius less this part: rounding in `f32` may lose what is nearer to its rim.
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

/// Buffers of a thread, and what the vertex before needed.
pub(super) struct Workspace {
    queue: Vec<(u32, u32)>,
    block: Points,
    group: Points,
    ball: Points,
    keys: Keys,
    sets: [Set; 6],
    near: Near,
    /// Radius of the ball, metres.
    radius_m: f64,
    /// Squared distances of the thresholds, m².
    last_m2: [f64; 8],
}

impl Workspace {
    /// Empty buffers.
    pub(super) fn new(stencil: &Stencil) -> Workspace {
        let typical = stencil.typical_radius_m();
        Workspace {
            queue: Vec::new(),
            block: Points::default(),
            group: Points::default(),
            ball: Points::default(),
            keys: Keys::new(),
            sets: [[0; WORDS]; 6],
            near: Near::new(),
            radius_m: 1.1 * (typical.hypot(stencil.offset_m) + stencil.offset_m),
            last_m2: [typical * typical; 8],
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
    pub(super) found: &'a mut [Option<f64>],
    /// Buffers.
    pub(super) work: &'a mut Workspace,
}

enum Outcome {
    Known(Option<f64>),
    /// Needs a wider block.
    Further,
    /// Needs the exact search.
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
        let mut block = Block::around(job.grid, slot, rings);
        let mut rest = queue;
        while !rest.is_empty() {
            let group = &rest[..group_len(rest)];
            block.start_group(group.iter().map(point));
            for e in group {
                match vertex(lanes, job, column.work, &mut block, point(e)) {
                    Outcome::Known(value) => column.found[e.1 as usize] = value,
                    Outcome::Further => later.push(*e),
                    Outcome::Hopeless => column.found[e.1 as usize] = job.searched(point(e)),
                }
            }
            rest = &rest[group.len()..];
        }
        if later.is_empty() {
            return;
        }
        now.clear();
        std::mem::swap(&mut now, &mut later);
    }
    for e in now.iter().chain(&later) {
        column.found[e.1 as usize] = job.searched(point(e));
    }
}

/// How many of the first vertices share an eighth of the cell, or less where they are crowded.
#[inline(always)]
fn group_len(queue: &[(u32, u32)]) -> usize {
    let first = queue[0].0;
    let mut i = 1;
    while i < queue.len() && queue[i].0 >> 3 == first >> 3 && (i < 8 || queue[i].0 == queue[i - 1].0) {
        i += 1;
    }
    i
}

/// Works one vertex.
#[inline(always)]
fn vertex<L: Lanes>(lanes: L, job: &Job<'_>, work: &mut Workspace, block: &mut Block, p: DVec3) -> Outcome {
    let at = p - block.centre;
    let reach_m = job.grid.reach_m(block.slot, block.rings, at);
    let k = job.stencil.neighbours as i32;
    let offset_m = job.weighting.offset_m;
    let mut radius_m = work.radius_m.min(reach_m);
    let mut thresholds: Thresholds = [0; 8];
    let per_m2 = loop {
        if radius_m > block.group_radius_m {
            block.narrow(lanes, &work.block, &mut work.group, 1.06 * radius_m);
        }
        lanes.keep_ball(&work.group, at.as_vec3().to_array(), (radius_m * radius_m) as f32, &mut work.ball);
        let n = work.ball.len;
        if n > MOST - 128 || radius_m > 1e3 * job.grid.cell_m {
            return Outcome::Hopeless;
        }
        let complete_m = radius_m * (1.0 - RIM) - offset_m;
        if n >= k as usize && complete_m > 0.0 {
            let per_m2 = COMPLETE / (complete_m * complete_m);
            if error_in_ranks(job.grid, at, radius_m, complete_m) > 0.45 {
                return Outcome::Hopeless;
            }
            work.ball.pad(Keys::padding(n));
            lanes.rank(&work.ball, offset_m as f32, per_m2 as f32, &mut work.keys);
            for (t, m2) in thresholds.iter_mut().zip(&work.last_m2) {
                *t = (m2 * per_m2) as i32;
            }
            if search(lanes, &work.keys, k, &mut thresholds) {
                break per_m2;
            }
        }
        if radius_m >= reach_m {
            return Outcome::Further;
        }
        radius_m = (1.15 * radius_m).min(reach_m);
    };
    let m2_per = 1.0 / per_m2;
    let mut farthest = 0;
    for (t, m2) in thresholds.iter().zip(&mut work.last_m2) {
        *m2 = (f64::from(*t) + 0.5) * m2_per;
        farthest = farthest.max(*t);
    }
    let farthest_m = ((f64::from(farthest) + 1.5) * m2_per).sqrt();
    work.radius_m = SPARE * (farthest_m + offset_m);
    choose(lanes, job, work, p, &thresholds);
    let inside = farthest_m + offset_m < job.field.loaded.margin_m(p) - RIM * radius_m;
    if !inside && !certain(job, work, p) {
        return Outcome::Known(None);
    }
    fetch(lanes, job, work, p);
    let sums = lanes.sums(&work.near, &job.weighting);
    Outcome::Known(Some(divergence_of(&sums, offset_m)))
}

/// A bound on the error of ranks: coordinates are `f32` relative to cells, so that each difference of two is off by
/// up to `each`, a distance by sqrt(3) times that, and its square (up to `complete_m`²) by twice that times the
/// distance; the square itself is rounded six times.
#[inline(always)]
fn error_in_ranks(grid: &Grid, at: DVec3, radius_m: f64, complete_m: f64) -> f64 {
    let ulp = f64::from(f32::EPSILON) / 2.0;
    let size = at.abs().max_element() + radius_m + grid.cell_m;
    let each = ulp * 3.0 * (size + radius_m) + 8.0 * f64::EPSILON * (grid.magnitude_m() + size);
    let relative = each / complete_m;
    COMPLETE * (relative * (3.5 + 3.0 * relative) + 6.0 * ulp)
}

/// Finds the sets of neighbours from the thresholds.
#[inline(always)]
fn choose<L: Lanes>(lanes: L, job: &Job<'_>, work: &mut Workspace, p: DVec3, thresholds: &Thresholds) {
    let k = job.stencil.neighbours as i32;
    let mut lower = *thresholds;
    for t in &mut lower {
        *t = (*t - 1).max(0);
    }
    let below = lanes.count(&work.keys, &lower);
    let clear = |q: usize| below[q] == k && thresholds[q] > 0;
    for q in 0..6 {
        lanes.members(&work.keys, q, thresholds[q] as u16, &mut work.sets[q]);
    }
    let mut all = true;
    for q in 0..6 {
        all &= clear(q);
    }
    if !all {
        for q in 0..6 {
            if !clear(q) {
                decide(job, work, p, q, thresholds[q]);
            }
        }
    }
}

/// Where a stencil point is: +x, -x, +y, -y, +z, -z.
#[inline(always)]
pub(super) fn stencil_point(p: DVec3, q: usize, offset_m: f64) -> DVec3 {
    let shift = DVec3::AXES[q / 2] * offset_m;
    if q.is_multiple_of(2) { p + shift } else { p - shift }
}

/// Decides between candidates of about the same distance by (distance², number) in `f64`.
#[cold]
#[inline(never)]
fn decide(job: &Job<'_>, work: &mut Workspace, p: DVec3, q: usize, threshold: i32) {
    let place = stencil_point(p, q, job.weighting.offset_m);
    let set = &mut work.sets[q];
    let mut between: Vec<(f64, u32, usize)> = undecided(&work.keys, q, threshold, set)
        .into_iter()
        .filter(|&i| i < work.ball.len)
        .map(|i| {
            let t = work.ball.id[i];
            (super::neighbours::distance2(job.field.centroids[t as usize], place), t, i)
        })
        .collect();
    between.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let sure: u32 = set.iter().map(|w| w.count_ones()).sum();
    for &(_, _, i) in between.iter().take(job.stencil.neighbours.saturating_sub(sure as usize)) {
        set[i / 64] |= 1 << (i % 64);
    }
}

/// Whether nothing beyond what was loaded could be as near as the farthest neighbour of each stencil point.
#[cold]
#[inline(never)]
fn certain(job: &Job<'_>, work: &Workspace, p: DVec3) -> bool {
    (0..6).all(|q| {
        let place = stencil_point(p, q, job.weighting.offset_m);
        let in_set = |i: &usize| work.sets[q][i / 64] >> (i % 64) & 1 == 1;
        let farthest = (0..work.ball.len)
            .filter(in_set)
            .map(|i| super::neighbours::distance2(job.field.centroids[work.ball.id[i] as usize], place))
            .fold(0.0, f64::max);
        farthest.sqrt() < job.field.loaded.margin_m(place)
    })
}

/// Fetches the neighbours of any stencil point in `f64`, and packs the sets accordingly.
#[inline(always)]
fn fetch<L: Lanes>(lanes: L, job: &Job<'_>, work: &mut Workspace, p: DVec3) {
    let words = work.keys.padded.div_ceil(64);
    let near = &mut work.near;
    for q in 0..6 {
        near.of[q][..words].fill(0);
    }
    let mut n = 0usize;
    for w in 0..words {
        let s = &work.sets;
        let any = s[0][w] | s[1][w] | s[2][w] | s[3][w] | s[4][w] | s[5][w];
        let (word, bit) = (n / 64, n % 64);
        for q in 0..6 {
            let packed = lanes.pack(work.sets[q][w], any);
            near.of[q][word] |= packed << bit;
            if bit > 0 && word + 1 < WORDS {
                near.of[q][word + 1] |= packed >> (64 - bit);
            }
        }
        n += lanes.choose(&work.ball.id[w * 64..w * 64 + 64], any, &mut near.id[n..]);
    }
    near.len = n;
    lanes.fetch(job.field, p, near);
}

/// The sum of one stencil point's neighbours.
pub(super) fn sum_of(field: &NormalField, found: &[(f64, u32)], p: DVec3, q: usize, weighting: &Weighting) -> Sum {
    let side = if q.is_multiple_of(2) { 1.0 } else { -1.0 };
    let mut sum = Sum::default();
    for &(_, t) in found {
        let u = field.centroids[t as usize] - p;
        sum.add(weighting.weight(weighting.distance2(u, q / 2, side)), field.normals[t as usize][q / 2]);
    }
    sum
}
