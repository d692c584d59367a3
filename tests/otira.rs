//! The real bed: what the authors' program finds on the Otira scan, and where the results lie on the map.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use gdal::vector::LayerAccess;
use std::path::Path;

/// Runs the preset of the authors' program, as a user would, and returns the number of grains.
fn grains(out: &Path, more: &[&str]) -> Option<u64> {
    let mesh = support::data("otira/otira_poisson.ply")?;
    assert_cmd::Command::cargo_bin("gravelometer")
        .unwrap()
        .arg("run")
        .arg(mesh)
        .args(["--config", "configs/rheinwalt2025.toml", "--min-grain-area", "5e-3", "--labelled-mesh"])
        .args(["--crs", "EPSG:2193", "--offset", "1480000,5250000,700", "-o"])
        .arg(out)
        .args(more)
        .assert()
        .success();
    let summary = std::fs::read(out.join("summary.json")).unwrap();
    serde_json::from_slice::<serde_json::Value>(&summary).unwrap()["grains"].as_u64()
}

#[test]
fn as_many_grains_are_found_as_by_the_authors_without_erosion_and_dilation() {
    let folder = tempfile::tempdir().unwrap();
    let none = ["--set", "segment.erosion_iterations=0", "--set", "segment.dilation_iterations=0"];
    if let Some(found) = grains(folder.path(), &none) {
        assert_eq!(found, 366);
    }
}

#[test]
fn as_many_grains_are_found_as_by_the_authors_and_they_lie_in_new_zealand() {
    let folder = tempfile::tempdir().unwrap();
    let Some(found) = grains(folder.path(), &[]) else { return };
    assert_eq!(found, 319);
    let package = gdal::Dataset::open(folder.path().join("grains.gpkg")).unwrap();
    let layer = package.layer_by_name("grains").unwrap();
    assert_eq!(layer.feature_count(), 319);
    assert_eq!(layer.spatial_ref().unwrap().auth_code().unwrap(), 2193);
    let extent = layer.get_extent().unwrap();
    assert!(extent.MinX > 1_480_018.0 && extent.MaxX < 1_480_029.0, "easting first: {extent:?}");
    assert!(extent.MinY > 5_250_012.0 && extent.MaxY < 5_250_021.0, "northing second: {extent:?}");
    let raster = gdal::Dataset::open(folder.path().join("grain_size.tif")).unwrap();
    assert_eq!(gdal::Metadata::metadata_item(&raster, "LAYOUT", "IMAGE_STRUCTURE").as_deref(), Some("COG"));
    assert_eq!(gdal::Metadata::description(&raster.rasterband(1).unwrap()).unwrap(), "d16_b_axis_m");
}
