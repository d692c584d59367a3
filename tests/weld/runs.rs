//! Runs on blocks, and on the mesh that they were cut from.

use crate::blocks::{grid, joined, moved, otira, overlapping, sound_bed, write_all};
use crate::support::bed::ply;
use gravelometer::error::Error;
use gravelometer::geometry::DVec3;
use gravelometer::inspect::inspect;
use gravelometer::pipeline::Control;
use gravelometer::progress::Silent;
use gravelometer::run::{Job, run};
use gravelometer::settings::{InputSettings, Settings};
use gravelometer::weld::WeldError;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

fn job(inputs: Vec<PathBuf>, out: PathBuf, settings: Settings) -> Job {
    Job { inputs, out, settings, force: false, resume: false, work: None }
}

fn catalogue(inputs: Vec<PathBuf>, out: PathBuf, settings: &Settings) -> Vec<u8> {
    let done = run(&job(inputs, out.clone(), settings.clone()), &Silent, &Control::default()).unwrap();
    assert!(done.lost.is_empty());
    std::fs::read(out.join("grains.csv")).unwrap()
}

fn report(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap()
}

fn bed_settings() -> Settings {
    let mut settings = Settings::default();
    settings.segment.max_grain_m = 1.0;
    settings.segment.min_grain_area_m2 = 0.004;
    settings.raster.cell_m = 0.5;
    settings
}

#[test]
fn blocks_of_a_bed_give_the_catalogue_of_the_whole_bed_in_whatever_order_they_come() {
    let folder = tempfile::tempdir().unwrap();
    let whole = sound_bed(4, 150, 110);
    let out = |name: &str| folder.path().join(name);
    let mut settings = bed_settings();
    let wanted = catalogue(write_all(&out(""), std::slice::from_ref(&whole)), out("whole"), &settings);
    assert!(wanted.iter().filter(|&&b| b == b'\n').count() > 20);
    let mut paths = write_all(&out(""), &grid(&whole, 3, 2, 0.03));
    for (i, tile_size_m) in [0.0, 0.7].into_iter().enumerate() {
        settings.work.tile_size_m = tile_size_m;
        assert!(catalogue(paths.clone(), out(&format!("blocks{i}")), &settings) == wanted, "blocks change grains");
        paths.reverse();
        paths.swap(0, 3);
    }
    let facts = &report(&out("blocks0"))["facts"];
    assert!(facts["weld"]["welded_vertices"].as_u64().unwrap() > 300, "{facts}");
    assert!(facts["weld"]["tolerance_m"].as_f64().unwrap() > 0.0);
    assert_eq!(facts["warnings"].as_array().unwrap().len(), 0, "{facts}");
    assert!(report(&out("whole"))["facts"]["weld"].is_null());
}

#[test]
fn the_labelled_mesh_of_blocks_has_the_grain_of_every_face_in_the_order_of_the_files() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let mut settings = bed_settings();
    settings.output.labelled_mesh = true;
    let blocks = grid(&sound_bed(6, 90, 70), 2, 2, 0.0);
    // The whole mesh with its triangles in the order of the blocks.
    let mut whole = joined(&blocks).0;
    let mut first = HashMap::new();
    for v in whole.triangles.iter_mut().flatten() {
        *v = *first.entry(whole.positions[*v as usize].to_array().map(f64::to_bits)).or_insert(*v);
    }
    let wanted = catalogue(write_all(&out(""), std::slice::from_ref(&whole)), out("whole"), &settings);
    assert!(catalogue(write_all(&out(""), &blocks), out("blocks"), &settings) == wanted);
    let labels = |name: &str, vertices: usize| -> Vec<i32> {
        let bytes = std::fs::read(out(name).join("labelled_mesh.ply")).unwrap();
        let header = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        // Three doubles, a colour and a number for each vertex; a list of three, a number and a colour for each face.
        let faces = &bytes[header + vertices * (24 + 3 + 4)..];
        faces.chunks_exact(13 + 4 + 3).map(|face| i32::from_le_bytes(face[13..17].try_into().unwrap())).collect()
    };
    let of_whole = labels("whole", whole.positions.len());
    assert_eq!(of_whole.len(), whole.triangles.len());
    assert!(of_whole.iter().filter(|&&label| label >= 0).count() > 1000);
    assert!(labels("blocks", whole.positions.len()) == of_whole);
}

#[test]
fn an_index_is_used_again_with_what_is_known_of_its_weld_and_never_with_another_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let paths = write_all(&out(""), &grid(&sound_bed(2, 60, 50), 3, 1, 0.0));
    let stages = |name: &str, weld_m: f64| -> Vec<String> {
        let mut settings = bed_settings();
        settings.input.weld_m = weld_m;
        let job = Job { work: Some(out("work")), ..job(paths.clone(), out(name), settings) };
        run(&job, &Silent, &Control::default()).unwrap().costs.stages.iter().map(|s| s.name.to_owned()).collect()
    };
    let made = |stages: &[String]| ["weld", "index"].map(|name| stages.iter().any(|s| s == name));
    assert_eq!(made(&stages("first", 0.0)), [true, true]);
    assert_eq!(made(&stages("second", 0.0)), [false, false]);
    let weld = |name: &str| report(&out(name))["facts"]["weld"].clone();
    assert!(weld("first")["welded_vertices"].as_u64().unwrap() > 30);
    assert_eq!(weld("first"), weld("second"));
    assert_eq!(made(&stages("third", 1e-4)), [true, true]);
    assert_eq!(weld("third")["tolerance_m"], 1e-4);
}

#[test]
fn a_run_on_overlapping_files_fails_before_anything_is_written_and_an_inspection_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let bed = sound_bed(5, 60, 50);
    let paths = write_all(folder.path(), &[bed.clone(), bed]);
    let out = folder.path().join("out");
    let refused = run(&job(paths.clone(), out.clone(), bed_settings()), &Silent, &Control::default()).unwrap_err();
    assert!(matches!(refused, Error::Weld(WeldError::Overlap { .. })), "{refused}");
    assert!(!out.join("grains.csv").exists());
    let inspection = inspect(&paths, &InputSettings::default()).unwrap();
    assert!(inspection.warnings.iter().any(|w| w.contains("a run would be refused")), "{inspection}");
    assert_eq!(inspection.weld, None);
}

#[test]
fn an_inspection_says_how_many_vertices_are_welded() {
    let folder = tempfile::tempdir().unwrap();
    let paths = write_all(folder.path(), &grid(&sound_bed(2, 60, 50), 2, 2, 0.0));
    let inspection = inspect(&paths, &InputSettings::default()).unwrap();
    assert!(inspection.weld.as_ref().is_some_and(|weld| weld.welded_vertices > 100), "{inspection}");
    assert!(inspection.to_string().contains("vertices welded between 4 files"), "{inspection}");
}

fn otira_settings(preset: &str) -> Settings {
    Settings::load(Some(Path::new(preset)), &["segment.min_grain_area_m2=5e-3".to_owned()]).unwrap()
}

#[test]
fn six_blocks_of_the_otira_give_the_catalogue_of_the_whole_byte_for_byte() {
    let Some((path, surface)) = otira() else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let mut paths = write_all(folder.path(), &grid(&surface, 2, 3, 0.0));
    for (i, preset) in ["rheinwalt2025", "default"].into_iter().enumerate() {
        let mut settings = otira_settings(preset);
        let whole = out(&format!("whole{i}"));
        let wanted = catalogue(vec![path.clone()], whole.clone(), &settings);
        settings.work.tile_size_m = [2.5, 0.0][i];
        let blocks = out(&format!("blocks{i}"));
        assert!(catalogue(paths.clone(), blocks.clone(), &settings) == wanted, "{preset}: blocks change grains");
        // Nothing is said of borders that is not said of the whole.
        assert_eq!(report(&blocks)["facts"]["warnings"], report(&whole)["facts"]["warnings"]);
        paths.rotate_left(2);
        paths.swap(1, 4);
    }
}

#[test]
fn blocks_that_are_rounded_differently_give_the_same_grains() {
    let Some((_, surface)) = otira() else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    // So that no coordinate is one of 32 bits already.
    let [left, right] = overlapping(&moved(&surface, DVec3::splat(0.123_456_789)), 0.0);
    let paths = write_all(folder.path(), &[left, right.clone()]);
    let doubles = catalogue(paths.clone(), out("doubles"), &otira_settings("rheinwalt2025"));
    // The right half in 32 bits.
    let text = String::from_utf8_lossy(&ply(&right)[..200]).replace("double", "float");
    let mut bytes = text.as_bytes()[..text.find("end_header\n").unwrap() + 11].to_vec();
    let coordinates = right.positions.iter().flat_map(|p| p.to_array());
    coordinates.for_each(|v| bytes.extend((v as f32).to_le_bytes()));
    for t in &right.triangles {
        bytes.push(3);
        t.iter().for_each(|&v| bytes.extend((v as u32).to_le_bytes()));
    }
    std::fs::write(&paths[1], bytes).unwrap();
    let floats = catalogue(paths, out("floats"), &otira_settings("rheinwalt2025"));
    assert!(doubles != floats, "nothing was rounded");
    one_to_one(&doubles, &floats);
}

/// Every grain of one catalogue is one of the other, at the same place and of the same size but for rounding.
fn one_to_one(a: &[u8], b: &[u8]) {
    let grains = |bytes: &[u8]| -> Vec<[f64; 3]> {
        let mut reader = csv::Reader::from_reader(bytes);
        let header = reader.headers().unwrap().clone();
        let columns = ["centroid_x", "centroid_y", "b_axis_m"].map(|n| header.iter().position(|h| h == n).unwrap());
        reader.records().map(|r| columns.map(|c| r.as_ref().unwrap()[c].parse().unwrap())).collect()
    };
    let (a, b) = (grains(a), grains(b));
    assert_eq!(a.len(), b.len());
    let mut taken = vec![false; b.len()];
    for grain in &a {
        let distance = |other: &[f64; 3]| (0..3).map(|i| (grain[i] - other[i]).abs()).fold(0.0, f64::max);
        let nearest = (0..b.len()).min_by(|&i, &j| distance(&b[i]).total_cmp(&distance(&b[j]))).unwrap();
        assert!(distance(&b[nearest]) < 1e-3, "{grain:?} became {:?}", b[nearest]);
        assert!(!std::mem::replace(&mut taken[nearest], true), "{grain:?}");
    }
}
