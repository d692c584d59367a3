//! Several files as one survey.

use crate::ply_bytes::{Element, axis, faces, file, vertices};
use gravelometer::open::{OpenError, Reach, Warning};
use gravelometer::settings::InputSettings;
use std::path::PathBuf;
use std::sync::Mutex;

fn write_all(contents: &[Vec<u8>]) -> (tempfile::TempDir, Vec<PathBuf>) {
    let directory = tempfile::tempdir().expect("temporary directory");
    let paths = contents.iter().enumerate().map(|(i, bytes)| {
        let path = directory.path().join(format!("part{i}.ply"));
        std::fs::write(&path, bytes).expect("write");
        path
    });
    let paths = paths.collect();
    (directory, paths)
}

fn moved(by: f64) -> Element {
    Element::new("vertex")
        .numbers("float x", axis(0).map(|v| v + by))
        .numbers("float y", axis(1))
        .numbers("float z", axis(2))
}

#[test]
fn numbers_run_on_from_file_to_file() {
    let quads =
        Element::new("face").lists("list uchar int vertex_indices", [vec![0.0, 1.0, 2.0, 3.0], vec![0.0, 1.0, 4.0]]);
    let (_directory, paths) =
        write_all(&[file(&[&vertices(), &faces()]), file(&[&moved(1.0), &quads]), file(&[&moved(2.0), &faces()])]);
    let (reach, warnings) = Reach::open(&paths, &InputSettings::default(), &|_, _| {}).expect("readable");
    assert_eq!(warnings, []);
    assert_eq!((reach.vertices(), reach.faces(), reach.triangles()), (15, 10, 11));
    assert_eq!(reach.triangle(4), [5, 6, 7]);
    assert_eq!(reach.triangle(5), [5, 7, 8]);
    assert_eq!(reach.triangle(7), [10, 11, 14]);
    assert_eq!([4, 5, 6, 7].map(|t| reach.face_of(t)), [4, 4, 5, 6]);
    assert_eq!(reach.position(5).x, reach.position(0).x + 1.0);
    assert_eq!(reach.position(14).x, reach.position(4).x + 2.0);
    assert_eq!(reach.input_bounds(), ([1.0, 2.0, -0.25], [4.0, 3.0, 1.0]));
    let firsts: Vec<_> = reach.files().iter().map(|f| (f.first_vertex(), f.first_face(), f.first_triangle())).collect();
    assert_eq!(firsts, [(0, 0, 0), (5, 4, 4), (10, 6, 7)]);
}

#[test]
fn an_index_may_not_reach_into_the_next_file() {
    let beyond = Element::new("face").lists("list uchar int vertex_indices", [vec![0.0, 1.0, 5.0]]);
    let (_directory, paths) = write_all(&[file(&[&vertices(), &beyond]), file(&[&vertices(), &faces()])]);
    let error = Reach::open(&paths, &InputSettings::default(), &|_, _| {}).expect_err("out of range");
    assert!(
        matches!(&error, OpenError::VertexIndex { path, index: 5, vertices: 5, .. } if path.ends_with("part0.ply"))
    );
}

#[test]
fn colours_are_all_or_nothing_and_said_so() {
    let colored = ["red", "green", "blue"].iter().fold(vertices(), |e, n| e.numbers(&format!("uchar {n}"), [255.0; 5]));
    let (_directory, paths) = write_all(&[file(&[&colored, &faces()]), file(&[&moved(1.0), &faces()])]);
    let (reach, warnings) = Reach::open(&paths, &InputSettings::default(), &|_, _| {}).expect("readable");
    assert!(!reach.has_colors());
    assert_eq!(reach.color(0), None);
    let named = |w: &Warning| matches!(w, Warning::SomeFilesWithoutColours { path } if path.ends_with("part1.ply"));
    assert!(warnings.iter().any(named), "{warnings:?}");
}

#[test]
fn progress_grows_to_the_total_and_not_beyond() {
    let (_directory, paths) = write_all(&[file(&[&vertices(), &faces()]), file(&[&moved(1.0), &faces()])]);
    let bytes: u64 = paths.iter().map(|p| p.metadata().expect("metadata").len()).sum();
    let heard = Mutex::new(Vec::new());
    Reach::open(&paths, &InputSettings::default(), &|done, total| heard.lock().expect("lock").push((done, total)))
        .expect("readable");
    let heard = heard.into_inner().expect("lock");
    assert!(heard.iter().all(|&(done, total)| done <= total && total == bytes), "{heard:?}");
    assert_eq!(heard.last(), Some(&(bytes, bytes)));
}

#[test]
fn a_fingerprint_tells_files_apart_and_is_stable() {
    let (_directory, paths) =
        write_all(&[file(&[&vertices(), &faces()]), file(&[&vertices(), &faces()]), file(&[&moved(1.0), &faces()])]);
    let (reach, _) = Reach::open(&paths, &InputSettings::default(), &|_, _| {}).expect("readable");
    let [a, b, c] = [0, 1, 2].map(|i| reach.files()[i].fingerprint());
    assert_eq!(a.samples_fnv1a64, b.samples_fnv1a64);
    assert_ne!(a.samples_fnv1a64, c.samples_fnv1a64);
}
