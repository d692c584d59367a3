use crate::fixture::{Strip, new_zealand, survey};
use crate::small_disk::SmallDisk;
use gravelometer::write::{OutputFolder, WriteError, write_all};
use std::cell::RefCell;
use std::fs;
use std::path::Path;

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn all_files_and_no_others_are_written_and_progress_names_each() {
    let keep = tempfile::tempdir().expect("temporary folder");
    let out = OutputFolder::create(&keep.path().join("a/b/out"), false, &[]).expect("new folder with parents");
    let mesh = Strip { faces: vec![vec![0, 1, 2]], vertices: 3 };
    let mut survey = survey(1, new_zealand());
    survey.catalogue.grains[0].grain.triangle_ids = vec![0];
    let heard = RefCell::new(Vec::new());
    let paths = write_all(&out, &survey.results(Some(&mesh)), &|name| heard.borrow_mut().push(name.to_owned()));
    let paths = paths.expect("all files");
    let expected = ["grain_size.tif", "grains.csv", "grains.gpkg", "labelled_mesh.ply", "run.json", "summary.json"];
    assert_eq!(names(out.path()), expected);
    assert_eq!(paths.len(), 6);
    assert!(paths.iter().all(|p| p.is_file()));
    let mut heard = heard.into_inner();
    heard.sort();
    assert_eq!(heard, expected);
}

#[test]
fn a_folder_with_results_is_refused_by_their_names_and_replaced_on_request() {
    let keep = tempfile::tempdir().expect("temporary folder");
    fs::write(keep.path().join("grains.csv"), "old").expect("old result");
    fs::write(keep.path().join("labelled_mesh.ply"), "old").expect("old result");
    fs::write(keep.path().join("notes.txt"), "mine").expect("other file");
    let error = OutputFolder::create(keep.path(), false, &[]).expect_err("occupied").to_string();
    assert!(error.contains("grains.csv, labelled_mesh.ply; and 1 others"), "{error}");
    let out = OutputFolder::create(keep.path(), true, &[]).expect("forced");
    assert_eq!(fs::read_to_string(keep.path().join("grains.csv")).expect("old result"), "old");
    write_all(&out, &survey(3, new_zealand()).results(None), &|_| ()).expect("all files");
    assert!(fs::read_to_string(keep.path().join("grains.csv")).expect("new result").starts_with("grain_id,"));
    assert_eq!(fs::read_to_string(keep.path().join("notes.txt")).expect("other file"), "mine");
    assert!(!keep.path().join("labelled_mesh.ply").exists(), "a mesh of other grains would mislead");
}

#[test]
fn unfinished_files_and_named_entries_do_not_occupy_a_folder() {
    let keep = tempfile::tempdir().expect("temporary folder");
    fs::write(keep.path().join("grains.gpkg.partial"), "cut off").expect("unfinished");
    fs::write(keep.path().join("grains.gpkg.partial-journal"), "cut off").expect("unfinished");
    fs::create_dir(keep.path().join("tiles")).expect("records");
    let out = OutputFolder::create(keep.path(), false, &["tiles"]).expect("free");
    write_all(&out, &survey(3, new_zealand()).results(None), &|_| ()).expect("all files");
    let expected = ["grain_size.tif", "grains.csv", "grains.gpkg", "run.json", "summary.json", "tiles"];
    assert_eq!(names(out.path()), expected);
}

#[test]
fn a_file_in_place_of_the_folder_is_refused() {
    let keep = tempfile::tempdir().expect("temporary folder");
    let path = keep.path().join("out");
    fs::write(&path, "a file").expect("file");
    let error = OutputFolder::create(&path, true, &[]).expect_err("a file");
    assert!(matches!(error, WriteError::NotAFolder { .. }), "{error}");
    assert!(OutputFolder::create(&path.join("below"), true, &[]).is_err());
}

#[test]
fn a_folder_that_cannot_be_written_to_is_refused_before_the_run() {
    let path = Path::new("/proc/gravelometer");
    if !Path::new("/proc/self").exists() {
        println!("skipped: there is no /proc to write to in vain");
        return;
    }
    let error = OutputFolder::create(path, false, &[]).expect_err("not writable");
    assert!(error.to_string().starts_with("/proc/gravelometer: cannot make the output folder: "), "{error}");
}

#[test]
fn an_impossible_raster_stops_the_run_and_leaves_the_older_results() {
    let keep = tempfile::tempdir().expect("temporary folder");
    fs::write(keep.path().join("grains.csv"), "old").expect("old result");
    let out = OutputFolder::create(keep.path(), true, &[]).expect("forced");
    let mut survey = survey(3, new_zealand());
    survey.settings.raster.cell_m = 1e-5;
    let error = write_all(&out, &survey.results(None), &|_| ()).expect_err("2e10 cells");
    assert!(error.to_string().starts_with("raster.cell_m = 0.00001: "), "{error}");
    assert_eq!(names(keep.path()), ["grains.csv"]);
}

#[test]
fn a_full_disk_is_an_error_and_leaves_nothing_under_a_final_name() {
    let survey = survey(171, new_zealand());
    let whole = tempfile::tempdir().expect("temporary folder");
    let out = OutputFolder::create(whole.path(), false, &[]).expect("empty folder");
    let paths = write_all(&out, &survey.results(None), &|_| ()).expect("all files");
    let bytes: u64 = paths.iter().map(|p| p.metadata().expect("file").len()).sum();
    let full = (bytes / 1024) as u32;
    let mut refused = 0;
    for kibibytes in (8..full).step_by(12) {
        let Some(disk) = SmallDisk::new(kibibytes) else {
            println!("skipped: this user cannot mount a small disk");
            return;
        };
        let written = OutputFolder::create(disk.path(), false, &[])
            .and_then(|out| write_all(&out, &survey.results(None), &|_| ()));
        let error = written.expect_err(&format!("{kibibytes} KiB of {full}")).to_string();
        assert!(error.contains("\nhelp: "), "{error}");
        assert!(names(disk.path()).is_empty(), "{kibibytes} KiB: {:?}", names(disk.path()));
        refused += 1;
    }
    assert!(refused > 5, "only {refused} disks were tried");
    let disk = SmallDisk::new(full * 2 + 1024).expect("mounted before");
    let out = OutputFolder::create(disk.path(), false, &[]).expect("room");
    write_all(&out, &survey.results(None), &|_| ()).expect("room for all");
}
