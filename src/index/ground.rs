//! The ground: where in plan the survey is, and how it is cut into cells.
//!
//! Only what triangles use counts: a stray vertex far away must not stretch the grid.

use super::cells::CellGrid;
use super::chunks::over_chunks;
use crate::geometry::DVec3;
use crate::open::Surface;
use crate::store::StoreError;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Triangles in an average cell: tiles are whole cells, so this is how finely a tile can be cut.
const TRIANGLES_PER_CELL: f64 = 64.0;
/// Vertices for each square in which the survey's area in plan is counted.
const VERTICES_PER_SQUARE: u64 = 16;
/// Most of these squares.
const MOST_SQUARES: f64 = 67_108_864.0;

/// What is known of a survey before anything is sorted.
pub(super) struct Ground {
    /// One bit for each vertex: whether a triangle uses it.
    pub(super) used: Bits,
    /// How many are used.
    pub(super) vertices: u64,
    /// Lowest corner of their box, local metres.
    pub(super) min: DVec3,
    /// Highest corner of it, local metres.
    pub(super) max: DVec3,
    /// The cells.
    pub(super) grid: CellGrid,
    /// Vertices in each row of cells.
    pub(super) in_row: Vec<u64>,
}

/// Bits that several threads may set.
pub(super) struct Bits(Vec<AtomicU64>);

impl Bits {
    fn new(len: u64) -> Bits {
        Bits((0..len.div_ceil(64)).map(|_| AtomicU64::new(0)).collect())
    }

    fn set(&self, i: u64) {
        let (word, bit) = (&self.0[(i / 64) as usize], 1 << (i % 64));
        // Most are set already, and looking is cheaper than locking.
        if word.load(Ordering::Relaxed) & bit == 0 {
            word.fetch_or(bit, Ordering::Relaxed);
        }
    }

    pub(super) fn get(&self, i: u64) -> bool {
        self.0[(i / 64) as usize].load(Ordering::Relaxed) >> (i % 64) & 1 == 1
    }

    fn count(&self) -> u64 {
        self.0.iter().map(|word| u64::from(word.load(Ordering::Relaxed).count_ones())).sum()
    }
}

/// Looks at the survey in a few sequential passes.
pub(super) fn look(surface: &dyn Surface) -> Result<Ground, StoreError> {
    let used = Bits::new(surface.vertices());
    over_chunks(
        surface,
        surface.triangles(),
        || Ok(()),
        |(), range| {
            range.for_each(|t| surface.triangle(t).into_iter().for_each(|v| used.set(v)));
            Ok(())
        },
    )?;
    let vertices = used.count();
    let (min, max) = bounds(surface, &used)?;
    let area_m2 = area_in_plan(surface, &used, vertices, (min, max))?;
    let triangles = surface.triangles();
    let grid = CellGrid::over(min, max, triangles, area_m2 / triangles.max(1) as f64, TRIANGLES_PER_CELL);
    let in_row: Vec<AtomicU64> = (0..grid.rows).map(|_| AtomicU64::new(0)).collect();
    each_used(surface, &used, |p| {
        in_row[grid.cell_of(p)[1] as usize].fetch_add(1, Ordering::Relaxed);
    })?;
    let in_row = in_row.into_iter().map(AtomicU64::into_inner).collect();
    Ok(Ground { used, vertices, min, max, grid, in_row })
}

fn each_used(surface: &dyn Surface, used: &Bits, look: impl Fn(DVec3) + Sync) -> Result<(), StoreError> {
    over_chunks(
        surface,
        surface.vertices(),
        || Ok(()),
        |(), range| {
            range.filter(|&v| used.get(v)).for_each(|v| look(surface.position(v)));
            Ok(())
        },
    )
}

fn bounds(surface: &dyn Surface, used: &Bits) -> Result<(DVec3, DVec3), StoreError> {
    let whole = Mutex::new((DVec3::INFINITY, DVec3::NEG_INFINITY));
    over_chunks(
        surface,
        surface.vertices(),
        || Ok(()),
        |(), range| {
            let (min, max) = range
                .filter(|&v| used.get(v))
                .map(|v| surface.position(v))
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
            let mut whole = whole.lock().unwrap_or_else(PoisonError::into_inner);
            *whole = (whole.0.min(min), whole.1.max(max));
            Ok(())
        },
    )?;
    Ok(whole.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Area of the squares that hold a vertex, m². A winding reach fills little of its box.
fn area_in_plan(
    surface: &dyn Surface,
    used: &Bits,
    vertices: u64,
    (min, max): (DVec3, DVec3),
) -> Result<f64, StoreError> {
    let squares = ((vertices / VERTICES_PER_SQUARE) as f64).clamp(1.0, MOST_SQUARES);
    let (width, height) = ((max.x - min.x).max(1e-9), (max.y - min.y).max(1e-9));
    let side = (width * height / squares).sqrt().max(width.max(height) / squares);
    let columns = (width / side).floor() as u64 + 1;
    let rows = (height / side).floor() as u64 + 1;
    let occupied = Bits::new(columns * rows);
    each_used(surface, used, |p| {
        let place = |x: f64, min: f64, n: u64| (((x - min) / side) as u64).min(n - 1);
        occupied.set(place(p.y, min.y, rows) * columns + place(p.x, min.x, columns));
    })?;
    Ok((occupied.count() as f64 * side * side).min(width * height))
}
