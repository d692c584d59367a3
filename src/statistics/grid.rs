//! The raster's cells: where their borders lie on the map, and which cell holds a point.
//!
//! Borders are multiples of the cell size in map coordinates. All of it is counted in whole millionths of
//! a map unit (the grid of [`crate::open::Frame::position`]), and the origin is split into whole cells and
//! a remainder: an offset of whole cells moves the raster and cannot change a value.

use crate::geometry::{DVec3, PlanBox};
use crate::index::Scale;
use crate::open::Frame;

/// Parts of a map unit in which cells are counted.
const PARTS: f64 = 1e6;
/// A raster with more cells than this is refused: seven bands of it take 1.4 GB, and what they are made from about half as much again.
pub(crate) const MOST_CELLS: u64 = 50_000_000;

/// A raster that cannot be laid out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RasterError {
    /// Far more cells than anybody can use.
    #[error(
        "raster.cell_m = {cell_m}: the survey ({width_m:.3} m by {height_m:.3} m) would take {columns} by {rows} cells; at most {most} are possible\nhelp: choose a larger raster.cell_m, at least about {enough_m:.2e}"
    )]
    TooManyCells {
        /// Cell size asked for, metres.
        cell_m: f64,
        /// West-east extent of the survey.
        width_m: f64,
        /// South-north extent of the survey.
        height_m: f64,
        /// Columns it would take.
        columns: f64,
        /// Rows it would take.
        rows: f64,
        /// The limit.
        most: u64,
        /// A cell size that fits.
        enough_m: f64,
    },
    /// The cell size is below a millionth of a map unit, or beyond all maps.
    #[error(
        "raster.cell_m = {cell_m:e}: must lie between 1e-6 and 1e8 units of the map\nhelp: about ten times the D50 gives each cell enough grains; 0 chooses that"
    )]
    CellSize {
        /// Cell size asked for, metres.
        cell_m: f64,
    },
    /// The survey's box holds nothing.
    #[error("the survey's box {min:?} to {max:?} is no box\nhelp: the input holds no vertices to lay a raster over")]
    NoExtent {
        /// West, south, local metres.
        min: [f64; 2],
        /// East, north, local metres.
        max: [f64; 2],
    },
}

/// Rows and columns over the survey's box, rows from north to south.
#[derive(Debug, Clone, PartialEq)]
pub struct RasterGrid {
    /// Cells from west to east.
    pub columns: usize,
    /// Cells from north to south.
    pub rows: usize,
    /// Side of a cell, metres: what was asked for, rounded to 1e-6 units of the map.
    pub cell_m: f64,
    /// Side of a cell, parts of a map unit.
    cell: i64,
    metres_per_part: f64,
    /// Of the west and of the south border: cells from the cell that holds the local origin.
    first: [i64; 2],
    /// Local origin inside its cell, parts.
    remainder: [i64; 2],
    /// Whole cells from the map's zero to the cell that holds the local origin.
    whole: [i64; 2],
}

impl RasterGrid {
    /// Cells of `cell_m` metres over the survey's box. `cell_m` must be above zero; see
    /// [`automatic_cell_m`] for the choice that 0 in the settings stands for.
    ///
    /// # Errors
    /// No box, or a cell size that gives too many cells or is none.
    pub fn new(frame: &Frame, scale: &Scale, cell_m: f64) -> Result<RasterGrid, RasterError> {
        let (min, max) = ([scale.min.x, scale.min.y], [scale.max.x, scale.max.y]);
        if !(0..2).all(|i| min[i].is_finite() && max[i].is_finite() && min[i] <= max[i]) {
            return Err(RasterError::NoExtent { min, max });
        }
        let metres_per_part = frame.metres_per_map_unit / PARTS;
        let cell = (cell_m / metres_per_part).round();
        if !(1.0..1e14).contains(&cell) {
            return Err(RasterError::CellSize { cell_m });
        }
        let (columns, rows) = cells_of(min, max, cell_m);
        if columns * rows > MOST_CELLS as f64 {
            let enough_m = ((max[0] - min[0]) * (max[1] - min[1]) / MOST_CELLS as f64).sqrt() * 1.1;
            let enough_m = enough_m.max((max[0] - min[0]).max(max[1] - min[1]) / (MOST_CELLS as f64 / 4.0));
            let (width_m, height_m) = (max[0] - min[0], max[1] - min[1]);
            return Err(RasterError::TooManyCells {
                cell_m,
                width_m,
                height_m,
                columns,
                rows,
                most: MOST_CELLS,
                enough_m,
            });
        }
        let cell = cell as i64;
        let origin = frame.origin_map();
        let origin: [i64; 2] = std::array::from_fn(|i| (origin[i] * PARTS).round() as i64);
        let mut grid = RasterGrid {
            columns: 0,
            rows: 0,
            cell_m: cell as f64 * metres_per_part,
            cell,
            metres_per_part,
            first: [0; 2],
            remainder: std::array::from_fn(|i| origin[i].rem_euclid(cell)),
            whole: std::array::from_fn(|i| origin[i].div_euclid(cell)),
        };
        let count = |axis: usize, grid: &RasterGrid| {
            let low = (grid.parts(min[axis]) + grid.remainder[axis]).div_euclid(cell);
            let high = (grid.parts(max[axis]) + grid.remainder[axis] + cell - 1).div_euclid(cell);
            (low, (high - low).max(1) as usize)
        };
        let ((west, columns), (south, rows)) = (count(0, &grid), count(1, &grid));
        (grid.first, grid.columns, grid.rows) = ([west, south], columns, rows);
        Ok(grid)
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// Side of a cell, map units.
    pub fn cell_map(&self) -> f64 {
        self.cell as f64 / PARTS
    }

    /// West and north border, map units.
    pub fn west_north(&self) -> [f64; 2] {
        let west = (self.whole[0] + self.first[0]) * self.cell;
        let north = (self.whole[1] + self.first[1] + self.rows as i64) * self.cell;
        [west as f64 / PARTS, north as f64 / PARTS]
    }

    /// Index (row-major from the north-west) of the cell that holds a local point. Cells own their west and
    /// south borders; a point on the outermost border, or outside, counts in the nearest cell.
    pub fn cell_of(&self, local: DVec3) -> usize {
        let place = |axis: usize, count: usize| {
            let cell = (self.parts(local[axis]) + self.remainder[axis]).div_euclid(self.cell) - self.first[axis];
            cell.clamp(0, count as i64 - 1) as usize
        };
        let (column, row_from_south) = (place(0, self.columns), place(1, self.rows));
        self.index(column, row_from_south)
    }

    /// Whether each cell, row-major from the north-west, meets any of some boxes in plan (local metres).
    pub(crate) fn cells_that_meet(&self, boxes: &[PlanBox]) -> Vec<bool> {
        let mut meets = vec![false; self.cells()];
        for b in boxes {
            let at = |corner: [f64; 2]| self.cell_of(DVec3::new(corner[0], corner[1], 0.0));
            let (low, high) = (at(b.min), at(b.max));
            for row in high / self.columns..=low / self.columns {
                meets[row * self.columns + low % self.columns..=row * self.columns + high % self.columns].fill(true);
            }
        }
        meets
    }

    /// Index of a cell by its column and its row counted from the south.
    pub(crate) fn index(&self, column: usize, row_from_south: usize) -> usize {
        (self.rows - 1 - row_from_south) * self.columns + column
    }

    /// What to add to local coordinates in cells to count them from the raster's south-west corner.
    pub(crate) fn corner_shift(&self) -> [f64; 2] {
        std::array::from_fn(|i| self.remainder[i] as f64 / self.cell as f64 - self.first[i] as f64)
    }

    fn parts(&self, local_m: f64) -> i64 {
        (local_m / self.metres_per_part).round() as i64
    }
}

fn cells_of(min: [f64; 2], max: [f64; 2], cell_m: f64) -> (f64, f64) {
    (((max[0] - min[0]) / cell_m).ceil().max(1.0), ((max[1] - min[1]) / cell_m).ceil().max(1.0))
}

/// The cell size that `raster.cell_m = 0` stands for, metres: ten times the D50 (b axis, area-by-number),
/// or without grains a hundredth of the survey's longer side, rounded up to 1, 2 or 5 times a power of ten,
/// and from there to the next such size until the raster is no larger than can be written.
pub fn automatic_cell_m(d50_m: Option<f64>, scale: &Scale) -> f64 {
    let (min, max) = ([scale.min.x, scale.min.y], [scale.max.x, scale.max.y]);
    let side = (max[0] - min[0]).max(max[1] - min[1]);
    let wanted = d50_m.filter(|d| *d > 0.0).map_or(side / 100.0, |d| 10.0 * d);
    let wanted = if wanted.is_finite() && wanted > 1e-3 { wanted } else { 1e-3 };
    let mut power = wanted.log10().floor() as i32;
    loop {
        for step in [1.0, 2.0, 5.0] {
            let size = if power < 0 { step / 10f64.powi(-power) } else { step * 10f64.powi(power) };
            let (columns, rows) = cells_of(min, max, size);
            let fits = (columns + 1.0) * (rows + 1.0) <= MOST_CELLS as f64 || !columns.is_finite() || !rows.is_finite();
            if size >= wanted * (1.0 - 1e-12) && fits {
                return size;
            }
        }
        power += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(min: [f64; 2], max: [f64; 2]) -> Scale {
        Scale {
            vertices: 4,
            triangles: 2,
            min: DVec3::new(min[0], min[1], 0.0),
            max: DVec3::new(max[0], max[1], 1.0),
            surface_area_m2: 1.0,
            mean_triangle_area_m2: 0.5,
            mean_edge_m: 1.0,
            spacing_m: 0.5,
            zero_area_triangles: 0,
        }
    }

    #[test]
    fn the_automatic_cell_is_ten_d50_rounded_up_to_one_two_or_five() {
        let reach = scale([0.0, 0.0], [20.0, 10.0]);
        for (d50, cell) in [(0.02, 0.2), (0.0201, 0.5), (0.05, 0.5), (0.051, 1.0), (0.1, 1.0), (0.3, 5.0)] {
            assert_eq!(automatic_cell_m(Some(d50), &reach), cell, "{d50}");
        }
        assert_eq!(automatic_cell_m(None, &reach), 0.2);
        let long = scale([0.0, 0.0], [100_000.0, 50_000.0]);
        let cell = automatic_cell_m(Some(0.001), &long);
        assert_eq!(cell, 20.0);
        assert!(RasterGrid::new(&Frame::metres(), &long, cell).is_ok());
    }

    #[test]
    fn an_absurd_raster_is_refused_by_the_name_of_its_setting() {
        let long = scale([0.0, 0.0], [100_000.0, 50_000.0]);
        let error = RasterGrid::new(&Frame::metres(), &long, 0.01).expect_err("5e13 cells");
        assert!(error.to_string().starts_with("raster.cell_m = 0.01: "), "{error}");
        let error = RasterGrid::new(&Frame::metres(), &long, 1e-9).expect_err("no cell");
        assert!(matches!(error, RasterError::CellSize { .. }));
    }

    #[test]
    fn borders_are_multiples_of_the_cell_on_the_map() {
        let frame = Frame { offset_map: [1_480_000.25, 5_250_000.75, 0.0], ..Frame::metres() };
        let grid = RasterGrid::new(&frame, &scale([-0.1, 0.1], [1.0, 1.9]), 0.5).expect("fits");
        assert_eq!(grid.west_north(), [1_480_000.0, 5_250_003.0]);
        assert_eq!((grid.columns, grid.rows), (3, 5));
        assert_eq!(grid.cell_of(DVec3::new(0.24, 0.24, 0.0)), 4 * 3);
        assert_eq!(grid.cell_of(DVec3::new(0.25, 0.25, 0.0)), 3 * 3 + 1);
    }
}
