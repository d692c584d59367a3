use crate::fixture::{Survey, new_zealand, survey};
use gdal::Dataset;
use gdal::vector::{FieldValue, LayerAccess};
use gravelometer::open::Frame;
use gravelometer::write::columns::{COLUMNS, Kind};
use gravelometer::write::{OutputFolder, write_all};
use std::path::{Path, PathBuf};

fn write(survey: &Survey) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("temporary folder");
    let out = OutputFolder::create(&folder.path().join("out"), false, &[]).expect("new folder");
    write_all(&out, &survey.results(None), &|_| ()).expect("all files");
    let path = out.path().to_owned();
    (folder, path)
}

fn count(dataset: &Dataset, query: &str) -> i64 {
    let mut rows = dataset.execute_sql(query, None, gdal::vector::sql::Dialect::DEFAULT).expect(query).expect(query);
    let row = rows.features().next().expect("one row");
    row.field_as_integer64(0).expect("integer").expect("not null")
}

fn csv_rows(folder: &Path) -> Vec<csv::StringRecord> {
    let mut reader = csv::Reader::from_path(folder.join("grains.csv")).expect("table");
    let header: Vec<String> = reader.headers().expect("header").iter().map(str::to_owned).collect();
    assert_eq!(header, COLUMNS.iter().map(|c| c.name).collect::<Vec<_>>());
    reader.records().map(|r| r.expect("row")).collect()
}

#[test]
fn every_layer_holds_its_features_and_an_index_of_all_of_them() {
    let (_keep, folder) = write(&survey(150, new_zealand()));
    let dataset = Dataset::open(folder.join("grains.gpkg")).expect("GeoPackage");
    for (layer, features) in [("grains", 150), ("grain_centres", 150), ("oversize", 1), ("tiles", 2), ("survey", 1)] {
        assert_eq!(count(&dataset, &format!("SELECT COUNT(*) FROM {layer}")), features, "{layer}");
        assert_eq!(count(&dataset, &format!("SELECT COUNT(*) FROM rtree_{layer}_geom")), features, "{layer}");
    }
    assert_eq!(count(&dataset, "SELECT COUNT(*) FROM layer_styles"), 2);
    assert_eq!(count(&dataset, "SELECT COUNT(*) FROM layer_styles WHERE useAsDefault"), 1);
    assert_eq!(count(&dataset, "SELECT COUNT(*) FROM grains WHERE fid <> grain_id"), 0);
    assert_eq!(count(&dataset, "SELECT COUNT(*) FROM grain_centres WHERE fid <> grain_id"), 0);
    let mut grains = dataset.layer_by_name("grains").expect("layer");
    grains.set_spatial_filter_rect(1_480_000.0, 5_250_000.0, 1_480_002.0, 5_250_001.0);
    assert_eq!(grains.features().count(), 150);
    grains.set_spatial_filter_rect(5_250_000.0, 1_480_000.0, 5_250_001.0, 1_480_002.0);
    assert_eq!(grains.features().count(), 0);
}

#[test]
fn a_survey_in_new_zealand_lies_there_with_easting_first() {
    let (_keep, folder) = write(&survey(150, new_zealand()));
    let dataset = Dataset::open(folder.join("grains.gpkg")).expect("GeoPackage");
    for name in ["grains", "grain_centres", "oversize", "tiles", "survey"] {
        let layer = dataset.layer_by_name(name).expect(name);
        assert_eq!(layer.spatial_ref().expect("system").auth_code().expect("code"), 2193, "{name}");
        let extent = layer.get_extent().expect("extent");
        assert!(extent.MinX >= 1_480_000.0 && extent.MaxX <= 1_480_002.0, "{name} {extent:?}");
        assert!(extent.MinY >= 5_250_000.0 && extent.MaxY <= 5_250_001.0, "{name} {extent:?}");
    }
    let mut centres = dataset.layer_by_name("grain_centres").expect("layer");
    let first = centres.features().next().expect("a grain");
    assert_eq!(first.geometry().expect("a point").get_point(0), (1_480_000.05, 5_250_000.05, 700.0));
}

#[test]
fn tile_cores_without_borders_are_cut_to_the_survey() {
    let (_keep, folder) = write(&survey(10, Frame::metres()));
    let dataset = Dataset::open(folder.join("grains.gpkg")).expect("GeoPackage");
    let extent = dataset.layer_by_name("tiles").expect("layer").get_extent().expect("extent");
    assert_eq!((extent.MinX, extent.MaxX, extent.MinY, extent.MaxY), (0.0, 2.0, 0.0, 1.0));
}

#[test]
fn the_table_and_the_geopackage_hold_the_same_values() {
    let (_keep, folder) = write(&survey(60, new_zealand()));
    let rows = csv_rows(&folder);
    assert_eq!(rows.len(), 60);
    let dataset = Dataset::open(folder.join("grains.gpkg")).expect("GeoPackage");
    let mut layer = dataset.layer_by_name("grains").expect("layer");
    let mut nulls = 0;
    for (feature, row) in layer.features().zip(&rows) {
        for (index, column) in COLUMNS.iter().enumerate() {
            let field = feature.field_index(column.name).expect(column.name);
            let (value, text) = (feature.field(field).expect(column.name), &row[index]);
            nulls += usize::from(value.is_none());
            match (column.kind, value) {
                (_, None) => assert_eq!(text, "", "{}", column.name),
                (Kind::Integer, Some(FieldValue::Integer64Value(v))) => assert_eq!(text, v.to_string()),
                (Kind::Real, Some(FieldValue::RealValue(v))) => {
                    assert_eq!(text.parse::<f64>().expect("number"), v, "{}", column.name);
                }
                (Kind::Text, Some(FieldValue::StringValue(v))) => assert_eq!(text, v),
                (Kind::Boolean, Some(FieldValue::IntegerValue(v))) => assert_eq!(text, (v == 1).to_string()),
                (kind, value) => panic!("{}: {kind:?} is stored as {value:?}", column.name),
            }
        }
    }
    // 15 grains without colours, 20 without an ellipsoid, and the level first one without a dip direction.
    assert!(nulls >= 15 * 6 + 20 * 3, "{nulls}");
}

#[test]
fn positions_are_printed_with_six_decimals_and_an_offset_changes_nothing_else() {
    let (_a, near) = write(&survey(60, Frame::metres()));
    let (_b, far) = write(&survey(60, new_zealand()));
    let (near, far) = (csv_rows(&near), csv_rows(&far));
    assert_eq!((&near[3][2], &far[3][2], &far[3][3]), ("0.350000", "1480000.350000", "5250000.050000"));
    for (a, b) in near.iter().zip(&far) {
        assert_eq!(a.iter().skip(5).collect::<Vec<_>>(), b.iter().skip(5).collect::<Vec<_>>());
    }
}

#[test]
fn equal_runs_write_equal_files() {
    let (_a, first) = write(&survey(40, new_zealand()));
    let (_b, second) = write(&survey(40, new_zealand()));
    for name in ["grains.gpkg", "grains.csv", "grain_size.tif", "summary.json", "run.json"] {
        let read = |folder: &Path| std::fs::read(folder.join(name)).expect(name);
        assert!(read(&first) == read(&second), "{name}");
    }
}

#[test]
fn a_survey_without_a_crs_still_opens() {
    let (_keep, folder) = write(&survey(20, Frame::metres()));
    let dataset = Dataset::open(folder.join("grains.gpkg")).expect("GeoPackage");
    assert_eq!(dataset.layer_by_name("grains").expect("layer").feature_count(), 20);
    let srs = dataset.layer_by_name("grains").expect("layer").spatial_ref().expect("a plane");
    assert!(srs.is_local() && !srs.is_geographic(), "metres must not be taken for degrees");
    assert_eq!(srs.linear_units(), 1.0);
    assert_eq!(count(&dataset, "SELECT COUNT(*) FROM gpkg_geometry_columns WHERE srs_id = -1"), 5);
    let tif = Dataset::open(folder.join("grain_size.tif")).expect("GeoTIFF");
    assert_eq!(tif.projection(), "");
}

#[test]
fn a_survey_without_grains_gives_all_files() {
    let (_keep, folder) = write(&survey(0, new_zealand()));
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .expect("folder")
        .map(|e| e.expect("entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert_eq!(names, ["grain_size.tif", "grains.csv", "grains.gpkg", "run.json", "summary.json"]);
    let dataset = Dataset::open(folder.join("grains.gpkg")).expect("GeoPackage");
    assert_eq!(count(&dataset, "SELECT COUNT(*) FROM rtree_grains_geom"), 0);
    assert!(csv_rows(&folder).is_empty());
    let text = std::fs::read_to_string(folder.join("summary.json")).expect("summary");
    let summary: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(summary["grains"], 0);
    assert!(summary["b_axis_area_by_number"]["d50_m"].is_null());
    assert!(summary["median_hull_sphericity"].is_null());
}

#[test]
fn a_grain_without_an_outline_keeps_its_row() {
    let mut survey = survey(5, new_zealand());
    survey.catalogue.grains[2].grain.outline.clear();
    let (_keep, folder) = write(&survey);
    let dataset = Dataset::open(folder.join("grains.gpkg")).expect("GeoPackage");
    assert_eq!(count(&dataset, "SELECT COUNT(*) FROM grains"), 5);
    assert_eq!(count(&dataset, "SELECT COUNT(*) FROM rtree_grains_geom"), 4);
}

#[test]
fn the_summary_names_base_unit_and_truncation_of_its_percentiles() {
    let (_keep, folder) = write(&survey(50, new_zealand()));
    let text = std::fs::read_to_string(folder.join("summary.json")).expect("summary");
    let summary: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let area = summary["b_axis_area_by_number"]["d50_m"].as_f64().expect("number");
    let grid = summary["b_axis_grid_by_number"]["d50_m"].as_f64().expect("number");
    assert!((area - 0.0298).abs() < 1e-9, "{area}");
    assert!(grid > area, "{grid}");
    let diameter = summary["smallest_measurable_grain_diameter_m"].as_f64().expect("number");
    assert!((diameter - 0.011_283_791_670_955).abs() < 1e-12, "{diameter}");
    let run: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("run.json")).expect("run")).expect("JSON");
    assert_eq!(run["facts"]["inputs"][0], "reach.ply");
    assert_eq!(run["settings"]["raster"]["min_grains"], 5);
    assert_eq!(run["grain_columns"].as_array().map(Vec::len), Some(COLUMNS.len()));
}
