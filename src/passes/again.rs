//! What is looked at again: open triangles, gathered into small blocks of cells.

use crate::index::{CellBlock, Index};

/// Open triangles that are near one another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Cluster {
    /// The block of cells that holds them.
    pub(super) cells: CellBlock,
    /// Their survey numbers, ascending.
    pub(super) triangles: Vec<u64>,
}

/// Gathers triangles, given by ascending survey number. Blocks are joined where, grown by `halo` cells, one
/// block is less work than two.
pub(super) fn clusters(index: &Index, triangles: &[u64], halo: u32) -> Vec<Cluster> {
    let mut joined: Vec<Cluster> = Vec::new();
    for cluster in by_cell(index, triangles) {
        add(&mut joined, cluster, halo);
    }
    for cluster in &mut joined {
        cluster.triangles.sort_unstable();
    }
    joined
}

/// One cluster for each cell: cells hold consecutive triangles.
fn by_cell(index: &Index, triangles: &[u64]) -> Vec<Cluster> {
    let mut found = Vec::new();
    let mut rest = triangles;
    while let Some(&first) = rest.first() {
        let (cell, end) = index.triangles.cell_of(first);
        let (inside, after) = rest.split_at(rest.partition_point(|&t| t < end));
        rest = after;
        let [column, row] = index.grid.place(cell);
        let cells = CellBlock { columns: column..column + 1, rows: row..row + 1 };
        found.push(Cluster { cells, triangles: inside.to_vec() });
    }
    found
}

/// Adds a cluster to one that it fits, and goes on while that makes others fit.
fn add(joined: &mut Vec<Cluster>, mut cluster: Cluster, halo: u32) {
    while let Some(i) = joined.iter().rposition(|other| fits(&other.cells, &cluster.cells, halo)) {
        let mut other = joined.swap_remove(i);
        other.cells = union(&other.cells, &cluster.cells);
        other.triangles.append(&mut cluster.triangles);
        cluster = other;
    }
    joined.push(cluster);
}

fn fits(a: &CellBlock, b: &CellBlock, halo: u32) -> bool {
    work(&union(a, b), halo) <= work(a, halo) + work(b, halo)
}

/// Cells of a block with its halo.
fn work(block: &CellBlock, halo: u32) -> u64 {
    let side = |r: &std::ops::Range<u32>| u64::from(r.end - r.start) + 2 * u64::from(halo);
    side(&block.columns) * side(&block.rows)
}

fn union(a: &CellBlock, b: &CellBlock) -> CellBlock {
    let both = |a: &std::ops::Range<u32>, b: &std::ops::Range<u32>| a.start.min(b.start)..a.end.max(b.end);
    CellBlock { columns: both(&a.columns, &b.columns), rows: both(&a.rows, &b.rows) }
}
