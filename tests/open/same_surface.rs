//! One patch of a real bed, written by many programs in many encodings: skipped where the shared data are not there.

use crate::counted::SAME_SURFACE;
use crate::files_of_others::assert_is_as_counted;
use crate::{assert_contains, shared};
use gravelometer::open::{OpenError, Reach, Warning};
use gravelometer::pipeline::Control;
use gravelometer::progress::Silent;
use gravelometer::run::{Job, run};
use gravelometer::settings::{InputSettings, Settings};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Doubles, of which text holds all digits.
const DOUBLES: [&str; 5] = ["meshio_bin", "meshio_ascii", "open3d_bin", "pymeshlab_bin", "pymeshlab_full"];
/// The same doubles in UTM.
const UTM: [&str; 2] = ["plyfile_utm_double_le_int_ushort", "plyfile_utm_double_be_uchar_int"];
/// The same as floats.
const FLOATS: [&str; 2] = ["trimesh_bin", "vtk_bin"];
/// Where the UTM files put what the others have at 0.
const UTM_OFFSET: [f64; 3] = [500_000.0, 5_250_000.0, 0.0];
/// Distance between neighbouring floats from 16 to 32.
const FLOAT_STEP_M: f64 = 1.0 / 524_288.0;

fn path(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!("{name}.ply"))
}

fn open(directory: &Path, name: &str) -> Result<(Reach, Vec<Warning>), OpenError> {
    Reach::open(&[path(directory, name)], &InputSettings::default(), &|_, _| {})
}

/// A vertex in the coordinates of the file, but for the offset.
fn place(reach: &Reach, vertex: u64, offset: [f64; 3]) -> [f64; 3] {
    let (local, origin) = (reach.position(vertex), reach.frame().origin_input);
    std::array::from_fn(|axis| local[axis] + (origin[axis] - offset[axis]))
}

#[test]
fn every_file_has_the_same_vertices_and_triangles() {
    let Some(directory) = shared("formats/same_surface") else { return };
    let (first, _) = open(&directory, DOUBLES[0]).unwrap_or_else(|e| panic!("{e}"));
    // Rounding of the file's coordinates, then of local ones.
    let groups = [(&DOUBLES[..], [0.0; 3], 1e-14), (&UTM, UTM_OFFSET, 1e-9), (&FLOATS, [0.0; 3], FLOAT_STEP_M)];
    for (names, offset, step) in groups {
        for name in names {
            let (reach, warnings) = open(&directory, name).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(warnings, [], "{name}");
            assert_eq!((reach.vertices(), reach.triangles()), (3356, 5999), "{name}");
            assert_eq!(reach.has_colors(), !name.starts_with("meshio"), "{name}");
            for vertex in 0..3356 {
                let (a, b) = (place(&first, vertex, [0.0; 3]), place(&reach, vertex, offset));
                let apart = (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
                assert!(apart <= step * 0.5, "{name}: vertex {vertex} is {apart} m off");
            }
            assert!((0..5999).all(|t| reach.triangle(t) == first.triangle(t)), "{name}");
        }
    }
}

#[test]
fn every_file_is_read_as_another_reader_does() {
    let Some(directory) = shared("formats/same_surface") else { return };
    let mut files: Vec<_> = directory.read_dir().expect("a folder").map(|e| e.expect("an entry").file_name()).collect();
    files.sort();
    assert_eq!(files, SAME_SURFACE.map(|(name, ..)| name));
    for counted in &SAME_SURFACE {
        match open(&directory, counted.0.trim_end_matches(".ply")) {
            Ok((reach, _)) => assert_is_as_counted(&reach, counted),
            Err(error) => {
                assert_eq!(counted.0, "plyfile_utm_FLOAT32_degraded_le.ply");
                assert!(matches!(error, OpenError::FloatStep { .. }), "{error}");
                assert_contains(
                    &error.to_string(),
                    &[counted.0, "5250018", "5.000e-1 m", "double coordinates", "--offset"],
                );
            }
        }
    }
}

#[test]
fn quads_among_triangles_with_a_number_for_each_face_are_all_there() {
    let Some(directory) = shared("formats/same_surface") else { return };
    let (reach, _) = open(&directory, "plyfile_mixed_tri_quad_faceprop_be").unwrap_or_else(|e| panic!("{e}"));
    let corners: Vec<usize> = (0..reach.faces()).map(|f| reach.files()[0].face_corners(f).len()).collect();
    assert_eq!((corners.iter().filter(|&&n| n == 3).count(), corners.iter().filter(|&&n| n == 4).count()), (100, 50));
    // A sheet over 10 x 10 without holes: in plan its triangles have the area of the square.
    let plan: f64 = (0..reach.triangles())
        .map(|t| {
            let [a, b, c] = reach.triangle(t).map(|v| reach.position(v).truncate());
            0.5 * (b - a).perp_dot(c - a)
        })
        .sum();
    assert!((plan - 100.0).abs() < 1e-9, "{plan}");
}

/// The table of grains that a run writes: each row as its columns by name.
fn grains(directory: &Path, name: &str) -> Vec<BTreeMap<String, String>> {
    let mut settings = Settings::load(Some(Path::new("rheinwalt2025")), &[]).unwrap_or_else(|e| panic!("{e}"));
    settings.segment.min_grain_area_m2 = 5e-3;
    settings.work.threads = 1;
    let folder = tempfile::tempdir().expect("temporary directory");
    let out = folder.path().join("out");
    let job = Job {
        inputs: vec![path(directory, name)],
        out: out.clone(),
        settings,
        force: false,
        resume: false,
        work: None,
    };
    run(&job, &Silent, &Control::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut table = csv::Reader::from_path(out.join("grains.csv")).expect("a table");
    table.deserialize().map(|row| row.unwrap_or_else(|e| panic!("{name}: {e}"))).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|e| panic!("{column} = {}: {e}", row[column]))
}

#[test]
fn every_file_has_the_same_grains() {
    let Some(directory) = shared("formats/same_surface") else { return };
    // With colours, which the first of them lacks.
    let first = grains(&directory, DOUBLES[2]);
    assert_eq!(first.len(), 28);
    let is_color = |column: &str| ["red_", "green_", "blue_"].iter().any(|c| column.starts_with(c));
    for name in DOUBLES {
        let has_colors = !name.starts_with("meshio");
        for (row, of_first) in grains(&directory, name).iter().zip(&first) {
            for (column, text) in row {
                let expected = if is_color(column) && !has_colors { "" } else { &of_first[column] };
                assert_eq!(text, expected, "{name}: {column} of grain {}", row["grain_id"]);
            }
        }
    }
    // Programs that cut colours to bytes instead of rounding them, as these did, are one step of 255 lower.
    let cut = grains(&directory, UTM[0]);
    for (row, of_first) in cut.iter().zip(&first) {
        for column in ["red_mean", "green_mean", "blue_mean"] {
            let lower = number(of_first, column) - number(row, column);
            assert!((0.0..=1.0 / 255.0).contains(&lower), "{column} is {lower} lower");
        }
    }
    for name in UTM {
        let found = grains(&directory, name);
        assert_eq!(found.len(), first.len(), "{name}");
        for ((row, of_first), of_cut) in found.iter().zip(&first).zip(&cut) {
            for (column, text) in row.iter().filter(|(column, _)| !column.starts_with("centroid_")) {
                let expected = if is_color(column) { of_cut } else { of_first };
                assert_eq!(text, &expected[column], "{name}: {column} of grain {}", row["grain_id"]);
            }
            for (axis, offset) in ["centroid_x", "centroid_y", "centroid_z"].into_iter().zip(UTM_OFFSET) {
                let moved = number(row, axis) - number(of_first, axis);
                assert!((moved - offset).abs() < 1e-8, "{name}: {axis} is {moved} off");
            }
        }
    }
    for name in FLOATS {
        let found = grains(&directory, name);
        assert_eq!(found.len(), first.len(), "{name}");
        for ((row, of_first), of_cut) in found.iter().zip(&first).zip(&cut) {
            for (column, text) in row {
                if is_color(column) || ["grain_id", "triangles", "touches_edge"].contains(&column.as_str()) {
                    assert_eq!(text, &of_cut[column], "{name}: {column} of grain {}", row["grain_id"]);
                }
            }
            for column in ["a_axis_m", "b_axis_m", "c_axis_m", "centroid_x", "centroid_y", "centroid_z"] {
                let apart = (number(row, column) - number(of_first, column)).abs();
                assert!(apart <= 2.0 * FLOAT_STEP_M, "{name}: {column} is {apart} m off");
            }
            for column in ["surface_area_m2", "footprint_area_m2", "hull_area_m2"] {
                let ratio = number(row, column) / number(of_first, column);
                assert!((ratio - 1.0).abs() < 1e-4, "{name}: {column}: {ratio}");
            }
        }
    }
}
