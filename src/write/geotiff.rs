//! `grain_size.tif`: the grain-size raster as a Cloud-Optimised GeoTIFF.

use super::gdal_calls::set_unit;
use super::gdal_options::GdalOptions;
use super::gdal_watch::Watch;
use super::{Results, WriteError, atomic::Pending, gpkg::spatial_ref};
use crate::statistics::{GrainSizeRaster, NODATA, Summary};
use gdal::raster::{Buffer, RasterCreationOptions};
use gdal::{Dataset, DatasetOptions, DriverManager, GdalOpenFlags, Metadata};

/// Writes the raster, and reads it back to prove that it is complete.
pub(crate) fn write(
    file: &Pending,
    results: &Results,
    raster: &GrainSizeRaster,
    summary: &Summary,
) -> Result<(), WriteError> {
    let watch = Watch::new(&file.target);
    let name = |step: &'static str| move || step.to_owned();
    let _options = watch.step(name("setting up GDAL"), GdalOptions::set(&[GdalOptions::NO_VALIDATION]))?;
    let memory = watch.step(name("preparing the raster"), in_memory(results, raster, summary))?;
    // Nearest: the mean of four medians is no median.
    let block_size = format!("BLOCKSIZE={}", block_cells(raster.grid.columns, raster.grid.rows));
    let options = RasterCreationOptions::from_iter([
        "COMPRESS=DEFLATE",
        "PREDICTOR=YES",
        "OVERVIEW_RESAMPLING=NEAREST",
        "BIGTIFF=IF_SAFER",
        &block_size,
    ]);
    let written = DriverManager::get_driver_by_name("COG")
        .and_then(|driver| memory.create_copy(&driver, &file.partial, &options))
        .and_then(Dataset::close);
    watch.step(name("writing the raster"), written)?;
    match watch.step(name("reading back"), first_difference(file, raster))? {
        None => Ok(()),
        Some(band) => Err(WriteError::IncompleteBand { path: file.target.clone(), band }),
    }
}

/// Side of the blocks, in cells: the smallest that GDAL recommends and that holds the raster's shorter side,
/// at most its own choice of 512. Blocks are always whole, so most of a large one would be written for nothing.
fn block_cells(columns: usize, rows: usize) -> usize {
    [128, 256].into_iter().find(|&side| columns.min(rows) <= side).unwrap_or(512)
}

fn in_memory(results: &Results, raster: &GrainSizeRaster, summary: &Summary) -> gdal::errors::Result<Dataset> {
    let grid = &raster.grid;
    let driver = DriverManager::get_driver_by_name("MEM")?;
    let mut memory = driver.create_with_band_type::<f32, _>("", grid.columns, grid.rows, raster.bands.len())?;
    let ([west, north], cell) = (grid.west_north(), grid.cell_map());
    memory.set_geo_transform(&[west, cell, 0.0, north, 0.0, -cell])?;
    if let Some(srs) = spatial_ref(results.frame)? {
        memory.set_spatial_ref(&srs)?;
    }
    for (key, value) in [
        ("program", format!("{} {}", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"))),
        ("frequency_base", "area-by-number: each grain counts once, percentiles of type 7".to_owned()),
        ("cell_m", grid.cell_m.to_string()),
        ("min_grains", raster.min_grains.to_string()),
        ("smallest_measurable_grain_area_m2", summary.smallest_measurable_grain_area_m2.to_string()),
        ("smallest_measurable_grain_diameter_m", format!("{:.6}", summary.smallest_measurable_grain_diameter_m)),
    ] {
        memory.set_metadata_item(key, &value, "")?;
    }
    for (index, band) in raster.bands.iter().enumerate() {
        let mut out = memory.rasterband(index + 1)?;
        out.set_no_data_value(Some(f64::from(NODATA)))?;
        out.set_description(band.name)?;
        out.set_metadata_item("description", band.description, "")?;
        out.set_metadata_item("unit", band.unit, "")?;
        set_unit(&mut out, band.unit)?;
        let mut values = Buffer::new((grid.columns, grid.rows), band.values.clone());
        out.write((0, 0), (grid.columns, grid.rows), &mut values)?;
    }
    Ok(memory)
}

/// The first band that does not hold in the file what it should; none if all of them do.
///
/// The bands of a block are packed together, so a block is read for all of them before the next.
fn first_difference(file: &Pending, raster: &GrainSizeRaster) -> gdal::errors::Result<Option<&'static str>> {
    let options = DatasetOptions {
        open_flags: GdalOpenFlags::GDAL_OF_RASTER | GdalOpenFlags::GDAL_OF_VERBOSE_ERROR,
        allowed_drivers: Some(&["GTiff"]),
        ..Default::default()
    };
    let dataset = Dataset::open_ex(&file.partial, options)?;
    let (columns, rows) = (raster.grid.columns, raster.grid.rows);
    let block = block_cells(columns, rows);
    let mut read = vec![0.0; block * block];
    let mut differing = None;
    for (north, west) in (0..rows).step_by(block).flat_map(|n| (0..columns).step_by(block).map(move |w| (n, w))) {
        let size = (block.min(columns - west), block.min(rows - north));
        let part = &mut read[..size.0 * size.1];
        for (index, band) in raster.bands.iter().enumerate() {
            let corner = (west as isize, north as isize);
            dataset.rasterband(index + 1)?.read_into_slice::<f32>(corner, size, size, part, None)?;
            let row = |i: usize| &band.values[(north + i) * columns + west..][..size.0];
            if differing.is_none() && part.chunks_exact(size.0).enumerate().any(|(i, found)| found != row(i)) {
                differing = Some(band.name);
            }
        }
    }
    dataset.close()?;
    Ok(differing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_no_larger_than_the_shorter_side_needs() {
        for (columns, rows, side) in
            [(1, 45_001, 128), (128, 128, 128), (400, 129, 256), (257, 300, 512), (9000, 9000, 512)]
        {
            assert_eq!(block_cells(columns, rows), side, "{columns} by {rows}");
        }
    }
}
