//! Read-only memory maps of the input files.
//!
//! # Contract
//! A mapped file must not be truncated or rewritten in place while it is open. The system answers a read
//! beyond the new end with `SIGBUS`, which ends the program; a rewrite changes bytes that were already
//! validated, so that an index may then be out of range (a panic, never a read outside the map), and is
//! refused before an index of it is kept, and before labels that go back onto it are published. Writers
//! that replace a file by renaming a new one over it are safe: the map keeps the old one.
#![allow(unsafe_code)]

use super::error::OpenError;
use super::stamp::Stamp;
use memmap2::{Mmap, UncheckedAdvice};
use std::fs::{self, File};
use std::io::ErrorKind;
use std::ops::Deref;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// The bytes of one input file.
#[derive(Debug)]
pub(super) struct MappedFile {
    map: Mmap,
    stamp: Stamp,
    /// Whether it is a scratch file, written from the file of that stamp.
    is_scratch: bool,
    /// Bytes passed since the pages were last let go.
    passed: AtomicU64,
}

/// Pages are let go after so many bytes: few enough not to count, enough to be cheap.
const KEPT_BYTES: u64 = 32 << 20;

impl MappedFile {
    /// Maps a file for reading.
    ///
    /// # Errors
    /// Missing or unreadable file, directory or device, empty file.
    pub(super) fn open(path: &Path) -> Result<MappedFile, OpenError> {
        let name = || path.display().to_string();
        let unreadable = |source: std::io::Error| match source.kind() {
            ErrorKind::NotFound => OpenError::Missing { path: name() },
            _ => OpenError::Unreadable { path: name(), source },
        };
        // Asked before opening: opening a named pipe would wait for its writer for ever.
        let kind = fs::metadata(path).map_err(unreadable)?;
        if kind.is_dir() {
            return Err(OpenError::Directory { path: name() });
        }
        if !kind.is_file() {
            return Err(OpenError::NotAFile { path: name() });
        }
        let file = File::open(path).map_err(unreadable)?;
        let facts = file.metadata().map_err(unreadable)?;
        if facts.len() == 0 {
            return Err(OpenError::Empty { path: name() });
        }
        // SAFETY: the map is read-only and private to this value, which lives as long as any slice of it.
        // That nobody truncates or rewrites the file meanwhile is the contract above, which no program can
        // enforce on Linux; every index into the slice is bounds-checked, so a breach cannot read outside it.
        let map = unsafe { Mmap::map(&file) }.map_err(unreadable)?;
        Ok(MappedFile { map, stamp: Stamp::of(&facts), is_scratch: false, passed: AtomicU64::new(0) })
    }

    /// Maps a scratch file without a name, which stands for the file of this stamp.
    ///
    /// # Errors
    /// The system refuses.
    pub(super) fn of_scratch(file: &File, stamp: Stamp) -> std::io::Result<MappedFile> {
        // SAFETY: as in `open`; a file without a name is nobody else's.
        let map = unsafe { Mmap::map(file) }?;
        Ok(MappedFile { map, stamp, is_scratch: true, passed: AtomicU64::new(0) })
    }

    /// Says that so many bytes were read and are not needed soon.
    pub(super) fn passed(&self, bytes: u64) {
        if self.passed.fetch_add(bytes, Ordering::Relaxed) + bytes >= KEPT_BYTES {
            self.release();
        }
    }

    /// Lets go of the pages that were read: they no longer count as memory of this process. The system may
    /// keep them, and reads them again when they are asked for.
    pub(super) fn release(&self) {
        self.passed.store(0, Ordering::Relaxed);
        // SAFETY: the map is shared, read-only and backed by a file, so that a page that is dropped comes back
        // with the same bytes at the next access; slices into it stay valid. On failure nothing has changed.
        let _ = unsafe { self.map.unchecked_advise(UncheckedAdvice::DontNeed) };
    }

    /// Lets go of the pages where all of them together are more than may be kept.
    pub(super) fn release_if_large(&self) {
        if self.map.len() as u64 > KEPT_BYTES {
            self.release();
        }
    }

    /// The file on the disk, as it was when it was opened.
    pub(super) fn stamp(&self) -> Stamp {
        self.stamp
    }

    /// Refuses a file that was written to while it was mapped.
    ///
    /// # Errors
    /// What was read may be partly of the file before and partly of that after.
    pub(super) fn check_not_rewritten(&self, path: &Path) -> Result<(), OpenError> {
        if self.is_scratch { Ok(()) } else { self.stamp.check_not_rewritten(path) }
    }
}

impl Deref for MappedFile {
    type Target = [u8];

    #[inline]
    fn deref(&self) -> &[u8] {
        &self.map
    }
}
