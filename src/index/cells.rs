//! Square cells in plan, and which triangles and vertices lie in which.

use crate::geometry::{DVec3, PlanBox};
use std::ops::Range;

/// A grid of square cells that covers the survey in plan.
///
/// It depends on the survey only, never on the tiling: tiles are blocks of whole cells.
#[derive(Debug, Clone, PartialEq)]
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

    /// Column and row of a point; points beyond the border belong to the border cells.
    pub fn cell_of(&self, p: DVec3) -> [u32; 2] {
        let place = |x: f64, min: f64, n: u32| (((x - min) / self.cell_m).floor().max(0.0) as u32).min(n - 1);
        [place(p.x, self.min[0], self.columns), place(p.y, self.min[1], self.rows)]
    }

    /// Row-major number of a cell.
    pub fn number(&self, cell: [u32; 2]) -> usize {
        cell[1] as usize * self.columns as usize + cell[0] as usize
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

impl CellBlock {
    /// Whether the block holds a cell.
    pub fn contains(&self, cell: [u32; 2]) -> bool {
        self.columns.contains(&cell[0]) && self.rows.contains(&cell[1])
    }
}

/// Which elements lie in which cell: for each cell its elements in ascending order.
#[derive(Debug, Clone, Default)]
pub struct CellLists {
    start: Vec<u64>,
    ids: Vec<u64>,
}

impl CellLists {
    /// Sorts elements 0, 1, 2, ... into the cells given by their numbers.
    pub fn build(cells: usize, cell_of: &[u32]) -> CellLists {
        let mut start = vec![0u64; cells + 1];
        for &cell in cell_of {
            start[cell as usize + 1] += 1;
        }
        for i in 0..cells {
            start[i + 1] += start[i];
        }
        let mut next = start.clone();
        let mut ids = vec![0u64; cell_of.len()];
        for (id, &cell) in cell_of.iter().enumerate() {
            let slot = &mut next[cell as usize];
            ids[*slot as usize] = id as u64;
            *slot += 1;
        }
        CellLists { start, ids }
    }

    /// Elements of the block, ascending.
    pub fn in_block(&self, grid: &CellGrid, block: &CellBlock) -> Vec<u64> {
        let mut found = Vec::with_capacity(self.count(grid, block) as usize);
        for span in self.spans(grid, block) {
            found.extend_from_slice(&self.ids[span]);
        }
        found.sort_unstable();
        found
    }

    /// Number of elements in the block.
    pub fn count(&self, grid: &CellGrid, block: &CellBlock) -> u64 {
        self.spans(grid, block).map(|s| s.len() as u64).sum()
    }

    /// Boxes in plan, local metres, of the runs of cells that hold anything: where the survey is.
    pub fn occupied(&self, grid: &CellGrid) -> Vec<PlanBox> {
        let holds = |column: u32, row: u32| {
            let cell = grid.number([column, row]);
            self.start[cell + 1] > self.start[cell]
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

    /// One run of elements for each row of the block: cells of a row lie side by side.
    fn spans<'a>(&'a self, grid: &'a CellGrid, block: &'a CellBlock) -> impl Iterator<Item = Range<usize>> + 'a {
        let columns = block.columns.clone();
        block.rows.clone().filter(move |_| !columns.is_empty()).map(move |row| {
            let first = grid.number([block.columns.start, row]);
            let last = grid.number([block.columns.end - 1, row]);
            self.start[first] as usize..self.start[last + 1] as usize
        })
    }
}
