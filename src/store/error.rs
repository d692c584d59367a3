//! What can go wrong on the disk.

use std::io;
use std::path::{Path, PathBuf};

/// A file of the work folder could not be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The system refused.
    #[error("cannot {action} {}: {source}\nhelp: {}", path.display(), advice(source))]
    File {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// Why not.
        source: io::Error,
    },
    /// A column of another length than its manifest says.
    #[error("{} has {found} bytes instead of {expected}\nhelp: remove the work folder and run again", path.display())]
    Length {
        /// The file.
        path: PathBuf,
        /// Its length, bytes.
        found: u64,
        /// What it should be, bytes.
        expected: u64,
    },
}

impl StoreError {
    pub(super) fn file(path: &Path, action: &'static str, source: io::Error) -> StoreError {
        StoreError::File { path: path.to_owned(), action, source }
    }
}

fn advice(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free some space or name another folder with --work-dir, then run the same command with --resume"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "name a folder that can be written to with --work-dir"
        }
        _ => "look at the disk, then run the same command with --resume",
    }
}
