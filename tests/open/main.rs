//! The `open` stage and `inspect`, from bytes built here and from files of other software.

mod counted;
mod files_of_others;
mod georeference;
mod headers;
mod layouts;
mod malformed;
mod plausible;
mod ply_bytes;
mod random_damage;
mod same_surface;
mod several_files;
mod side_files;

use gravelometer::open::{OpenError, Reach, Warning};
use gravelometer::settings::InputSettings;
use std::path::{Path, PathBuf};

/// Writes the bytes to a file of that name in a new directory and opens it with these settings.
fn open_with(name: &str, bytes: &[u8], input: &InputSettings) -> Result<(Reach, Vec<Warning>), OpenError> {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join(name);
    std::fs::write(&path, bytes).expect("write");
    Reach::open(&[path], input, &|_, _| {})
}

fn open_bytes(bytes: &[u8]) -> Result<(Reach, Vec<Warning>), OpenError> {
    open_with("reach.ply", bytes, &InputSettings::default())
}

/// The message of the error that opening must give, checked to name the file and a remedy.
fn refusal(bytes: &[u8]) -> String {
    let message = open_bytes(bytes).expect_err("must be refused").to_string();
    assert!(message.contains("reach.ply: "), "names the file: {message}");
    assert!(message.contains("\nhelp: "), "names a remedy: {message}");
    message
}

#[track_caller]
fn assert_contains(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

/// The shared data's directory, or a printed reason to skip.
fn shared(below: &str) -> Option<PathBuf> {
    let root = std::env::var_os("GRAVELOMETER_DATA")
        .map(PathBuf::from)
        .unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"));
    let path = root.join(below);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there (set GRAVELOMETER_DATA)", path.display());
    None
}
