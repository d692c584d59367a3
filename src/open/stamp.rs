//! Which file on the disk was opened, and whether it is still what it was.

use super::error::OpenError;
use std::fs::{self, Metadata};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// A file as it was when it was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    /// Device and number on it: a file that replaces another one has others.
    place: (u64, u64),
    bytes: u64,
    /// Time of the last change since 1970, seconds and nanoseconds.
    modified_s_ns: (i64, i64),
}

impl Stamp {
    pub(super) fn of(facts: &Metadata) -> Stamp {
        Stamp {
            place: (facts.dev(), facts.ino()),
            bytes: facts.size(),
            modified_s_ns: (facts.mtime(), facts.mtime_nsec()),
        }
    }

    /// Time of the last change, seconds since 1970. No finer: copies often have whole seconds.
    pub(super) fn modified_s(&self) -> i64 {
        self.modified_s_ns.0
    }

    /// Refuses a file that was written to. One that another was renamed over, or that is gone, can still be read.
    ///
    /// # Errors
    /// Its length or the time of its last change is another one.
    pub(super) fn check_not_rewritten(&self, path: &Path) -> Result<(), OpenError> {
        match fs::metadata(path).map(|facts| Stamp::of(&facts)) {
            Ok(now) if now.place == self.place && now != *self => {
                Err(OpenError::Changed { path: path.display().to_string() })
            }
            _ => Ok(()),
        }
    }

    /// Refuses whatever is not the file that was opened, as it was.
    ///
    /// # Errors
    /// It was written to, replaced, or is gone.
    pub(super) fn check_same(&self, path: &Path) -> Result<(), OpenError> {
        match fs::metadata(path).map(|facts| Stamp::of(&facts)) {
            Ok(now) if now == *self => Ok(()),
            _ => Err(OpenError::Changed { path: path.display().to_string() }),
        }
    }
}
