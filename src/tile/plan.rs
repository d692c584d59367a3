//! Planning: how the survey is cut into tiles.

use crate::index::{CellBlock, CellGrid, Index};

/// One tile: its number and the cells of its core.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tile {
    /// Row-major number in the plan.
    pub id: u64,
    /// The core, whole cells of the index.
    pub core: CellBlock,
}

/// All tiles that hold anything, in row-major order.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The tiles.
    pub tiles: Vec<Tile>,
    /// Side of a core, metres (those at the north and east border may be shorter).
    pub tile_size_m: f64,
}

impl Plan {
    /// Cuts the survey into cores of about `tile_size_m`, rounded to whole cells of the index (at least
    /// one). Blocks without vertices and triangles are left out.
    pub fn new(index: &Index, tile_size_m: f64) -> Plan {
        let grid = &index.grid;
        let side = ((tile_size_m / grid.cell_m).round() as u32).clamp(1, grid.columns.max(grid.rows));
        let mut tiles = Vec::new();
        for (j, row) in (0..grid.rows).step_by(side as usize).enumerate() {
            for (i, column) in (0..grid.columns).step_by(side as usize).enumerate() {
                let core = CellBlock {
                    columns: column..(column + side).min(grid.columns),
                    rows: row..(row + side).min(grid.rows),
                };
                if index.vertices.count(grid, &core) + index.triangles.count(grid, &core) > 0 {
                    let id = j as u64 * u64::from(grid.columns.div_ceil(side)) + i as u64;
                    tiles.push(Tile { id, core });
                }
            }
        }
        Plan { tiles, tile_size_m: f64::from(side) * grid.cell_m }
    }

    /// The side of a core that lets `workers` tiles with halos of `halo_m` fit `budget_bytes`, metres.
    ///
    /// A survey that fits, and is small, is one tile. Otherwise cores need not be larger than a few million
    /// triangles, nor narrower than the halo: narrower ones repeat more than they save.
    pub fn size_for_budget(index: &Index, halo_m: f64, budget_bytes: u64, workers: usize) -> f64 {
        const LARGEST_CORE: f64 = 4e6;
        let CellGrid { cell_m, columns, rows, .. } = index.grid;
        let whole_m = f64::from(columns.max(rows)) * cell_m;
        let in_flight = (workers + 2) as f64;
        let loaded = budget_bytes as f64 / in_flight / super::mesh::BYTES_PER_TRIANGLE as f64;
        let triangles = index.scale.triangles as f64;
        if triangles <= loaded.min(LARGEST_CORE) {
            return whole_m;
        }
        let per_m2 = triangles / (f64::from(columns) * f64::from(rows) * cell_m * cell_m);
        let side = ((loaded / per_m2).sqrt() - 2.0 * halo_m).min((LARGEST_CORE / per_m2).sqrt());
        side.max(halo_m).clamp(cell_m, whole_m)
    }
}
