//! The folder in which a run keeps what it needs again.

use super::{Column, Element, Entry, Ledger, StoreError, write_atomically};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};
use twox_hash::XxHash3_64;

/// A folder of columns and scratch files. Stages name what they keep; only the shelf knows where.
#[derive(Debug, Clone)]
pub struct Shelf {
    folder: PathBuf,
}

impl Shelf {
    /// Makes the folder where it is not there.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn new(folder: &Path) -> Result<Shelf, StoreError> {
        fs::create_dir_all(folder).map_err(|e| StoreError::io(folder, "make the folder", e))?;
        Ok(Shelf { folder: folder.to_owned() })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A file on the shelf.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// A shelf within this one.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn inner(&self, name: &str) -> Result<Shelf, StoreError> {
        Shelf::new(&self.path(name))
    }

    /// A new column.
    ///
    /// # Errors
    /// As [`Column::create`].
    pub fn create<T: Element>(&self, name: &str, len: u64) -> Result<Column<T>, StoreError> {
        Column::create(&self.path(name), len)
    }

    /// A column that is there.
    ///
    /// # Errors
    /// As [`Column::open`].
    pub fn open<T: Element>(&self, name: &str, len: u64) -> Result<Column<T>, StoreError> {
        Column::open(&self.path(name), len)
    }

    /// Whether there is something of this name.
    pub fn has(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    /// The name of something in the folder, if it is not empty.
    ///
    /// # Errors
    /// It cannot be listed.
    pub fn anything(&self) -> Result<Option<String>, StoreError> {
        let first = fs::read_dir(&self.folder).and_then(|mut entries| entries.next().transpose());
        let first = first.map_err(|e| StoreError::io(&self.folder, "list the folder", e))?;
        Ok(first.map(|entry| entry.file_name().to_string_lossy().into_owned()))
    }

    /// An empty file that one process at a time can hold; none if another one does.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn lock(&self, name: &str) -> Result<Option<File>, StoreError> {
        let path = self.path(name);
        let file = OpenOptions::new().append(true).create(true).open(&path);
        let file = file.map_err(|e| StoreError::io(&path, "make the lock file", e))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => Ok(None),
            // A file system without locks: nothing can be told.
            Err(TryLockError::Error(_)) | Ok(()) => Ok(Some(file)),
        }
    }

    /// Writes a small file, whole or not at all, with a checksum behind its bytes.
    ///
    /// # Errors
    /// The disk says no.
    pub fn put(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        let checksum = XxHash3_64::oneshot(bytes).to_le_bytes();
        write_atomically(&self.path(name), &[bytes, &checksum].concat())
    }

    /// The bytes of a small file, if it is there, can be read, and fits its checksum.
    pub fn get(&self, name: &str) -> Option<Vec<u8>> {
        let mut bytes = fs::read(self.path(name)).ok()?;
        let checksum = bytes.split_off(bytes.len().checked_sub(size_of::<u64>())?);
        (checksum == XxHash3_64::oneshot(&bytes).to_le_bytes()).then_some(bytes)
    }

    /// Opens the ledger of this name and identity. One of another identity, or a damaged one, is begun anew.
    ///
    /// # Errors
    /// As [`Ledger::open`].
    pub fn ledger(&self, name: &str, identity: &str) -> Result<(Ledger, Vec<Entry>), StoreError> {
        match self.ledger_of(name, identity) {
            Err(StoreError::OtherIdentity { .. } | StoreError::Format { .. }) => self.ledger_anew(name, identity),
            opened => opened,
        }
    }

    /// Opens the ledger of this name, which must be of this identity if it is there. A damaged one is begun anew.
    ///
    /// # Errors
    /// As [`Ledger::open`].
    pub fn ledger_of(&self, name: &str, identity: &str) -> Result<(Ledger, Vec<Entry>), StoreError> {
        match Ledger::open(&self.path(name), identity) {
            Err(StoreError::DamagedHeader { .. } | StoreError::NotALedger { .. }) => self.ledger_anew(name, identity),
            opened => opened,
        }
    }

    fn ledger_anew(&self, name: &str, identity: &str) -> Result<(Ledger, Vec<Entry>), StoreError> {
        self.remove(name);
        Ledger::open(&self.path(name), identity)
    }

    /// Bytes that are free on the shelf's disk; none where the system does not tell.
    pub fn free_bytes(&self) -> Option<u64> {
        free_bytes(&self.folder)
    }

    /// Removes a file that is no longer needed. Nothing is lost if it stays.
    pub fn remove(&self, name: &str) {
        let _ = fs::remove_file(self.path(name));
    }

    /// A file that nobody will find again.
    pub fn scratch(&self, name: &str) -> Result<(File, PathBuf), StoreError> {
        let path = self.path(&format!("{name}.scratch"));
        let made = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(&path);
        let file = made.map_err(|e| StoreError::io(&path, "make the file", e))?;
        // Where open files can be removed it is gone now, even if the run is killed; elsewhere it stays
        // until the shelf is cleared.
        let _ = fs::remove_file(&path);
        Ok((file, path))
    }
}

#[cfg(unix)]
fn free_bytes(folder: &Path) -> Option<u64> {
    let disk = rustix::fs::statvfs(folder).ok()?;
    disk.f_bavail.checked_mul(disk.f_frsize)
}

#[cfg(not(unix))]
fn free_bytes(_: &Path) -> Option<u64> {
    None
}
