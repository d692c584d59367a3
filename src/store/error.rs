//! What can go wrong with the files that a run keeps.

use std::io;
use std::path::{Path, PathBuf};

/// A record file, column file or manifest that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The system refuses.
    #[error("{path}: cannot {action}: {source}\nhelp: check the path, its permissions and that disk", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// Why it failed.
        source: io::Error,
    },
    /// No room is left, on the disk or in the user's share of it.
    #[error(
        "{path}: cannot {action}, the disk is full: {source}\nhelp: free some space there, or name a folder on another disk with --work-dir; then run the same command with --resume",
        path = path.display()
    )]
    Full {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// The file does not begin as a ledger does.
    #[error("{path}: is no record file of gravelometer\nhelp: move it away, or name another folder", path = path.display())]
    NotALedger {
        /// The file.
        path: PathBuf,
    },
    /// A ledger of another format.
    #[error(
        "{path}: is a record file of format {found}, but this program reads format {known}\nhelp: resume with the version that wrote it, or remove the file and start again",
        path = path.display()
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// Its format.
        found: u32,
        /// The format that is read here.
        known: u32,
    },
    /// The header of a ledger does not fit its checksum.
    #[error("{path}: the header of the record file is damaged\nhelp: remove the file and start again", path = path.display())]
    DamagedHeader {
        /// The file.
        path: PathBuf,
    },
    /// The ledger belongs to something else.
    #[error(
        "{path}: holds the records of another run\n  recorded: {recorded}\n  wanted: {wanted}\nhelp: run with the inputs and settings of those records, or remove the file and start again",
        path = path.display()
    )]
    OtherIdentity {
        /// The file.
        path: PathBuf,
        /// Identity in the file.
        recorded: String,
        /// Identity that was asked for.
        wanted: String,
    },
    /// Somebody else holds the ledger.
    #[error("{path}: another run is writing its records here\nhelp: wait for it, or name another folder", path = path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
    /// A record that was whole when the ledger was opened, or a position where none begins.
    #[error(
        "{path}: there is no whole record at byte {position}\nhelp: something else changed the file, or the disk is failing; remove the file and start again",
        path = path.display()
    )]
    DamagedRecord {
        /// The file.
        path: PathBuf,
        /// Where it should begin.
        position: u64,
    },
    /// A column file of another length than its elements take.
    #[error(
        "{path}: has {found} bytes, but {elements} elements of {element_bytes} bytes take {expected}\nhelp: the file was cut off or belongs to another survey; remove it and start again",
        path = path.display()
    )]
    ColumnLength {
        /// The file.
        path: PathBuf,
        /// Number of elements.
        elements: u64,
        /// Bytes of one.
        element_bytes: usize,
        /// Bytes that there should be.
        expected: u64,
        /// Bytes that there are.
        found: u64,
    },
}

impl StoreError {
    /// The error for what the system says; a full disk is told apart.
    pub(crate) fn io(path: &Path, action: &'static str, source: io::Error) -> StoreError {
        let path = path.to_owned();
        match source.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => StoreError::Full { path, action, source },
            _ => StoreError::Io { path, action, source },
        }
    }
}
