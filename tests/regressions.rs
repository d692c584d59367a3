//! What fuzzing began with and what it found, run once more: see `tools/fuzz`.
#![allow(missing_docs)]

#[path = "fuzz/checks/las.rs"]
mod las;
#[path = "fuzz/checks/offsets.rs"]
mod offsets;
#[path = "fuzz/checks/ply.rs"]
mod ply;
#[path = "fuzz/checks/settings.rs"]
mod settings;
#[path = "fuzz/checks/truth.rs"]
mod truth;

use std::path::Path;

/// Runs every file that is kept for a target.
fn run_all(target: &str, check: fn(&[u8])) {
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz");
    let mut paths = Vec::new();
    for folder in ["seeds", "regressions"] {
        let entries = fuzz.join(folder).join(target).read_dir().expect("a folder for each target");
        paths.extend(entries.map(|entry| entry.expect("an entry").path()));
    }
    paths.sort();
    assert!(!paths.is_empty());
    for path in paths {
        println!("{}", path.display());
        check(&std::fs::read(&path).expect("readable"));
    }
}

#[test]
fn every_input_kept_for_las_is_read_or_refused_by_name() {
    run_all("las", las::check);
}

#[test]
fn every_input_kept_for_offsets_is_read_or_refused_by_name() {
    run_all("offsets", offsets::check);
}

#[test]
fn every_input_kept_for_ply_is_read_or_refused_by_name() {
    run_all("ply", ply::check);
}

#[test]
fn every_input_kept_for_settings_is_read_or_refused_by_name() {
    run_all("settings", settings::check);
}

#[test]
fn every_input_kept_for_truth_is_read_or_refused_by_name() {
    run_all("truth", truth::check);
}

#[test]
fn every_target_is_run_here() {
    let targets = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/fuzz_targets");
    let mut names: Vec<_> =
        targets.read_dir().expect("a folder").map(|entry| entry.expect("an entry").file_name()).collect();
    names.sort();
    assert_eq!(names, ["las.rs", "offsets.rs", "ply.rs", "settings.rs", "truth.rs"], "a target without its test above");
}
