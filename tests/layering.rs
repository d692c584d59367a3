//! The direction rule: a stage uses the stages above it, never one below, and nobody below knows tiles' schedule.
#![allow(missing_docs, clippy::unwrap_used)]

use std::path::{Path, PathBuf};

/// The river. A stage may use what stands before it.
const RIVER: [&str; 11] = [
    "open",
    "weld",
    "triangulate",
    "index",
    "tile",
    "curvature",
    "segment",
    "measure",
    "stitch",
    "statistics",
    "write",
];
/// What every stage may use.
const SHARED: [&str; 2] = ["geometry", "settings"];
/// What schedules, reports and keeps records; uses no stage.
const MACHINERY: [&str; 3] = ["pipeline", "progress", "store"];
/// Stages that touch the disk through `store`.
const KEEPS: [&str; 4] = ["triangulate", "index", "tile", "write"];
/// What stands beside the river and must not know how grains are found and measured, with all that it may use.
const BESIDE: [(&str, &[&str]); 2] =
    [("picture", &["geometry"]), ("validate", &["geometry", "settings", "open", "statistics", "store", "picture"])];
const MOST_LINES: usize = 400;

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Module of a source file, and the modules that it names as `crate::module`.
fn uses() -> Vec<(String, PathBuf, Vec<String>)> {
    let src = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src"));
    let mut files = Vec::new();
    sources(src, &mut files);
    files.sort();
    files
        .into_iter()
        .map(|path| {
            let inside = path.strip_prefix(src).unwrap();
            let module = inside.components().next().unwrap().as_os_str().to_str().unwrap().trim_end_matches(".rs");
            let text = std::fs::read_to_string(&path).unwrap();
            // A `[`crate::...`]` link in documentation is no dependency.
            let code: String = text.lines().filter(|l| !l.trim_start().starts_with("//")).collect();
            let named = code
                .split("crate::")
                .skip(1)
                .map(|rest| rest.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect::<String>());
            (module.to_owned(), path.clone(), named.collect())
        })
        .collect()
}

#[test]
fn no_stage_uses_one_below_it() {
    let files = uses();
    assert!(files.len() > 40, "found only {} source files", files.len());
    for (module, path, named) in files {
        let place = RIVER.iter().position(|s| *s == module);
        for other in named {
            let allowed = match (place, RIVER.iter().position(|s| *s == other)) {
                (Some(here), Some(there)) => there <= here,
                (Some(_), None) if other == "store" => KEEPS.contains(&module.as_str()),
                (Some(_), None) => SHARED.contains(&other.as_str()),
                (None, Some(_)) => !SHARED.contains(&module.as_str()) && !MACHINERY.contains(&module.as_str()),
                (None, None) => true,
            };
            assert!(allowed, "{} uses crate::{other}", path.display());
        }
    }
}

#[test]
fn what_judges_a_run_does_not_use_what_made_it() {
    let mut judged = 0;
    for (module, path, named) in uses() {
        let Some((_, allowed)) = BESIDE.iter().find(|(name, _)| *name == module) else { continue };
        judged += 1;
        for other in named.iter().filter(|other| **other != module) {
            assert!(allowed.contains(&other.as_str()), "{} uses crate::{other}", path.display());
        }
    }
    assert!(judged > 10, "found only {judged} files");
}

#[test]
fn every_source_file_is_short_enough_to_hold_one_idea() {
    for (_, path, _) in uses() {
        let lines = std::fs::read_to_string(&path).unwrap().lines().count();
        assert!(lines <= MOST_LINES, "{} has {lines} lines", path.display());
    }
}

#[test]
fn unsafe_code_is_in_as_few_files_as_can_be_counted_on_one_hand() {
    let with_unsafe: Vec<PathBuf> = uses()
        .into_iter()
        .filter(|(_, path, _)| std::fs::read_to_string(path).unwrap().contains("allow(unsafe_code)"))
        .map(|(_, path, _)| path)
        .collect();
    assert!(with_unsafe.len() <= 5, "{with_unsafe:?}");
}
