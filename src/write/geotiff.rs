//! `grain_size.tif`: the grain-size raster as a Cloud-Optimised GeoTIFF.

use super::gdal_calls::set_unit;
use super::gdal_watch::Watch;
use super::{Results, WriteError, atomic::Pending, gpkg::spatial_ref};
use crate::statistics::{Band, GrainSizeRaster, NODATA, Summary};
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
    let memory = watch.step(name("preparing the raster"), in_memory(results, raster, summary))?;
    // Nearest: the mean of four medians is no median.
    let options = RasterCreationOptions::from_iter([
        "COMPRESS=DEFLATE",
        "PREDICTOR=YES",
        "OVERVIEW_RESAMPLING=NEAREST",
        "BIGTIFF=IF_SAFER",
    ]);
    let written = DriverManager::get_driver_by_name("COG")
        .and_then(|driver| memory.create_copy(&driver, &file.partial, &options))
        .and_then(Dataset::close);
    watch.step(name("writing the raster"), written)?;
    for (index, band) in raster.bands.iter().enumerate() {
        let same = watch.step(|| format!("reading back band {}", band.name), reads_back(file, index + 1, band))?;
        if !same {
            return Err(WriteError::IncompleteBand { path: file.target.clone(), band: band.name });
        }
    }
    Ok(())
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

fn reads_back(file: &Pending, index: usize, band: &Band) -> gdal::errors::Result<bool> {
    let options = DatasetOptions {
        open_flags: GdalOpenFlags::GDAL_OF_RASTER | GdalOpenFlags::GDAL_OF_VERBOSE_ERROR,
        allowed_drivers: Some(&["GTiff"]),
        ..Default::default()
    };
    let dataset = Dataset::open_ex(&file.partial, options)?;
    let read = dataset.rasterband(index)?.read_band_as::<f32>()?;
    let same = read.data() == band.values.as_slice();
    dataset.close()?;
    Ok(same)
}
