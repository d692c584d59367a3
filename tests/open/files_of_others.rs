//! Files that other software wrote; skipped where the shared data are not there.

use crate::counted::{Counted, SAMPLES};
use crate::{assert_contains, shared};
use gravelometer::inspect::{Inspection, Preset, inspect};
use gravelometer::open::{OpenError, Reach, Warning};
use gravelometer::settings::InputSettings;
use std::path::{Path, PathBuf};

fn open(path: &Path) -> Result<Reach, OpenError> {
    Reach::open(&[path.to_owned()], &InputSettings::default(), &|_, _| {}).map(|(reach, _)| reach)
}

fn look(path: &Path) -> Inspection {
    inspect(&[path.to_owned()], &InputSettings::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Holds an open file against what an independent reader found in it.
#[track_caller]
pub(crate) fn assert_is_as_counted(reach: &Reach, (name, counts, bounds): &Counted) {
    assert_eq!([reach.vertices(), reach.faces(), reach.triangles()], *counts, "{name}");
    let file = &reach.files()[0];
    let found = [file.input_bounds().0, file.input_bounds().1];
    for (found, printed) in found.as_flattened().iter().zip(bounds.as_flattened()) {
        // Digits of a text may be read as numbers of the type that its header names; others have no choice.
        let rounded = f64::from(*printed as f32);
        let is_text = file.format() == "PLY ascii";
        assert!(found == printed || is_text && *found == rounded, "{name}: {found} for {printed}");
    }
}

#[test]
fn every_sample_is_read_as_another_reader_does_or_refused_by_name_and_place() {
    let Some(directory) = shared("formats/ply") else { return };
    let mut paths: Vec<PathBuf> =
        directory.read_dir().expect("directory").map(|entry| entry.expect("entry").path()).collect();
    paths.sort();
    assert!(paths.len() > 40);
    let mut read = Vec::new();
    for path in &paths {
        let name = path.file_name().expect("name").to_string_lossy().into_owned();
        let counted = SAMPLES.iter().find(|(counted, ..)| *counted == name);
        match open(path) {
            Ok(reach) => {
                let counted = counted.unwrap_or_else(|| panic!("{name} is read, but no other reader can"));
                assert_is_as_counted(&reach, counted);
                read.push(name);
            }
            Err(error) => {
                let message = error.to_string();
                println!("{}", message.replace(&format!("{}/", directory.display()), ""));
                assert_contains(&message, &[&name, "\nhelp: "]);
                let place = ["byte", "header", "vertex 0", "vertices", "line"].iter().any(|p| message.contains(p));
                assert!(place, "names no place: {message}");
                assert!(counted.is_none(), "another reader finds what is in it: {message}");
            }
        }
    }
    assert_eq!(read, SAMPLES.map(|(name, ..)| name));
}

#[test]
fn a_comment_without_its_word_is_skipped_with_a_warning() {
    let Some(path) = shared("formats/ply/assimp_Wuson.ply") else { return };
    let opened = Reach::open(&[path], &InputSettings::default(), &|_, _| {});
    let (_, warnings) = opened.unwrap_or_else(|e| panic!("{e}"));
    // It is a figure, closed all round.
    let [warning, Warning::FacesDown { .. }] = warnings.as_slice() else { panic!("{warnings:?}") };
    assert_contains(
        &warning.to_string(),
        &["assimp_Wuson.ply", "header line 3", "`Created by Blender3D 247", "\nhelp: "],
    );
}

#[test]
fn a_surface_destroyed_by_floats_is_refused() {
    let Some(path) = shared("formats/same_surface/plyfile_utm_FLOAT32_degraded_le.ply") else { return };
    let error = open(&path).expect_err("destroyed");
    assert!(matches!(error, OpenError::FloatStep { .. }), "{error}");
    let remedy = ["double coordinates", "--offset or --offset-file", "FLOAT32_degraded_le.ply: "];
    assert_contains(&error.to_string(), &remedy);
}

#[test]
fn the_otira_bed_has_its_figures() {
    let Some(path) = shared("otira/otira_poisson.ply") else { return };
    let found = look(&path);
    let (contents, surface) = (&found.survey.contents, &found.survey.surface);
    assert_eq!((contents.vertices, contents.triangles), (214_358, 414_183));
    // Reckoned with NumPy from the same file. A 17th triangle, of 4.5e-13 m², is a sliver, not nothing.
    assert_eq!(surface.zero_area_triangles, 16);
    assert!((surface.surface_area_m2 - 42.887_903_270_6).abs() < 1e-9, "{}", surface.surface_area_m2);
    assert!((surface.mean_edge_m - 0.016_630_097_291).abs() < 1e-11, "{}", surface.mean_edge_m);
    assert_eq!(found.survey.suggestion.preset, Preset::LaserScan);
    assert_eq!(found.warnings, Vec::<String>::new());
    let text = found.to_string();
    assert_contains(&text, &["414183", "PLY binary_little_endian", "--config laser-scan", "zero-area triangles"]);
    println!("{text}");
    let json = serde_json::to_value(&found).expect("serializable");
    assert_eq!(json["survey"]["surface"]["zero_area_triangles"], 16);
}

#[test]
fn the_golden_beds_have_their_counts_and_colours() {
    for (name, vertices, triangles) in [("bed3d_1M", 481_851, 962_254), ("bed_0.3M", 150_544, 299_538)] {
        let Some(path) = shared(&format!("golden/{name}.ply")) else { return };
        let reach = open(&path).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((reach.vertices(), reach.triangles()), (vertices, triangles));
        assert!(reach.has_colors());
    }
}

#[test]
fn the_widest_scene_opens_in_seconds() {
    let Some(path) = shared("dev-scenes/wide_window/mesh.ply") else { return };
    let start = std::time::Instant::now();
    let reach = open(&path).unwrap_or_else(|e| panic!("{e}"));
    let seconds = start.elapsed().as_secs_f64();
    println!("{} triangles opened in {seconds:.3} s", reach.triangles());
    assert_eq!((reach.vertices(), reach.triangles()), (751_969, 1_494_646));
    assert!(seconds < 10.0, "{seconds} s");
}
