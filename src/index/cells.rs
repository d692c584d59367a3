//! Square cells in plan, and which triangles and vertices lie in which.

use crate::geometry::{DVec3, PlanBox};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A grid of square cells that covers the survey in plan.
///
/// It depends on the survey only, never on the tiling: tiles are blocks of whole cells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellGrid {
    /// South-west corner, local metres.
    pub min: [f64; 2],
    /// Side of a cell, metres.
    pub cell_m: f64,
    /// Cells from west to east.
    pub columns: u32,
    /// Cells from south to north.
    pub rows: u32,
}

/// A block of cells: columns and rows, each from first to one past the last.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CellBlock {
    /// West to east.
    pub columns: Range<u32>,
    /// South to north.
    pub rows: Range<u32>,
}

impl CellGrid {
    /// A grid over the box whose cells hold about `per_cell` of `triangles` evenly spread triangles.
    ///
    /// A long winding reach leaves most cells of its box empty: their number is held below a few times
    /// that of the triangles, and below 2^26, by larger cells.
    pub fn over(min: DVec3, max: DVec3, triangles: u64, mean_triangle_area_m2: f64, per_cell: f64) -> CellGrid {
        let (width, height) = ((max.x - min.x).max(1e-9), (max.y - min.y).max(1e-9));
        let most = (triangles as f64 * 4.0).clamp(16.0, 67_108_864.0);
        let mut cell_m = (mean_triangle_area_m2 * per_cell).sqrt().max(width.max(height) * 1e-6);
        while (width / cell_m + 1.0) * (height / cell_m + 1.0) > most {
            cell_m *= 1.25;
        }
        let count = |length: f64| (length / cell_m).floor() as u32 + 1;
        CellGrid { min: [min.x, min.y], cell_m, columns: count(width), rows: count(height) }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    /// Whether the grid has no cells; it never is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What finds the cells of points.
    pub(super) fn finder(&self) -> CellFinder {
        CellFinder {
            columns: Steps::new(self.min[0], self.cell_m, self.columns),
            rows: Steps::new(self.min[1], self.cell_m, self.rows),
        }
    }

    /// Row-major number of a cell.
    pub fn number(&self, cell: [u32; 2]) -> usize {
        cell[1] as usize * self.columns as usize + cell[0] as usize
    }

    /// Column and row of a cell by its number.
    pub fn place(&self, number: usize) -> [u32; 2] {
        [(number % self.columns as usize) as u32, (number / self.columns as usize) as u32]
    }

    /// The block of all cells.
    pub fn all(&self) -> CellBlock {
        CellBlock { columns: 0..self.columns, rows: 0..self.rows }
    }

    /// The block grown by `cells` on every side, cut off at the grid's border.
    pub fn grown(&self, block: &CellBlock, cells: u32) -> CellBlock {
        let grow = |r: &Range<u32>, n: u32| r.start.saturating_sub(cells)..r.end.saturating_add(cells).min(n);
        CellBlock { columns: grow(&block.columns, self.columns), rows: grow(&block.rows, self.rows) }
    }

    /// The block in plan, local metres. Where it reaches the grid's border it is infinite, since nothing
    /// lies beyond.
    pub fn plan(&self, block: &CellBlock) -> PlanBox {
        let side = |i: usize, cell: u32| self.min[i] + f64::from(cell) * self.cell_m;
        let low = |i, r: &Range<u32>| if r.start == 0 { f64::NEG_INFINITY } else { side(i, r.start) };
        let high = |i, r: &Range<u32>, n| if r.end >= n { f64::INFINITY } else { side(i, r.end) };
        PlanBox {
            min: [low(0, &block.columns), low(1, &block.rows)],
            max: [high(0, &block.columns, self.columns), high(1, &block.rows, self.rows)],
        }
    }

    /// The block in plan with its true sides, local metres.
    pub fn outline(&self, block: &CellBlock) -> PlanBox {
        let side = |i: usize, cell: u32| self.min[i] + f64::from(cell) * self.cell_m;
        PlanBox {
            min: [side(0, block.columns.start), side(1, block.rows.start)],
            max: [side(0, block.columns.end), side(1, block.rows.end)],
        }
    }
}

/// Finds the cells of points.
#[derive(Clone, Copy)]
pub(super) struct CellFinder {
    columns: Steps,
    rows: Steps,
}

impl CellFinder {
    /// Column and row of a point; points beyond the border belong to the border cells.
    #[inline]
    pub(super) fn cell_of(&self, p: DVec3) -> [u32; 2] {
        [self.columns.of(p.x), self.row_of(p)]
    }

    /// Row of a point.
    #[inline]
    pub(super) fn row_of(&self, p: DVec3) -> u32 {
        self.rows.of(p.y)
    }
}

/// Counts the whole steps from a first place to others: `(x - first) / step`, cut off, and held within 0 and the last.
#[derive(Clone, Copy)]
pub(super) struct Steps {
    first: f64,
    step: f64,
    per_unit: f64,
    last: u32,
}

/// A product with the reciprocal is nearer to the quotient than this, as long as both are below 2^27.
const QUOTIENT_MARGIN: f64 = 1e-6;

impl Steps {
    /// `count` steps, at most 2^27.
    pub(super) fn new(first: f64, step: f64, count: u32) -> Steps {
        Steps { first, step, per_unit: 1.0 / step, last: count - 1 }
    }

    #[inline]
    pub(super) fn of(&self, x: f64) -> u32 {
        let length = x - self.first;
        // Dividing takes long, and is asked only where the product is so near a whole number that it could tell.
        let product = length * self.per_unit;
        let whole = product as u32;
        let part = product - f64::from(whole);
        let sure = part > QUOTIENT_MARGIN && part < 1.0 - QUOTIENT_MARGIN;
        // The conversion cuts off towards 0, and gives 0 below it.
        let steps = if sure { whole } else { (length / self.step) as u32 };
        steps.min(self.last)
    }
}

impl CellBlock {
    /// Whether the block holds a cell.
    pub fn contains(&self, cell: [u32; 2]) -> bool {
        self.columns.contains(&cell[0]) && self.rows.contains(&cell[1])
    }
}

/// How many elements lie in each cell, when elements are numbered by cell: those of a row of cells follow
/// one another.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CellStarts(Vec<u64>);

impl CellStarts {
    /// From the first element of each cell, with the end behind the last.
    pub(super) fn new(start: Vec<u64>) -> CellStarts {
        CellStarts(start)
    }

    /// The first element of each cell, with the end behind the last.
    pub(super) fn starts(&self) -> &[u64] {
        &self.0
    }

    /// Elements of the block: one range for each row, ascending; ranges that meet are one.
    pub fn ranges(&self, grid: &CellGrid, block: &CellBlock) -> Vec<Range<u64>> {
        let mut ranges: Vec<Range<u64>> = Vec::new();
        for row in self.rows(grid, block).filter(|row| !row.is_empty()) {
            match ranges.last_mut() {
                Some(last) if last.end == row.start => last.end = row.end,
                _ => ranges.push(row),
            }
        }
        ranges
    }

    /// Number of the cell that holds an element, and the first element behind that cell.
    pub fn cell_of(&self, element: u64) -> (usize, u64) {
        let behind = self.0.partition_point(|&start| start <= element);
        (behind - 1, self.0[behind])
    }

    /// Number of elements in the block.
    pub fn count(&self, grid: &CellGrid, block: &CellBlock) -> u64 {
        self.rows(grid, block).map(|row| row.end - row.start).sum()
    }

    /// Number of cells that hold anything.
    pub fn occupied_cells(&self) -> u64 {
        self.0.windows(2).filter(|w| w[1] > w[0]).count() as u64
    }

    /// Boxes in plan, local metres, of the runs of cells that hold anything: where the survey is.
    pub fn occupied(&self, grid: &CellGrid) -> Vec<PlanBox> {
        let holds = |column: u32, row: u32| {
            let cell = grid.number([column, row]);
            self.0[cell + 1] > self.0[cell]
        };
        let mut boxes = Vec::new();
        for row in 0..grid.rows {
            let mut column = 0;
            while column < grid.columns {
                let first = column;
                while column < grid.columns && holds(column, row) {
                    column += 1;
                }
                if column > first {
                    boxes.push(grid.outline(&CellBlock { columns: first..column, rows: row..row + 1 }));
                }
                column += 1;
            }
        }
        boxes
    }

    fn rows<'a>(&'a self, grid: &'a CellGrid, block: &'a CellBlock) -> impl Iterator<Item = Range<u64>> + 'a {
        let columns = block.columns.clone();
        block.rows.clone().filter(move |_| !columns.is_empty()).map(move |row| {
            let first = grid.number([block.columns.start, row]);
            let last = grid.number([block.columns.end - 1, row]);
            self.0[first]..self.0[last + 1]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_those_of_a_division() {
        for (first, step, count) in [(0.0, 0.1, 1000), (-3.7, 1e-4, 1 << 26), (12.25, 7.3, 3), (0.1, 0.3, 1 << 20)] {
            let steps = Steps::new(first, step, count);
            let divided = |x: f64| (((x - first) / step).floor().max(0.0) as u32).min(count - 1);
            let mut near = vec![first - 1e9, first - step, first, first + 1e9, f64::MAX];
            for k in (0..2000).map(|i| i * i * 17 + i).chain([f64::from(count) as i64, i64::from(count) - 1]) {
                let at = first + k as f64 * step;
                let (below, above) = (at.next_down(), at.next_up());
                near.extend([below.next_down(), below, at, above, above.next_up(), at + 0.37 * step]);
            }
            for x in near {
                assert_eq!(steps.of(x), divided(x), "{x:e} from {first} by {step}");
            }
        }
    }
}
