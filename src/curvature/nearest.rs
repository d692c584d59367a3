//! The distance to the nearest centroid at all vertices of a column of cells.
//!
//! The least distance in `f32` over the gathered block, then the exact distances of the few candidates that are as
//! near within rounding. It is accepted if nothing outside the block can be nearer.

use super::buffer::Points;
use super::grid::Grid;
use super::lanes::Lanes;
use super::neighbours::{Reserve, distance2};
use crate::geometry::DVec3;
use crate::tile::NormalField;

/// Side of a cell in mean triangle sides.
pub(super) const CELL_SIDES: f64 = 3.5;
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
    let mut level = None;
    let mut whole = false;
    for &(iz, i) in &work.queue {
        let p = point(i);
        let slot = job.grid.slot(p);
        if level != Some(iz) {
            level = Some(iz);
            whole = job.grid.gather(slot, 1, BLOCK, &mut work.block);
        }
        let at = p - job.grid.centre(slot);
        if whole && candidates(lanes, job, &work.block, &mut work.near, (slot, at)) {
            work.close.extend(work.near.id[..work.near.len].iter().map(|&t| (i, t)));
        } else {
            found[i as usize] = job.reserve.nearest_m(p, job.side_m);
        }
    }
    settle(job, &work.close, found, point);
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
fn candidates<L: Lanes>(
    lanes: L,
    job: &Job<'_>,
    block: &Points,
    near: &mut Points,
    (slot, at): ([i32; 3], DVec3),
) -> bool {
    let here = at.as_vec3().to_array();
    let least_m = f64::from(lanes.least(block, here)).sqrt();
    let size = at.abs().max_element() + least_m + job.grid.cell_m;
    let each = f64::from(f32::EPSILON) * 2.0 * size + 8.0 * f64::EPSILON * (job.grid.magnitude_m() + size);
    let limit_m = least_m * (1.0 + 1e-6) + 8.0 * each;
    if limit_m >= job.grid.reach_m(slot, 1, at) || !least_m.is_finite() {
        return false;
    }
    lanes.keep_ball(block, here, (limit_m * limit_m) as f32, near);
    near.len > 0
}
