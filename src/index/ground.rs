//! The ground: where in plan the survey is, and how it is cut into cells.
//!
//! Only what triangles use counts: a stray vertex far away must not stretch the grid.

use super::cells::{CellGrid, Steps};
use crate::geometry::DVec3;
use crate::open::Surface;
use crate::open::{over_chunks, over_chunks_then, pieces};
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
        || Ok(Vec::new()),
        |corners, range| {
            for piece in pieces(range) {
                surface.corner_numbers(piece, corners);
                corners.iter().flatten().for_each(|&v| used.set(v));
            }
            Ok(())
        },
    )?;
    let vertices = used.count();
    let (min, max) = match surface.bounds() {
        Some(of_all) if vertices == surface.vertices() => of_all,
        _ => bounds(surface, &used)?,
    };
    let area_m2 = area_in_plan(surface, &used, vertices, (min, max))?;
    let triangles = surface.triangles();
    let grid = CellGrid::over(min, max, triangles, area_m2 / triangles.max(1) as f64, TRIANGLES_PER_CELL);
    let in_row = in_rows(surface, &used, &grid)?;
    Ok(Ground { used, vertices, min, max, grid, in_row })
}

/// Looks at every vertex that is used. What threads have seen is `merged` in no particular order.
fn each_used<S: Clone + Sync + Send>(
    surface: &dyn Surface,
    used: &Bits,
    nothing: S,
    look: impl Fn(&mut S, DVec3) + Sync,
    merge: impl Fn(&mut S, S) + Sync,
) -> Result<S, StoreError> {
    let whole = Mutex::new(nothing.clone());
    over_chunks_then(
        surface,
        surface.vertices(),
        || Ok((nothing.clone(), Vec::new())),
        |(seen, positions), range| {
            for piece in pieces(range) {
                surface.positions(piece.clone(), positions);
                piece.zip(&*positions).filter(|&(v, _)| used.get(v)).for_each(|(_, &p)| look(seen, p));
            }
            Ok(())
        },
        |(seen, _)| {
            merge(&mut whole.lock().unwrap_or_else(PoisonError::into_inner), seen);
            Ok(())
        },
    )?;
    Ok(whole.into_inner().unwrap_or_else(PoisonError::into_inner))
}

fn bounds(surface: &dyn Surface, used: &Bits) -> Result<(DVec3, DVec3), StoreError> {
    each_used(
        surface,
        used,
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(min, max), p| (*min, *max) = (min.min(p), max.max(p)),
        |(min, max), of_thread| (*min, *max) = (min.min(of_thread.0), max.max(of_thread.1)),
    )
}

/// Vertices in each row of cells.
fn in_rows(surface: &dyn Surface, used: &Bits, grid: &CellGrid) -> Result<Vec<u64>, StoreError> {
    let finder = grid.finder();
    each_used(
        surface,
        used,
        vec![0; grid.rows as usize],
        |in_row, p| in_row[finder.row_of(p) as usize] += 1,
        |in_row, of_thread| in_row.iter_mut().zip(of_thread).for_each(|(all, n)| *all += n),
    )
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
    let columns = (width / side).floor() as u32 + 1;
    let rows = (height / side).floor() as u32 + 1;
    let occupied = Bits::new(u64::from(columns) * u64::from(rows));
    let (east, north) = (Steps::new(min.x, side, columns), Steps::new(min.y, side, rows));
    let look = |(): &mut (), p: DVec3| {
        occupied.set(u64::from(north.of(p.y)) * u64::from(columns) + u64::from(east.of(p.x)));
    };
    each_used(surface, used, (), look, |(), ()| ())?;
    Ok((occupied.count() as f64 * side * side).min(width * height))
}
