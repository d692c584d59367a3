//! Shards: bands of whole rows of cells, sorted one at a time in memory.

use super::cells::CellGrid;
use std::ops::Range;

/// A band of rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Shard {
    /// Its rows of cells.
    pub(super) rows: Range<u32>,
    /// Numbers of the vertices in them.
    pub(super) vertices: Range<u64>,
    /// The same, with the next row: triangles reach beyond their band to the north only.
    pub(super) window: Range<u64>,
}

/// Cuts the rows into bands of about `most` vertices: fewer, or one row.
pub(super) fn cut(in_row: &[u64], most: u64) -> Vec<Shard> {
    let mut shards: Vec<Shard> = Vec::new();
    let mut first = 0;
    for (row, &n) in (0u32..).zip(in_row) {
        match shards.last_mut() {
            Some(last) if last.vertices.end - last.vertices.start + n <= most => {
                last.rows.end = row + 1;
                last.vertices.end += n;
            }
            _ => shards.push(Shard { rows: row..row + 1, vertices: first..first + n, window: 0..0 }),
        }
        first += n;
    }
    for shard in &mut shards {
        let beyond = in_row.get(shard.rows.end as usize).copied().unwrap_or(0);
        shard.window = shard.vertices.start..shard.vertices.end + beyond;
    }
    shards
}

impl Shard {
    /// Numbers of its cells.
    pub(super) fn cells(&self, grid: &CellGrid) -> Range<usize> {
        grid.number([0, self.rows.start])..grid.number([0, self.rows.end])
    }
}

/// The shard that holds a vertex.
pub(super) fn holding(shards: &[Shard], vertex: u64) -> usize {
    shards.partition_point(|s| s.vertices.end <= vertex)
}

/// Places of the elements after sorting them by cell: `order[i]` is the element that comes `i`-th, and the
/// first place of each cell, with the end behind the last. Within a cell the order is that of the elements.
pub(super) fn by_cell(cells: usize, cell_of: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut start = vec![0u32; cells + 1];
    for &cell in cell_of {
        start[cell as usize + 1] += 1;
    }
    for i in 0..cells {
        start[i + 1] += start[i];
    }
    let mut next = start.clone();
    let mut order = vec![0u32; cell_of.len()];
    for (i, &cell) in (0u32..).zip(cell_of) {
        let slot = &mut next[cell as usize];
        order[*slot as usize] = i;
        *slot += 1;
    }
    (order, start)
}
