//! Damaged meshes through the program: an error that names the file and what to do, or a result, but never a
//! panic, a signal or half a result.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use gravelometer::geometry::DVec3;
use gravelometer::open::{MemorySurface, Reach};
use gravelometer::settings::InputSettings;
use proptest::prelude::*;
use std::process::Output;
use support::bed::{Rng, bed, ply};

struct Run {
    folder: tempfile::TempDir,
    output: Output,
}

impl Run {
    fn of(bytes: &[u8]) -> Run {
        Run::with(bytes, &[])
    }

    fn with(bytes: &[u8], more: &[&str]) -> Run {
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join("damaged.ply");
        std::fs::write(&mesh, bytes).unwrap();
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_gravelometer"))
            .args(["run", "--threads", "2", "-o"])
            .args([&folder.path().join("out"), &mesh])
            .args(more)
            .output()
            .unwrap();
        let run = Run { folder, output };
        assert!(!run.stderr().contains("panicked"), "{}", run.stderr());
        assert!(run.output.status.code().is_some(), "ended by a signal: {}", run.stderr());
        run
    }

    fn stderr(&self) -> String {
        String::from_utf8(self.output.stderr.clone()).unwrap()
    }

    fn files(&self) -> usize {
        std::fs::read_dir(self.folder.path().join("out")).map_or(0, Iterator::count)
    }

    /// Failed, with a message that says where, what and what to do; nothing was written.
    fn fails_with(self, says: &str) {
        let text = self.stderr();
        assert_eq!(self.output.status.code(), Some(1), "{text}");
        assert!(text.contains(says), "`{says}` is not in: {text}");
        assert!(text.contains("\nhelp: "), "{text}");
        assert_eq!(self.files(), 0, "{text}");
    }

    fn names_the_file(self) -> Run {
        let path = self.folder.path().join("damaged.ply");
        assert!(self.stderr().contains(path.to_str().unwrap()), "{}", self.stderr());
        self
    }

    fn succeeds(self) {
        assert_eq!(self.output.status.code(), Some(0), "{}", self.stderr());
        assert_eq!(self.files(), 5, "{}", self.stderr());
    }
}

fn header_end(bytes: &[u8]) -> usize {
    bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11
}

fn small() -> MemorySurface {
    bed(9, 40, 40)
}

#[test]
fn a_file_that_is_cut_off_anywhere_is_refused() {
    let whole = ply(&small());
    let end = header_end(&whole);
    for length in [whole.len() - 1, whole.len() / 2, end + 1, end] {
        Run::of(&whole[..length]).names_the_file().fails_with("the file ends at byte");
    }
    Run::of(&whole[..end / 2]).names_the_file().fails_with("damaged.ply");
    Run::of(b"").names_the_file().fails_with("is empty");
}

#[test]
fn a_face_that_names_a_vertex_that_is_not_there_is_refused_by_its_number() {
    let mut mesh = small();
    mesh.triangles[1234][1] = 9_999_999;
    Run::of(&ply(&mesh)).names_the_file().fails_with("face 1234 refers to vertex 9999999");
}

#[test]
fn a_survey_that_another_program_changes_meanwhile_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("reach.ply");
    let bytes = ply(&bed(1, 40, 40));
    std::fs::write(&mesh, &bytes).unwrap();
    let (reach, _) = Reach::open(std::slice::from_ref(&mesh), &InputSettings::default(), &|_, _| {}).unwrap();
    reach.check_unchanged(true).unwrap();
    let at = std::fs::metadata(&mesh).unwrap().modified().unwrap() + std::time::Duration::from_nanos(1000);
    std::fs::File::options().append(true).open(&mesh).unwrap().set_modified(at).unwrap();
    let refused = |opened_again: bool| {
        let said = reach.check_unchanged(opened_again).unwrap_err().to_string();
        assert!(said.contains("reach.ply: was changed while it was read") && said.contains("help:"), "{said}");
    };
    refused(false);
    refused(true);
    // What is mapped is still the old file where a new one takes its name, or none does.
    let other = folder.path().join("new.ply");
    std::fs::write(&other, &bytes).unwrap();
    std::fs::rename(&other, &mesh).unwrap();
    reach.check_unchanged(false).unwrap();
    refused(true);
    std::fs::remove_file(&mesh).unwrap();
    reach.check_unchanged(false).unwrap();
    refused(true);
}

#[test]
fn coordinates_that_are_no_numbers_are_refused_by_their_vertex() {
    for (value, text) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf"), (f64::NEG_INFINITY, "-inf")] {
        let mut mesh = small();
        mesh.positions[77].y = value;
        Run::of(&ply(&mesh)).names_the_file().fails_with(&format!("vertex 77: property `y` is {text}"));
    }
}

#[test]
fn a_mesh_without_vertices_and_a_cloud_without_a_surface_are_refused() {
    let points = MemorySurface { triangles: Vec::new(), ..small() };
    let mut two = points.clone();
    two.positions.truncate(2);
    Run::of(&ply(&two)).fails_with("2 of the 2 points of the cloud can be used");
    let mut line = points;
    line.positions.iter_mut().for_each(|p| *p = DVec3::new(p.x, 0.0, 0.0));
    Run::of(&ply(&line)).fails_with("no three are near enough for a triangle");
    Run::of(&ply(&MemorySurface::default())).names_the_file().fails_with("has 0 vertices");
}

#[test]
fn a_mesh_of_faces_without_area_is_refused() {
    let mut mesh = small();
    mesh.triangles.iter_mut().for_each(|t| t[2] = t[1]);
    Run::of(&ply(&mesh)).fails_with("no area");
    let mut line = small();
    line.positions.iter_mut().for_each(|p| *p = DVec3::new(p.x, 0.0, 0.0));
    Run::of(&ply(&line)).fails_with("no area");
}

#[test]
fn a_mesh_whose_vertices_all_have_a_face_of_their_own_is_refused_where_their_spacing_matters() {
    let mut surface = small();
    surface.triangles.extend((0..surface.positions.len() as u64).map(|v| [v; 3]));
    Run::of(&ply(&surface)).succeeds();
    let run = Run::with(&ply(&surface), &["--set", "segment.method=rheinwalt2025"]);
    assert_eq!(run.output.status.code(), Some(1), "{}", run.stderr());
    let text = run.stderr();
    assert!(text.contains("three times") && text.contains("\nhelp: "), "{text}");
}

#[test]
fn counts_far_beyond_the_file_are_refused_without_taking_memory() {
    let text = String::from_utf8(ply(&small())[..header_end(&ply(&small()))].to_vec()).unwrap();
    let vertices = format!("element vertex {}", small().positions.len());
    for count in ["4000000000", "18446744073709551615", "99999999999999999999999"] {
        let lying = text.replace(&vertices, &format!("element vertex {count}"));
        Run::of(lying.as_bytes()).names_the_file().fails_with("help");
    }
}

#[test]
fn a_mesh_whose_faces_are_doubled_turned_over_and_share_edges_by_threes_is_worked() {
    let mut mesh = bed(10, 60, 50);
    let faces = mesh.triangles.clone();
    mesh.triangles.extend(faces.iter().step_by(2).map(|&[a, b, c]| [c, b, a]));
    mesh.triangles.extend(faces.iter().step_by(3));
    mesh.triangles.extend(faces.windows(2).step_by(5).map(|w| [w[0][0], w[0][1], w[1][2]]));
    Run::of(&ply(&mesh)).succeeds();
}

#[test]
fn a_single_triangle_is_worked() {
    let mut mesh = small();
    mesh.triangles.truncate(1);
    Run::of(&ply(&mesh)).succeeds();
}

/// Triangles among random points: no surface at all.
fn soup(seed: u64, points: usize, triangles: usize, extent_m: f64) -> MemorySurface {
    let mut rng = Rng(seed);
    let mut mesh = MemorySurface::default();
    let mut place = || rng.within(0.0, extent_m);
    mesh.positions = (0..points).map(|_| DVec3::new(place(), place(), place())).collect();
    mesh.triangles = (0..triangles).map(|_| [0; 3].map(|_| rng.below(points) as u64)).collect();
    mesh
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_behind_a_good_header_never_crash_the_program(seed in any::<u64>(), from_faces in any::<bool>()) {
        let mesh = small();
        let mut bytes = ply(&mesh);
        let start = header_end(&bytes) + if from_faces { 27 * mesh.positions.len() } else { 0 };
        let mut rng = Rng(seed);
        bytes[start..].iter_mut().for_each(|b| *b = rng.next() as u8);
        let code = Run::of(&bytes).output.status.code();
        prop_assert!(matches!(code, Some(0 | 1)), "{code:?}");
    }

    #[test]
    fn a_few_flipped_bytes_never_crash_the_program(seed in any::<u64>()) {
        let mut bytes = ply(&bed(seed % 5, 24, 24));
        let mut rng = Rng(seed);
        for _ in 0..4 {
            let at = rng.below(bytes.len());
            bytes[at] = rng.next() as u8;
        }
        let code = Run::of(&bytes).output.status.code();
        prop_assert!(matches!(code, Some(0 | 1)), "{code:?}");
    }

    #[test]
    fn triangles_among_random_points_are_worked(seed in any::<u64>(), points in 3usize..300, extent_m in 0.01f64..50.0) {
        let mesh = soup(seed, points, 2 * points + 1, extent_m);
        let run = Run::of(&ply(&mesh));
        prop_assert!(run.output.status.code() == Some(0) || run.stderr().contains("no area"), "{}", run.stderr());
    }
}
