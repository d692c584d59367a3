//! Planning: how the survey is cut into tiles.

use crate::index::{CellBlock, Index};

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

    /// The side of a core of about so many triangles, metres, where the survey is.
    pub fn side_m(index: &Index, triangles: f64) -> f64 {
        let grid = &index.grid;
        let occupied = index.triangles.occupied_cells().max(1) as f64;
        let per_cell = index.scale.triangles as f64 / occupied;
        let whole_m = f64::from(grid.columns.max(grid.rows)) * grid.cell_m;
        if triangles >= index.scale.triangles as f64 {
            return whole_m;
        }
        ((triangles / per_cell).sqrt().floor() * grid.cell_m).clamp(grid.cell_m, whole_m)
    }
}
