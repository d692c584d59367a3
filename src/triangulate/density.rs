//! How far apart points lie in plan, place by place: how far one must look for the neighbours of a point.
//!
//! Points are counted in square cells, and cells two by two in larger ones, and so on. The spacing at a place is that
//! of evenly spread points in the smallest of these squares that holds enough of them. It depends on the survey only.

use super::DrapeError;
use crate::geometry::DVec3;
use crate::open::{Surface, over_chunks_then, pieces};
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

/// Points of an average cell, if the survey filled its box.
const POINTS_PER_CELL: u64 = 8;
/// Cells, at most: 45 MB with the larger squares.
const MOST_CELLS: f64 = 8_388_608.0;
/// Points by which a square is judged: so many that a wall in it, which has many points in little plan, does not tell.
const ENOUGH: u32 = 1024;
/// Points by which a square is judged where it is only about speed.
const FEW: u32 = 16;
/// Parts of the box along each axis in which strays are looked for.
const PARTS: usize = 4096;
/// One point in so many may be a stray.
const STRAYS: u64 = 10_000;
/// Nor for less than this part of it: a high wall has many points in little plan.
const NARROWEST: f64 = 0.75;
/// The spacing is nowhere taken for more than so many times that of the whole survey: stray points far from one another
/// are no surface.
const WIDEST: f64 = 8.0;

/// Numbers of points, in squares of all sizes.
pub(super) struct Density {
    min: [f64; 2],
    cell_m: f64,
    /// From the smallest squares to the largest.
    levels: Vec<Level>,
    /// Spacing of evenly spread points where there are any, metres.
    pub(super) typical_m: f64,
    /// What all spacings are multiplied by, because points are there several times.
    wider: f64,
}

struct Level {
    columns: u32,
    count: Vec<u32>,
}

/// Whether a point is used, by its number in the cloud.
pub type Keep<'a> = &'a (dyn Fn(u64) -> bool + Sync);

impl Density {
    /// Counts the points that are kept, in two passes.
    ///
    /// # Errors
    /// No point is kept, or all are at one place in plan.
    pub(super) fn of(cloud: &dyn Surface, keep: Keep) -> Result<(Density, u64), DrapeError> {
        let (min, max, kept) = bounds(cloud, keep);
        let (min, max) = without_strays(cloud, keep, (min, max, kept));
        let (width, height) = ((max[0] - min[0]).max(1e-9), (max[1] - min[1]).max(1e-9));
        if kept < 3 || (max[0] <= min[0] && max[1] <= min[1]) {
            return Err(DrapeError::TooFew { points: cloud.vertices(), kept });
        }
        let most = ((kept / POINTS_PER_CELL) as f64).clamp(1.0, MOST_CELLS);
        let mut cell_m = (width * height / most).sqrt().max(width.max(height) / most);
        while (width / cell_m + 1.0).floor() * (height / cell_m + 1.0).floor() > most.max(4.0) {
            cell_m *= 1.125;
        }
        let (columns, rows) = ((width / cell_m) as u32 + 1, (height / cell_m) as u32 + 1);
        let count: Vec<AtomicU32> = (0..columns as usize * rows as usize).map(|_| AtomicU32::new(0)).collect();
        let mut density = Density { min, cell_m, levels: Vec::new(), typical_m: 0.0, wider: 1.0 };
        density.levels.push(Level { columns, count: Vec::new() });
        each_kept(
            cloud,
            keep,
            || (),
            |(), p| {
                let [column, row] = density.cell(p, rows);
                count[row as usize * columns as usize + column as usize].fetch_add(1, Ordering::Relaxed);
            },
            |()| (),
        );
        density.levels[0].count = count.into_iter().map(AtomicU32::into_inner).collect();
        density.gather();
        let occupied = density.levels[0].count.iter().filter(|&&n| n > 0).count();
        // Cells on the border are filled in part: what lies around a narrow survey is not its own.
        density.typical_m = (occupied as f64 * cell_m * cell_m / kept as f64).sqrt();
        Ok((density, kept))
    }

    /// Makes the larger squares of the smaller.
    fn gather(&mut self) {
        loop {
            let small = &self.levels[self.levels.len() - 1];
            let rows = small.count.len() as u32 / small.columns;
            if small.columns == 1 && rows == 1 {
                return;
            }
            let columns = small.columns.div_ceil(2);
            let mut count = vec![0u32; columns as usize * rows.div_ceil(2) as usize];
            for (i, &n) in small.count.iter().enumerate() {
                let (column, row) = (i % small.columns as usize, i / small.columns as usize);
                let to = &mut count[row / 2 * columns as usize + column / 2];
                *to = to.saturating_add(n);
            }
            self.levels.push(Level { columns, count });
        }
    }

    /// Columns and rows of cells.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.levels[0].columns, self.levels[0].count.len() as u32 / self.levels[0].columns]
    }

    /// Column and row of the cell of a point.
    #[inline]
    pub(super) fn cell_of(&self, p: DVec3) -> [u32; 2] {
        self.cell(p, self.size()[1])
    }

    #[inline]
    fn cell(&self, p: DVec3, rows: u32) -> [u32; 2] {
        let index = |x: f64, axis: usize, n: u32| (((x - self.min[axis]) / self.cell_m).max(0.0) as u32).min(n - 1);
        [index(p.x, 0, self.levels[0].columns), index(p.y, 1, rows)]
    }

    /// Points of a cell.
    pub(super) fn count(&self, [column, row]: [u32; 2]) -> u32 {
        self.levels[0].count[row as usize * self.levels[0].columns as usize + column as usize]
    }

    /// Lowest and highest corner of a block of cells, metres. Cells at the border hold what lies beyond them.
    pub(super) fn sides(&self, columns: &Range<u32>, rows: &Range<u32>) -> [[f64; 2]; 2] {
        let at = |axis: usize, cell: u32| self.min[axis] + f64::from(cell) * self.cell_m;
        // Cells at the border hold what lies beyond, however far.
        let [all_columns, all_rows] = self.size();
        let low = |axis, cell| if cell == 0 { f64::NEG_INFINITY } else { at(axis, cell) };
        let high = |axis, cell, all| if cell == all { f64::INFINITY } else { at(axis, cell) };
        let high = [high(0, columns.end, all_columns), high(1, rows.end, all_rows)];
        [[low(0, columns.start), low(1, rows.start)], high]
    }

    /// Makes all spacings so many times wider.
    pub(super) fn widen(&mut self, times: f64) {
        self.wider *= times;
        self.typical_m *= times;
    }

    /// Spacing of the points around a cell by the smallest square that holds some, metres: how dense it is there.
    pub(super) fn finest_m(&self, cell: [u32; 2]) -> f64 {
        self.square_m(cell, FEW).clamp(1e-9, self.spacing_m(cell))
    }

    /// A block of cells and what lies up to so far around it.
    pub(super) fn grown(&self, columns: &Range<u32>, rows: &Range<u32>, by_m: f64) -> [Range<u32>; 2] {
        let cells = (by_m / self.cell_m).ceil() as u32;
        let grow = |r: &Range<u32>, n: u32| r.start.saturating_sub(cells)..r.end.saturating_add(cells).min(n);
        let [all_columns, all_rows] = self.size();
        [grow(columns, all_columns), grow(rows, all_rows)]
    }

    /// Widest spacing in a block of cells, where it holds points, metres.
    pub(super) fn widest_m(&self, columns: &Range<u32>, rows: &Range<u32>) -> f64 {
        let cells = rows.clone().flat_map(|row| columns.clone().map(move |column| [column, row]));
        cells.filter(|&cell| self.count(cell) > 0).map(|cell| self.spacing_m(cell)).fold(0.0, f64::max)
    }

    /// How far a place is from a block of cells, metres; 0 within.
    pub(super) fn distance_m(&self, p: DVec3, columns: &Range<u32>, rows: &Range<u32>) -> f64 {
        let [low, high] = self.sides(columns, rows);
        let beyond = |x: f64, axis: usize| (low[axis] - x).max(x - high[axis]).max(0.0);
        beyond(p.x, 0).hypot(beyond(p.y, 1))
    }

    /// Spacing of the points around a cell, metres.
    pub(super) fn spacing_m(&self, cell: [u32; 2]) -> f64 {
        let (narrowest_m, widest_m) = (NARROWEST * self.typical_m, WIDEST * self.typical_m);
        self.square_m(cell, ENOUGH).clamp(narrowest_m, widest_m)
    }

    /// Spacing of evenly spread points in the smallest square around a cell that holds so many, metres.
    fn square_m(&self, [column, row]: [u32; 2], enough: u32) -> f64 {
        let mut spacing_m = f64::INFINITY;
        for (up, level) in self.levels.iter().enumerate() {
            let n = level.count[(row >> up) as usize * level.columns as usize + (column >> up) as usize];
            let side_m = self.cell_m * (1u64 << up) as f64;
            spacing_m = (side_m * side_m / f64::from(n.max(1))).sqrt() * self.wider;
            if n >= enough {
                break;
            }
        }
        spacing_m
    }
}

/// Goes over all points that are kept, on all threads; `end` gets the state of each.
pub(super) fn each_kept<S>(
    cloud: &dyn Surface,
    keep: Keep,
    start: impl Fn() -> S + Sync,
    look: impl Fn(&mut S, DVec3) + Sync,
    end: impl Fn(S) + Sync,
) {
    let passed: Result<(), std::convert::Infallible> = over_chunks_then(
        cloud,
        cloud.vertices(),
        || Ok((start(), Vec::new())),
        |(state, positions), range| {
            for piece in pieces(range) {
                cloud.positions(piece.clone(), positions);
                piece.zip(&*positions).filter(|&(i, _)| keep(i)).for_each(|(_, &p)| look(state, p));
            }
            Ok(())
        },
        |(state, _)| {
            end(state);
            Ok(())
        },
    );
    match passed {
        Ok(()) => (),
    }
}

/// The box in which nearly all points lie, where it is much smaller than that of all: stray points, however far, must not
/// make the cells so large that nothing can be told apart.
fn without_strays(
    cloud: &dyn Surface,
    keep: Keep,
    (mut min, mut max, kept): ([f64; 2], [f64; 2], u64),
) -> ([f64; 2], [f64; 2]) {
    loop {
        let width = [0, 1].map(|axis| max[axis] - min[axis]);
        let whole = Mutex::new([vec![0u64; PARTS], vec![0u64; PARTS]]);
        let part = |p: DVec3, axis: usize| {
            ((p[axis] - min[axis]) / width[axis].max(1e-9) * PARTS as f64).clamp(0.0, PARTS as f64 - 1.0) as usize
        };
        each_kept(
            cloud,
            keep,
            || [vec![0u64; PARTS], vec![0u64; PARTS]],
            |counts, p| (0..2).for_each(|axis| counts[axis][part(p, axis)] += 1),
            |counts| {
                let mut whole = whole.lock().unwrap_or_else(PoisonError::into_inner);
                for (all, of_thread) in whole.iter_mut().flatten().zip(counts.iter().flatten()) {
                    *all += of_thread;
                }
            },
        );
        let counts = whole.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut smaller = false;
        let (old_min, old_max) = (min, max);
        for axis in 0..2 {
            let edge = |counts: &mut dyn Iterator<Item = &u64>| {
                let mut before = 0;
                counts
                    .take_while(|&&n| {
                        before += n;
                        before <= kept / STRAYS
                    })
                    .count() as f64
            };
            let first = edge(&mut counts[axis].iter());
            let last = PARTS as f64 - edge(&mut counts[axis].iter().rev());
            let (one, spare) = (width[axis] / PARTS as f64, 0.1 * (last - first) + 1.0);
            if (last - first) * 2.0 < PARTS as f64 {
                min[axis] = (old_min[axis] + (first - spare) * one).max(old_min[axis]);
                max[axis] = (old_min[axis] + (last + spare) * one).min(old_max[axis]);
                smaller |= max[axis] - min[axis] < 0.75 * width[axis];
            }
        }
        if !smaller {
            return (min, max);
        }
    }
}

/// Lowest and highest place in plan of the points that are kept, metres, and how many there are.
fn bounds(cloud: &dyn Surface, keep: Keep) -> ([f64; 2], [f64; 2], u64) {
    let nothing = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], 0u64);
    let whole = Mutex::new(nothing);
    each_kept(
        cloud,
        keep,
        || nothing,
        |(min, max, kept), p| {
            (*min, *max) = ([min[0].min(p.x), min[1].min(p.y)], [max[0].max(p.x), max[1].max(p.y)]);
            *kept += 1;
        },
        |(min, max, kept)| {
            let mut all = whole.lock().unwrap_or_else(PoisonError::into_inner);
            all.0 = [all.0[0].min(min[0]), all.0[1].min(min[1])];
            all.1 = [all.1[0].max(max[0]), all.1[1].max(max[1])];
            all.2 += kept;
        },
    );
    whole.into_inner().unwrap_or_else(PoisonError::into_inner)
}
