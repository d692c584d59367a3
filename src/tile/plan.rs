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

/// The size of a core, in cells of the index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CoreSize {
    /// From west to east.
    pub columns: u32,
    /// From south to north.
    pub rows: u32,
}

/// All tiles that hold anything, in row-major order.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The tiles.
    pub tiles: Vec<Tile>,
    /// Size of a core; those at the north and east border may be smaller.
    pub core: CoreSize,
}

impl Plan {
    /// Cuts the survey into cores. Blocks without vertices and triangles are left out.
    pub fn new(index: &Index, core: CoreSize) -> Plan {
        let (grid, mut tiles) = (&index.grid, Vec::new());
        for (j, row) in (0..grid.rows).step_by(core.rows as usize).enumerate() {
            for (i, column) in (0..grid.columns).step_by(core.columns as usize).enumerate() {
                let block = CellBlock {
                    columns: column..column.saturating_add(core.columns).min(grid.columns),
                    rows: row..row.saturating_add(core.rows).min(grid.rows),
                };
                if index.vertices.count(grid, &block) + index.triangles.count(grid, &block) > 0 {
                    let id = j as u64 * u64::from(grid.columns.div_ceil(core.columns)) + i as u64;
                    tiles.push(Tile { id, core: block });
                }
            }
        }
        Plan { tiles, core }
    }

    /// Size of a core, metres from west to east and from south to north.
    pub fn core_m(&self, index: &Index) -> [f64; 2] {
        [self.core.columns, self.core.rows].map(|cells| f64::from(cells) * index.grid.cell_m)
    }
}

impl CoreSize {
    /// A square of about this side, metres; at least one cell.
    pub fn square(index: &Index, side_m: f64) -> CoreSize {
        let grid = &index.grid;
        let side = ((side_m / grid.cell_m).round() as u32).clamp(1, grid.columns.max(grid.rows));
        CoreSize { columns: side, rows: side }
    }

    /// Cores of at most so many triangles, where these lie as close as they do on average, with the shortest
    /// borders between them: what lies at a border is worked twice. If there are few, every one of `workers` gets
    /// as many.
    pub fn holding(index: &Index, triangles: f64, workers: usize) -> CoreSize {
        if triangles >= index.scale.triangles as f64 {
            // However little of its box a survey fills.
            return CoreSize { columns: index.grid.columns.max(1), rows: index.grid.rows.max(1) };
        }
        let (columns, rows) = (u64::from(index.grid.columns), u64::from(index.grid.rows));
        let per_cell = index.scale.triangles as f64 / index.triangles.occupied_cells().max(1) as f64;
        let least = (columns as f64 * rows as f64 * per_cell / triangles).ceil().max(1.0) as u64;
        let workers = workers as u64;
        let fair = |n: u64| n == 1 || n > 4 * workers || n.is_multiple_of(workers);
        let cuts = (1..=least.min(columns)).flat_map(|across| {
            let up = least.div_ceil(across);
            (up..up + workers).map(move |up| (across, up)).filter(|&(across, up)| fair(across * up) && up <= rows)
        });
        let border = |&(across, up): &(u64, u64)| (across - 1) * rows + (up - 1) * columns;
        let (across, up) = cuts.min_by_key(|cut| (border(cut), cut.0)).unwrap_or((columns, rows));
        CoreSize { columns: columns.div_ceil(across) as u32, rows: rows.div_ceil(up) as u32 }
    }

    /// Length of the borders between cores for each cell of the grid, cells.
    pub fn border(&self, grid: &CellGrid) -> f64 {
        let cuts = |all: u32, core: u32| f64::from(all.div_ceil(core) - 1);
        let (columns, rows) = (f64::from(grid.columns), f64::from(grid.rows));
        (cuts(grid.columns, self.columns) * rows + cuts(grid.rows, self.rows) * columns) / (columns * rows)
    }
}
