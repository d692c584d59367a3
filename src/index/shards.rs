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

/// For each row of cells its shard.
pub(super) fn of_rows(shards: &[Shard]) -> Vec<u32> {
    (0..).zip(shards).flat_map(|(i, shard)| shard.rows.clone().map(move |_| i)).collect()
}

/// Elements put behind one another by cell, and the first of each cell, with the end behind the last. `parts` gives
/// the elements with their cells, twice alike; within a cell their order stays.
pub(super) fn by_cell<T: Copy + Default, P: Iterator<Item = (u32, T)>>(
    cells: usize,
    parts: impl Fn() -> P,
) -> (Vec<T>, Vec<u32>) {
    // One place further on than where they belong: putting the elements moves them back.
    let mut start = vec![0u32; cells + 2];
    let mut n = 0;
    parts().for_each(|(cell, _)| {
        start[cell as usize + 2] += 1;
        n += 1;
    });
    for cell in 2..cells + 2 {
        start[cell] += start[cell - 1];
    }
    let mut placed = vec![T::default(); n];
    parts().for_each(|(cell, element)| {
        let place = &mut start[cell as usize + 1];
        placed[*place as usize] = element;
        *place += 1;
    });
    start.truncate(cells + 1);
    (placed, start)
}
