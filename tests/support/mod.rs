//! What several test binaries share: where the data lies, and how the authors' results are read.
#![allow(dead_code, unreachable_pub, missing_docs, clippy::unwrap_used)]

pub mod bed;
pub mod interrupted;
pub mod small_disk;
pub mod tiled;

use gravelometer::index::{BuildRoom, Index};
use gravelometer::open::Surface;
use gravelometer::store::Shelf;
use std::path::PathBuf;

/// The index of a surface, in a folder that is gone when the index is dropped.
pub fn indexed(surface: &dyn Surface) -> Index {
    indexed_with(surface, BuildRoom::default())
}

/// The index of a surface, built in little or much memory.
pub fn indexed_with(surface: &dyn Surface, room: BuildRoom) -> Index {
    let folder = tempfile::tempdir().unwrap();
    // Open files outlive their folder.
    Index::build(surface, &Shelf::new(folder.path()).unwrap(), room).unwrap()
}

/// The folder of shared test data, or nothing (with a printed reason) where it is absent.
pub fn data(relative: &str) -> Option<PathBuf> {
    let root = std::env::var_os("GRAVELOMETER_DATA")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")), PathBuf::from);
    let path = root.join(relative);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is not there (set GRAVELOMETER_DATA to the folder of shared data)", path.display());
    None
}
