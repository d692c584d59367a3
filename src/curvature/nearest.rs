//! The distance to the nearest centroid at all vertices of a column of cells.
//!
//! Vertices of a cell share a list of candidates, and run in the lanes of vectors: the two least distances in `f32` of
//! each. Where rounding cannot have confused the two, one exact distance is left to compute. Otherwise the whole block is
//! looked at again, for all candidates that are as near within rounding. A distance is accepted if nothing outside the
//! list or the block can be nearer.

use super::block::Group;
use super::buffer::Points;
use super::grid::Grid;
use super::lanes::{Lanes, Plain};
use super::neighbours::{Reserve, distance2};
use crate::geometry::DVec3;
use crate::tile::NormalField;

/// Side of a cell in mean triangle sides.
pub(super) const CELL_SIDES: f64 = 5.2;
/// How far a list reaches beyond its vertices, in mean triangle sides.
const LIST_SIDES: f64 = 1.5;
/// Vertices that are worked together.
const TOGETHER: usize = 16;
/// Most candidates of a block.
const BLOCK: usize = 1 << 15;

/// Everything that all columns share.
pub(super) struct Job<'a> {
    /// The centroids.
    pub(super) grid: &'a Grid,
    /// The field they come from.
    pub(super) field: &'a NormalField,
    /// Where the distance is wanted.
    pub(super) points: &'a [DVec3],
    /// Mean side of a triangle, metres.
    pub(super) side_m: f64,
    /// The exact search, if needed.
    pub(super) reserve: &'a Reserve<'a>,
}

/// Buffers of a thread.
#[derive(Default)]
pub(super) struct Workspace {
    queue: Vec<(i32, u32)>,
    block: Points,
    near: Points,
    close: Vec<(u32, u32)>,
    again: Vec<(u32, DVec3)>,
}

/// Vertices of one column.
pub(super) struct Column<'a, 'j> {
    /// What all columns share.
    pub(super) job: &'a Job<'j>,
    /// Numbers of the vertices.
    pub(super) vertices: &'a [u32],
    /// Their distances, metres.
    pub(super) found: &'a mut [Option<f64>],
    /// Buffers.
    pub(super) work: &'a mut Workspace,
}

/// Works a column.
#[inline(always)]
pub(super) fn work<L: Lanes>(lanes: L, column: &mut Column<'_, '_>) {
    let Column { job, vertices, found, work } = column;
    let point = |i: u32| job.points[vertices[i as usize] as usize];
    work.queue.clear();
    work.queue.extend((0..vertices.len() as u32).map(|i| (job.grid.slot(point(i))[2], i)));
    work.queue.sort_unstable();
    work.close.clear();
    let mut rest = &work.queue[..];
    while let Some(&(level, first)) = rest.first() {
        let here = rest.iter().position(|e| e.0 != level).unwrap_or(rest.len());
        let slot = job.grid.slot(point(first));
        let centre = job.grid.centre(slot);
        let whole = job.grid.gather(slot, 1, BLOCK, &mut work.block);
        for group in rest[..here].chunks(TOGETHER) {
            let mut at = [DVec3::ZERO; TOGETHER];
            for (at, e) in at.iter_mut().zip(group) {
                *at = point(e.1) - centre;
            }
            let at = &at[..group.len()];
            let around = Group::around(at);
            around.narrow(lanes, &work.block, &mut work.near, (LIST_SIDES * job.side_m, 0.0));
            let two = Two::of(&work.near, &around, at);
            for (v, &(_, i)) in group.iter().enumerate() {
                let limit_m = two.limit_m(v, job, at[v]);
                let reach_m = job.grid.reach_m(slot, 1, at[v]).min(LIST_SIDES * job.side_m);
                let second_m = f64::from(two.second[v]).sqrt();
                if whole && limit_m < reach_m && limit_m < second_m {
                    work.close.push((i, work.near.id[two.nearest[v] as usize]));
                } else {
                    work.again.push((i, at[v]));
                }
            }
        }
        while let Some((i, at)) = work.again.pop() {
            if whole && candidates(job, &work.block, &mut work.near, (slot, at)) {
                work.close.extend(work.near.id[..work.near.len].iter().map(|&t| (i, t)));
            } else {
                found[i as usize] = job.reserve.nearest_m(point(i), job.side_m);
            }
        }
        rest = &rest[here..];
    }
    settle(job, &work.close, found, point);
}

/// The two least squared distances of vertices, m², and the candidate with the least.
struct Two {
    least: [f32; TOGETHER],
    second: [f32; TOGETHER],
    nearest: [u32; TOGETHER],
}

impl Two {
    /// Those of the listed candidates.
    #[inline(always)]
    fn of(list: &Points, around: &Group, at: &[DVec3]) -> Two {
        let [mut px, mut py, mut pz] = [[0f32; TOGETHER]; 3];
        let centre = DVec3::from_array(around.centre.map(f64::from));
        for (v, &at) in at.iter().enumerate() {
            [px[v], py[v], pz[v]] = (at - centre).as_vec3().to_array();
        }
        let (mut least, mut second) = ([f32::INFINITY; TOGETHER], [f32::INFINITY; TOGETHER]);
        let mut nearest = [0u32; TOGETHER];
        let (xs, ys, zs) = (&list.x[..list.len], &list.y[..list.len], &list.z[..list.len]);
        for (i, ((&x, &y), &z)) in xs.iter().zip(ys).zip(zs).enumerate() {
            for v in 0..TOGETHER {
                let (dx, dy, dz) = (x - px[v], y - py[v], z - pz[v]);
                let d2 = dx * dx + dy * dy + dz * dz;
                let nearer = d2 < least[v];
                let other = if nearer { least[v] } else { d2 };
                second[v] = if other < second[v] { other } else { second[v] };
                least[v] = if nearer { d2 } else { least[v] };
                nearest[v] = if nearer { i as u32 } else { nearest[v] };
            }
        }
        Two { least, second, nearest }
    }

    /// How far the nearest centroid of a vertex may seem to be, with rounding.
    #[inline(always)]
    fn limit_m(&self, v: usize, job: &Job<'_>, at: DVec3) -> f64 {
        limit_m(job, f64::from(self.least[v]).sqrt(), at)
    }
}

/// How far a candidate may seem to be that is as near as the one that seems to be nearest.
#[inline(always)]
fn limit_m(job: &Job<'_>, least_m: f64, at: DVec3) -> f64 {
    let size = at.abs().max_element() + least_m + job.grid.cell_m;
    let each = f64::from(f32::EPSILON) * 2.0 * size + 8.0 * f64::EPSILON * (job.grid.magnitude_m() + size);
    least_m * (1.0 + 1e-6) + 8.0 * each
}

/// Exact distances of the candidates (pairs of vertex and triangle, in the order of vertices). Apart from the search
/// for them, so that the processor waits for many of them at once.
#[inline(always)]
fn settle(job: &Job<'_>, close: &[(u32, u32)], found: &mut [Option<f64>], point: impl Fn(u32) -> DVec3) {
    let mut least = (u32::MAX, f64::INFINITY);
    for &(i, t) in close {
        let d2 = distance2(job.field.centroids[t as usize], point(i));
        least = if i == least.0 && least.1 < d2 { least } else { (i, d2) };
        found[i as usize] = Some(least.1.sqrt()).filter(|&d| d < job.field.loaded.margin_m(point(i)));
    }
}

/// Finds the candidates among which the nearest centroid is; false where the block may not hold it.
#[inline(always)]
fn candidates(job: &Job<'_>, block: &Points, near: &mut Points, (slot, at): ([i32; 3], DVec3)) -> bool {
    let here = at.as_vec3().to_array();
    let least_m = f64::from(Plain.least(block, here)).sqrt();
    let limit_m = limit_m(job, least_m, at);
    if limit_m >= job.grid.reach_m(slot, 1, at) || !least_m.is_finite() {
        return false;
    }
    Plain.keep_ball(block, here, (limit_m * limit_m) as f32, near);
    near.len > 0
}
