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
pub const CELL_SIDES: f64 = 3.0;
/// Most candidates of a block.
const BLOCK: usize = 1 << 15;

/// Everything that all columns share.
pub struct Job<'a> {
    /// The centroids.
    pub grid: &'a Grid,
    /// The field they come from.
    pub field: &'a NormalField,
    /// Where the distance is wanted.
    pub points: &'a [DVec3],
    /// Mean side of a triangle, metres.
    pub side_m: f64,
    /// The exact search, if needed.
    pub reserve: &'a Reserve<'a>,
}

/// Buffers of a thread.
#[derive(Default)]
pub struct Workspace {
    queue: Vec<(i32, u32)>,
    block: Points,
    near: Points,
}

/// Vertices of one column.
pub struct Column<'a, 'j> {
    /// What all columns share.
    pub job: &'a Job<'j>,
    /// Numbers of the vertices.
    pub vertices: &'a [u32],
    /// Their distances, metres.
    pub found: &'a mut [Option<f64>],
    /// Buffers.
    pub work: &'a mut Workspace,
}

/// Works a column.
#[inline(always)]
pub fn work<L: Lanes>(lanes: L, column: &mut Column<'_, '_>) {
    let Column { job, vertices, found, work } = column;
    let point = |i: u32| job.points[vertices[i as usize] as usize];
    work.queue.clear();
    work.queue.extend((0..vertices.len() as u32).map(|i| (job.grid.slot(point(i))[2], i)));
    work.queue.sort_unstable();
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
        let value = if whole { vertex(lanes, job, &work.block, &mut work.near, (slot, at, p)) } else { None };
        found[i as usize] = match value {
            Some(d) => Some(d).filter(|&d| d < job.field.loaded.margin_m(p)),
            None => job.reserve.nearest_m(p, job.side_m),
        };
    }
}

/// Exact distance to the nearest centroid, if the block surely holds it.
#[inline(always)]
fn vertex<L: Lanes>(
    lanes: L,
    job: &Job<'_>,
    block: &Points,
    near: &mut Points,
    (slot, at, p): ([i32; 3], DVec3, DVec3),
) -> Option<f64> {
    let here = at.as_vec3().to_array();
    let least_m = f64::from(lanes.least(block, here)).sqrt();
    let size = at.abs().max_element() + least_m + job.grid.cell_m;
    let each = f64::from(f32::EPSILON) * 2.0 * size + 8.0 * f64::EPSILON * (job.grid.magnitude_m() + size);
    let limit_m = least_m * (1.0 + 1e-6) + 8.0 * each;
    if limit_m >= job.grid.reach_m(slot, 1, at) || !least_m.is_finite() {
        return None;
    }
    lanes.keep_ball(block, here, (limit_m * limit_m) as f32, near);
    let exact = near.id[..near.len].iter().map(|&t| distance2(job.field.centroids[t as usize], p));
    Some(exact.fold(f64::INFINITY, f64::min).sqrt())
}
