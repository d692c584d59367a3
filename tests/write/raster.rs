use crate::fixture::{STEPS, Survey, new_zealand, survey};
use gdal::{Dataset, Metadata};
use gravelometer::open::Frame;
use gravelometer::statistics::{GrainSizeRaster, NODATA};
use gravelometer::write::{OutputFolder, write_all};

fn raster(survey: &Survey) -> GrainSizeRaster {
    GrainSizeRaster::new(&survey.catalogue, &survey.frame, &survey.scale, &survey.settings.raster, &survey.surveyed)
        .expect("raster")
}

fn band<'a>(raster: &'a GrainSizeRaster, name: &str) -> &'a [f32] {
    &raster.bands.iter().find(|b| b.name == name).expect(name).values
}

/// Area of every outline, by the shoelace formula on integers.
fn outline_area(survey: &Survey) -> f64 {
    let rings = survey.catalogue.grains.iter().flat_map(|g| g.grain.outline.iter().flatten());
    let twice: i128 = rings
        .map(|ring| {
            (0..ring.len())
                .map(|i| {
                    let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
                    i128::from(a[0]) * i128::from(b[1]) - i128::from(b[0]) * i128::from(a[1])
                })
                .sum::<i128>()
        })
        .sum();
    twice as f64 / 2.0 / STEPS / STEPS
}

#[test]
fn a_cell_where_nothing_was_surveyed_has_no_data_and_one_without_grains_counts_none() {
    let mut survey = survey(5, Frame::metres());
    survey.settings.raster.cell_m = 0.5;
    survey.surveyed = vec![
        gravelometer::geometry::PlanBox { min: [0.0, 0.0], max: [0.9, 0.4] },
        gravelometer::geometry::PlanBox { min: [1.6, 0.6], max: [1.9, 0.9] },
    ];
    let raster = raster(&survey);
    assert_eq!((raster.grid.columns, raster.grid.rows), (4, 2));
    let count = band(&raster, "grain_count");
    assert_eq!(count[0..4], [NODATA, NODATA, NODATA, 0.0], "north row");
    assert_eq!(count[6..8], [NODATA, NODATA], "south row");
    assert_eq!(count[4] + count[5], 5.0);
}

#[test]
fn the_cover_of_all_cells_adds_up_to_the_outlines_whatever_the_cell_size() {
    for cell_m in [0.5, 0.3, 0.07, 0.02, 0.005] {
        let mut survey = survey(171, new_zealand());
        survey.settings.raster.cell_m = cell_m;
        let raster = raster(&survey);
        let covered: f64 = band(&raster, "grain_cover").iter().map(|&c| f64::from(c)).sum();
        let area = covered * raster.grid.cell_m * raster.grid.cell_m;
        let expected = outline_area(&survey);
        assert!((area - expected).abs() < 1e-6 * expected, "{cell_m}: {area} is not {expected}");
        assert_eq!(band(&raster, "grain_count").iter().sum::<f32>(), 171.0);
    }
}

#[test]
fn a_square_over_four_cells_covers_a_quarter_of_each_share() {
    let mut survey = survey(1, Frame::metres());
    survey.settings.raster.cell_m = 0.25;
    let steps = |m: f64| (m * STEPS) as i64;
    // 0.125 m to 0.375 m east, 0.1875 m to 0.3125 m north: half of its width and of its height per cell.
    let (w, e, s, n) = (steps(0.125), steps(0.375), steps(0.1875), steps(0.3125));
    survey.catalogue.grains[0].grain.outline = vec![vec![vec![[w, s], [e, s], [e, n], [w, n]]]];
    let raster = raster(&survey);
    let cover = band(&raster, "grain_cover");
    let at = |column: usize, row_from_south: usize| {
        cover[(raster.grid.rows - 1 - row_from_south) * raster.grid.columns + column]
    };
    for (column, row) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        assert_eq!(at(column, row), 0.125, "{column} {row}");
    }
    assert_eq!(cover.iter().filter(|&&c| c > 0.0).count(), 4);
}

#[test]
fn an_offset_of_whole_cells_changes_no_value() {
    for cell_m in [0.1, 0.3, 0.25] {
        let mut near = survey(171, Frame::metres());
        near.settings.raster.cell_m = cell_m;
        near.frame.offset_map = [0.123_457, 0.654_321, 0.0];
        let mut far = survey(171, Frame::metres());
        far.settings.raster.cell_m = cell_m;
        far.frame.offset_map = [0.123_457 + 4_933_333.0 * cell_m, 0.654_321 + 17_500_001.0 * cell_m, 9.0];
        let (near, far) = (raster(&near), raster(&far));
        assert_eq!(near.bands, far.bands, "{cell_m}");
        let ([w, n], [w_far, n_far]) = (near.grid.west_north(), far.grid.west_north());
        assert!((w_far - w - 4_933_333.0 * cell_m).abs() < 1e-6, "{w_far}");
        assert!((n_far - n - 17_500_001.0 * cell_m).abs() < 1e-6, "{n_far}");
    }
}

#[test]
fn cells_with_too_few_grains_have_a_count_but_no_percentile() {
    let mut survey = survey(20, Frame::metres());
    survey.settings.raster.cell_m = 0.5;
    let raster = raster(&survey);
    assert_eq!((raster.grid.columns, raster.grid.rows), (4, 2));
    // South row: 5, 5, 5, 4 grains and one of the second lattice row in the first cell; north row: none.
    assert_eq!(band(&raster, "grain_count"), [0.0, 0.0, 0.0, 0.0, 6.0, 5.0, 5.0, 4.0]);
    let d50 = band(&raster, "d50_b_axis_m");
    assert_eq!((d50[0], d50[7]), (NODATA, NODATA));
    assert_eq!(d50[5], (0.02 + 0.000_4 * 7.0) as f32);
    assert_eq!(band(&raster, "mean_b_axis_m")[5], (0.02 + 0.000_4 * 7.0) as f32);
    assert_eq!(band(&raster, "grain_cover")[0], 0.0);
}

#[test]
fn the_geotiff_is_cloud_optimised_and_reads_back_as_the_raster() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let out = OutputFolder::create(folder.path(), false, &[]).expect("empty folder");
    let mut survey = survey(171, new_zealand());
    survey.settings.raster.cell_m = 0.25;
    write_all(&out, &survey.results(None), &|_| ()).expect("all files");
    let raster = raster(&survey);
    let tif = Dataset::open(folder.path().join("grain_size.tif")).expect("GeoTIFF");
    assert_eq!(tif.metadata_item("LAYOUT", "IMAGE_STRUCTURE").as_deref(), Some("COG"));
    assert_eq!(tif.spatial_ref().expect("system").auth_code().expect("code"), 2193);
    assert_eq!(tif.geo_transform().expect("transform"), [1_480_000.0, 0.25, 0.0, 5_250_001.0, 0.0, -0.25]);
    assert_eq!(tif.metadata_item("cell_m", "").as_deref(), Some("0.25"));
    assert!(tif.metadata_item("frequency_base", "").is_some_and(|b| b.starts_with("area-by-number")));
    let names =
        ["d16_b_axis_m", "d50_b_axis_m", "d84_b_axis_m", "d90_b_axis_m", "mean_b_axis_m", "grain_count", "grain_cover"];
    for (index, name) in names.into_iter().enumerate() {
        let read = tif.rasterband(index + 1).expect("band");
        assert_eq!(read.description().expect("name"), name);
        assert_eq!(read.no_data_value(), Some(-9999.0));
        assert_eq!(read.unit(), if index < 5 { "m" } else { "1" });
        assert_eq!(read.read_band_as::<f32>().expect("values").data(), band(&raster, name));
    }
}

#[test]
fn a_raster_of_one_cell_and_one_with_overviews_are_both_cloud_optimised() {
    for (cell_m, size, overviews) in [(5.0, (1, 1), 0), (0.001, (2000, 1000), 2)] {
        let folder = tempfile::tempdir().expect("temporary folder");
        let out = OutputFolder::create(folder.path(), false, &[]).expect("empty folder");
        let mut survey = survey(30, new_zealand());
        survey.settings.raster.cell_m = cell_m;
        write_all(&out, &survey.results(None), &|_| ()).expect("all files");
        let tif = Dataset::open(folder.path().join("grain_size.tif")).expect("GeoTIFF");
        assert_eq!(tif.raster_size(), size);
        assert_eq!(tif.metadata_item("LAYOUT", "IMAGE_STRUCTURE").as_deref(), Some("COG"));
        assert_eq!(tif.rasterband(1).expect("band").overview_count().expect("count"), overviews);
        assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 5, "nothing is left beside the results");
    }
}

#[test]
fn a_cell_in_metres_is_laid_over_a_map_in_feet() {
    let mut survey = survey(171, Frame { metres_per_map_unit: 0.3048, ..Frame::metres() });
    survey.settings.raster.cell_m = 0.5;
    let raster = raster(&survey);
    assert!((raster.grid.cell_map() - 0.5 / 0.3048).abs() < 1e-6);
    assert!((raster.grid.cell_m - 0.5).abs() < 1e-6);
    assert_eq!(band(&raster, "grain_count").iter().sum::<f32>(), 171.0);
    // The outlines are counted in steps of the map: as many feet as metres before.
    let cell = raster.grid.cell_map();
    let area = band(&raster, "grain_cover").iter().map(|&c| f64::from(c)).sum::<f64>() * cell * cell;
    assert!((area - outline_area(&survey)).abs() < 1e-5 * area, "{area}");
}
