//! What a user must never lose, and what must never change a result in silence.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use gravelometer::error::Error;
use gravelometer::geometry::DVec3;
use gravelometer::pipeline::Control;
use gravelometer::progress::Silent;
use gravelometer::run::{Job, Outcome, run};
use gravelometer::settings::Settings;
use gravelometer::write::{OutputFolder, WriteError};
use std::path::{Path, PathBuf};
use support::bed::{bed, write_ply};

fn job(mesh: &Path, out: &Path) -> Job {
    let settings = Settings::load(None, &["segment.min_grain_area_m2=1e-4".into()]).unwrap();
    Job { inputs: vec![mesh.to_owned()], out: out.to_owned(), settings, force: true, resume: false, work: None }
}

fn work(job: &Job) -> Result<Outcome, Error> {
    run(job, &Silent, &Control::default())
}

#[test]
fn an_input_that_a_result_would_replace_is_spared_under_whatever_name() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("labelled_mesh.ply");
    write_ply(&mesh, &bed(3, 40, 40));
    let before = std::fs::read(&mesh).unwrap();
    let link = folder.path().join("link.ply");
    std::os::unix::fs::symlink(&mesh, &link).unwrap();
    for input in [&mesh, &link] {
        let error = work(&job(input, folder.path())).expect_err("the input lies in the way");
        assert!(matches!(error, Error::Write(WriteError::InputInTheWay { .. })), "{error}");
        assert_eq!(std::fs::read(&mesh).unwrap(), before);
    }
}

#[test]
fn a_second_run_into_the_same_folder_is_refused_while_the_first_lasts() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let first = OutputFolder::create(&out, true, &[]).unwrap();
    assert!(matches!(OutputFolder::create(&out, true, &[]), Err(WriteError::Busy { .. })));
    drop(first);
    assert!(OutputFolder::create(&out, true, &[]).is_ok());
}

#[test]
fn a_run_that_cannot_read_its_input_leaves_no_folder_behind() {
    let folder = tempfile::tempdir().unwrap();
    let out: PathBuf = folder.path().join("deep/out");
    work(&job(&folder.path().join("none.ply"), &out)).expect_err("no input");
    assert!(!out.exists());
}

#[test]
fn a_vertex_that_no_face_uses_changes_nothing_however_far_away() {
    let folder = tempfile::tempdir().unwrap();
    let mut surface = bed(5, 60, 60);
    let mesh = folder.path().join("bed.ply");
    write_ply(&mesh, &surface);
    let plain = work(&job(&mesh, &folder.path().join("plain"))).unwrap();
    assert!(!plain.catalogue.grains.is_empty());
    surface.positions.push(DVec3::new(20_000.0, 3.0, 1.0));
    surface.colors.push([0; 3]);
    let stray = folder.path().join("stray.ply");
    write_ply(&stray, &surface);
    let with_stray = work(&job(&stray, &folder.path().join("stray"))).unwrap();
    assert_eq!(plain.catalogue, with_stray.catalogue);
}

#[test]
fn the_same_file_given_twice_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("bed.ply");
    write_ply(&mesh, &bed(3, 40, 40));
    let mut twice = job(&mesh, &folder.path().join("out"));
    twice.inputs.push(folder.path().join("./bed.ply"));
    let error = work(&twice).expect_err("twice").to_string();
    assert!(error.contains("given twice"), "{error}");
}
