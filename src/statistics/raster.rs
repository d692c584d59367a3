//! The grain-size raster: percentiles of b, mean, count and cover, cell by cell.
//!
//! A grain counts in the cell that holds its centroid; its outline covers every cell that it meets. Cells
//! where nothing was surveyed carry no data; cells that were, and hold no grain, carry a count of 0.

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
        bands.push(Band {
            name: "grain_cover",
            unit: "1",
            description: "share of the cell covered by grain outlines in plan, 0 to 1",
            values: cover(catalogue, frame, &grid),
        });
        // No grains and no survey are different things.
        for band in &mut bands {
            band.values.iter_mut().zip(&surveyed).filter(|(_, there)| !**there).for_each(|(v, _)| *v = NODATA);
        }
        Ok(GrainSizeRaster { grid, min_grains: settings.min_grains, bands })
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

/// Share of each cell that outlines cover, at most 1: overhanging stones overlap in plan.
fn cover(catalogue: &Catalogue, frame: &Frame, grid: &RasterGrid) -> Vec<f32> {
    let mut area = vec![0.0f64; grid.cells()];
    let cells_per_step = frame.outline_step_m() / grid.cell_m;
    let shift = grid.corner_shift();
    let mut ring_in_cells = Vec::new();
    for ring in catalogue.grains.iter().flat_map(|g| g.grain.outline.iter().flatten()) {
        ring_in_cells.clear();
        ring_in_cells.extend(
            ring.iter().map(|p| -> [f64; 2] { std::array::from_fn(|i| p[i] as f64 * cells_per_step + shift[i]) }),
        );
        add_ring(&ring_in_cells, grid, &mut area);
    }
    area.iter().map(|a| a.clamp(0.0, 1.0) as f32).collect()
}

/// Adds a ring's signed area to every cell that it meets: holes run clockwise and take away.
fn add_ring(ring: &[[f64; 2]], grid: &RasterGrid, area: &mut [f64]) {
    let Some((columns, rows)) = span(ring, 0, grid.columns).zip(span(ring, 1, grid.rows)) else { return };
    if columns.len() == 1 && rows.len() == 1 {
        area[grid.index(columns.start, rows.start)] += signed_area(ring);
        return;
    }
    for column in columns {
        let strip = clip(&clip(ring, 0, column as f64, 1.0), 0, column as f64 + 1.0, -1.0);
        let Some(rows) = span(&strip, 1, grid.rows) else { continue };
        for row in rows {
            let part = clip(&clip(&strip, 1, row as f64, 1.0), 1, row as f64 + 1.0, -1.0);
            area[grid.index(column, row)] += signed_area(&part);
        }
    }
}

/// Columns (axis 0) or rows (axis 1) of the raster that a ring meets; none for an empty ring.
fn span(ring: &[[f64; 2]], axis: usize, count: usize) -> Option<std::ops::Range<usize>> {
    let low = ring.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
    let high = ring.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
    if low > high || high < 0.0 || low >= count as f64 {
        return None;
    }
    let first = low.floor().max(0.0) as usize;
    let end = (high.ceil() as usize).clamp(first + 1, count.max(first + 1));
    Some(first..end)
}

/// Sutherland-Hodgman against one line: keeps the side where `(p[axis] - at) * sign >= 0`. What is left of
/// a concave ring may run along the line and back, which adds no area.
fn clip(ring: &[[f64; 2]], axis: usize, at: f64, sign: f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::with_capacity(ring.len() + 4);
    let Some(&last) = ring.last() else { return kept };
    let mut from = last;
    for &to in ring {
        let (d_from, d_to) = ((from[axis] - at) * sign, (to[axis] - at) * sign);
        if (d_from < 0.0) != (d_to < 0.0) {
            let share = d_from / (d_from - d_to);
            let mut crossing: [f64; 2] = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share);
            crossing[axis] = at;
            kept.push(crossing);
        }
        if d_to >= 0.0 {
            kept.push(to);
        }
        from = to;
    }
    kept
}

/// Area of a ring, positive counter-clockwise, about its first point so that distant rings lose nothing.
fn signed_area(ring: &[[f64; 2]]) -> f64 {
    let Some(&[x0, y0]) = ring.first() else { return 0.0 };
    let twice: f64 = ring.windows(2).map(|w| (w[0][0] - x0) * (w[1][1] - y0) - (w[1][0] - x0) * (w[0][1] - y0)).sum();
    0.5 * twice
}
