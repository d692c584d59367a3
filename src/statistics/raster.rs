//! The grain-size raster: percentiles of b, mean, count and cover, cell by cell.
//!
//! A grain counts in the cell that holds its centroid; its outline covers every cell that it meets. Cells
//! where nothing was surveyed carry no data; cells that were, and hold no grain, carry a count of 0.

use super::cover::cover;
use super::grid::{RasterError, RasterGrid, automatic_cell_m};
use super::percentiles::Sizes;
use crate::geometry::PlanBox;
use crate::index::Scale;
use crate::open::Frame;
use crate::settings::RasterSettings;
use crate::stitch::Catalogue;

/// Value of a cell with too few grains for a percentile.
pub const NODATA: f32 = -9999.0;

/// One band, row-major from the north-west.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Name of the band, `d50_b_axis_m`.
    pub name: &'static str,
    /// Unit: `m`, or `1` for counts and shares.
    pub unit: &'static str,
    /// What the value is.
    pub description: &'static str,
    /// One value per cell; [`NODATA`] where there is none.
    pub values: Vec<f32>,
}

/// The grain-size raster of a survey.
#[derive(Debug, Clone, PartialEq)]
pub struct GrainSizeRaster {
    /// Where the cells lie.
    pub grid: RasterGrid,
    /// Cells with fewer grains carry no percentiles.
    pub min_grains: u32,
    /// D16, D50, D84, D90, mean, count, grain cover, in this order.
    pub bands: Vec<Band>,
    /// Area in plan under at least one outline, m².
    pub covered_area_m2: f64,
}

const PERCENTILES: [(&str, &str, f64); 4] = [
    ("d16_b_axis_m", "16th percentile of the b axis, area-by-number", 16.0),
    ("d50_b_axis_m", "median of the b axis, area-by-number", 50.0),
    ("d84_b_axis_m", "84th percentile of the b axis, area-by-number", 84.0),
    ("d90_b_axis_m", "90th percentile of the b axis, area-by-number", 90.0),
];

impl GrainSizeRaster {
    /// The raster of a catalogue over the survey's box.
    ///
    /// # Errors
    /// A cell size that cannot be used: [`RasterError`].
    pub fn new(
        catalogue: &Catalogue,
        frame: &Frame,
        scale: &Scale,
        settings: &RasterSettings,
        surveyed: &[PlanBox],
    ) -> Result<GrainSizeRaster, RasterError> {
        let cell_m = if settings.cell_m > 0.0 {
            settings.cell_m
        } else {
            let sizes = Sizes::new(catalogue.grains.iter().map(|g| g.grain.axes_m[1]));
            automatic_cell_m(sizes.area_by_number(50.0), scale)
        };
        let grid = RasterGrid::new(frame, scale, cell_m)?;
        let surveyed = grid.cells_that_meet(surveyed);
        let mut bands = size_bands(catalogue, &grid, settings.min_grains);
        let (cover, covered_cells) = cover(catalogue, frame, &grid);
        let covered_area_m2 = covered_cells * grid.cell_m * grid.cell_m;
        bands.push(Band {
            name: "grain_cover",
            unit: "1",
            description: "share of the cell covered by grain outlines in plan, 0 to 1; where they overlap it counts once",
            values: cover,
        });
        // No grains and no survey are different things.
        for band in &mut bands {
            band.values.iter_mut().zip(&surveyed).filter(|(_, there)| !**there).for_each(|(v, _)| *v = NODATA);
        }
        Ok(GrainSizeRaster { grid, min_grains: settings.min_grains, bands, covered_area_m2 })
    }
}

/// D16, D50, D84, D90, mean and count.
fn size_bands(catalogue: &Catalogue, grid: &RasterGrid, min_grains: u32) -> Vec<Band> {
    let mut grains: Vec<(usize, f64)> =
        catalogue.grains.iter().map(|g| (grid.cell_of(g.grain.centroid), g.grain.axes_m[1])).collect();
    grains.sort_by_key(|&(cell, _)| cell);
    let empty = vec![NODATA; grid.cells()];
    let mut bands: Vec<Band> = PERCENTILES
        .iter()
        .map(|&(name, description, _)| Band { name, unit: "m", description, values: empty.clone() })
        .collect();
    bands.push(Band {
        name: "mean_b_axis_m",
        unit: "m",
        description: "arithmetic mean of the b axis, area-by-number",
        values: empty,
    });
    let mut count = vec![0.0f32; grid.cells()];
    for of_cell in grains.chunk_by(|a, b| a.0 == b.0) {
        let cell = of_cell[0].0;
        count[cell] = of_cell.len() as f32;
        if of_cell.len() < min_grains as usize {
            continue;
        }
        let sizes = Sizes::new(of_cell.iter().map(|&(_, b)| b));
        let percentiles = PERCENTILES.iter().map(|&(_, _, percent)| sizes.area_by_number(percent));
        for (band, value) in bands.iter_mut().zip(percentiles.chain([sizes.area_by_number_mean()])) {
            band.values[cell] = value.map_or(NODATA, |v| v as f32);
        }
    }
    bands.push(Band {
        name: "grain_count",
        unit: "1",
        description: "grains whose centroid lies in the cell",
        values: count,
    });
    bands
}
