//! A file that only grows: records under keys, each written once, none lost by a crash but the last ones.
//!
//! A record is whole or it is not there: its checksum tells. So a crash needs no repair but to cut off what
//! follows the last whole record, and flushing to the disk is only a matter of how much work is done again.

use super::StoreError;
use super::atomic_file::write_atomically;
use super::fail_point::fail_point;
use super::ledger_format::{self as format, Entry, Header};
use super::positioned::Positioned;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// An append flushes to the disk when the last time was this long ago.
const SYNC_EVERY: Duration = Duration::from_secs(4);
/// Buffer for reading through a ledger, bytes.
const BUFFER_BYTES: usize = 1 << 18;

/// An open ledger. While it is held, no other process can open it.
#[derive(Debug)]
pub struct Ledger {
    path: PathBuf,
    file: Positioned,
    /// Where the next record goes.
    end: u64,
    positions: BTreeMap<u64, u64>,
    cut_bytes: u64,
    synced_at: Instant,
    unsynced: bool,
}

/// What a ledger says under one key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Record {
    /// What the record is about.
    pub key: u64,
    /// What it says.
    pub payload: Vec<u8>,
}

impl Ledger {
    /// Opens the ledger at `path`, or makes an empty one, and lists its records in the order in which they
    /// were written. `identity` says what they belong to; it must be the same text every time. Where a key
    /// has several records, the first counts and the others are not listed.
    ///
    /// Bytes after the last whole record are cut off, and so is everything after a record that does not fit
    /// its checksum; [`Ledger::cut_bytes`] tells how much. Payloads are proved but not kept in memory.
    ///
    /// # Errors
    /// The file is no ledger, or of another identity or format, or its header is damaged, or another process
    /// holds it, or it cannot be read, written or made.
    pub fn open(path: &Path, identity: &str) -> Result<(Ledger, Vec<Entry>), StoreError> {
        let failed = |action| move |source| StoreError::io(path, action, source);
        let file = open_or_make(path, identity)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(StoreError::Busy { path: path.to_owned() }),
            // A file system without locks: nothing can be told.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        let file_bytes = file.metadata().map_err(failed("ask for the size of the record file"))?.len();
        let mut input = BufReader::with_capacity(BUFFER_BYTES, &file);
        let header = format::read_header(&mut input, file_bytes).map_err(failed("read the record file"))?;
        let mut end = check(path, header, identity)?;
        let (mut entries, mut positions) = (Vec::new(), BTreeMap::new());
        while let Some(entry) =
            format::scan_record(&mut input, end, file_bytes).map_err(failed("read the record file"))?
        {
            end += format::FRAME_BYTES + entry.payload_bytes;
            if let std::collections::btree_map::Entry::Vacant(place) = positions.entry(entry.key) {
                place.insert(entry.position);
                entries.push(entry);
            }
        }
        let cut_bytes = file_bytes - end;
        if cut_bytes > 0 {
            file.set_len(end).map_err(failed("cut off the unfinished end of the record file"))?;
        }
        let (path, file) = (path.to_owned(), Positioned::new(file));
        let synced_at = Instant::now();
        Ok((Ledger { path, file, end, positions, cut_bytes, synced_at, unsynced: cut_bytes > 0 }, entries))
    }

    /// Adds a record and returns where it begins. A key is written once: for one that is there already,
    /// nothing is written and the place of the first record is returned.
    ///
    /// The record survives the end of the process at once. It survives a power cut after [`Ledger::sync`],
    /// which an append calls when the last time was some seconds ago.
    ///
    /// # Errors
    /// The file cannot be written, or the disk is full; the records before are intact, and the same record
    /// can be appended again.
    pub fn append(&mut self, key: u64, payload: &[u8]) -> Result<u64, StoreError> {
        if let Some(&position) = self.positions.get(&key) {
            return Ok(position);
        }
        let position = self.end;
        let record = format::record(key, payload, position);
        fail_point("ledger.before_write");
        self.file.write_all_at(&record, position).map_err(|source| {
            // The next opening would cut off half a record; without it, others have more room.
            let _ = self.file.file().set_len(position);
            StoreError::io(&self.path, "append a record", source)
        })?;
        fail_point("ledger.after_write");
        self.end += record.len() as u64;
        self.positions.insert(key, position);
        self.unsynced = true;
        if self.synced_at.elapsed() >= SYNC_EVERY {
            self.sync()?;
        }
        Ok(position)
    }

    /// Flushes all records to the disk.
    ///
    /// # Errors
    /// The disk refuses; which of the records since the last time are safe is then unknown.
    pub fn sync(&mut self) -> Result<(), StoreError> {
        if self.unsynced {
            let synced = self.file.file().sync_data();
            synced.map_err(|source| StoreError::io(&self.path, "flush the records to the disk", source))?;
            fail_point("ledger.after_sync");
            self.unsynced = false;
        }
        self.synced_at = Instant::now();
        Ok(())
    }

    /// Reads the record that begins at `position`, from the disk; several threads may do so at once.
    ///
    /// # Errors
    /// No record begins there, or it does not fit its checksum any more, or the file cannot be read.
    pub fn read(&self, position: u64) -> Result<Record, StoreError> {
        let failed = |source| StoreError::io(&self.path, "read a record", source);
        let damaged = || StoreError::DamagedRecord { path: self.path.clone(), position };
        // What lies beyond the end is no record of this ledger, so a false length cannot ask for more.
        let most = self.end.saturating_sub(position).checked_sub(format::FRAME_BYTES).ok_or_else(damaged)?;
        let mut head = [0; format::HEAD_BYTES as usize];
        self.file.read_exact_at(&mut head, position).map_err(failed)?;
        let (key, payload_bytes) = format::key_and_length(&head);
        if payload_bytes > most {
            return Err(damaged());
        }
        let mut payload = vec![0; payload_bytes as usize];
        self.file.read_exact_at(&mut payload, position + format::HEAD_BYTES).map_err(failed)?;
        let mut checksum = [0; 8];
        self.file.read_exact_at(&mut checksum, position + format::HEAD_BYTES + payload_bytes).map_err(failed)?;
        if u64::from_le_bytes(checksum) != format::checksum(&head, &payload, position) {
            return Err(damaged());
        }
        Ok(Record { key, payload })
    }

    /// Where the record of a key begins.
    pub fn position(&self, key: u64) -> Option<u64> {
        self.positions.get(&key).copied()
    }

    /// Number of records.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no record.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Bytes that were cut off when the ledger was opened: what a crash left of a record, or damage.
    pub fn cut_bytes(&self) -> u64 {
        self.cut_bytes
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

fn open_or_make(path: &Path, identity: &str) -> Result<File, StoreError> {
    let open = || OpenOptions::new().read(true).write(true).open(path);
    match open() {
        Err(source) if source.kind() == io::ErrorKind::NotFound => {
            // A ledger never has half a header: it gets its name with a whole one.
            write_atomically(path, &format::header(identity))?;
            open()
        }
        opened => opened,
    }
    .map_err(|source| StoreError::io(path, "open the record file", source))
}

/// Length of a header that belongs to `identity`, bytes.
fn check(path: &Path, header: Header, identity: &str) -> Result<u64, StoreError> {
    let path = path.to_owned();
    match header {
        Header::Whole { identity: recorded, bytes } if recorded == identity => Ok(bytes),
        Header::Whole { identity: recorded, .. } => {
            Err(StoreError::OtherIdentity { path, recorded, wanted: identity.to_owned() })
        }
        Header::Foreign => Err(StoreError::NotALedger { path }),
        Header::OtherFormat(found) => Err(StoreError::Format { path, found, known: format::FORMAT }),
        Header::Damaged => Err(StoreError::DamagedHeader { path }),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
pub(super) mod tests {
    use super::*;
    use std::fs;

    pub(in crate::store) const IDENTITY: &str = "{\"input\": \"a bed\"}";
    pub(in crate::store) const RECORDS: [(u64, &[u8]); 4] =
        [(7, b"first"), (u64::MAX, b""), (0, &[0; 40]), (8, b"the last of them")];

    pub(in crate::store) fn place() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tiles.ledger");
        (folder, path)
    }

    pub(in crate::store) fn fill(path: &Path) -> Vec<u64> {
        let (mut ledger, before) = Ledger::open(path, IDENTITY).unwrap();
        assert!(before.is_empty() && ledger.is_empty());
        RECORDS.iter().map(|(key, payload)| ledger.append(*key, payload).unwrap()).collect()
    }

    pub(in crate::store) fn contents(path: &Path) -> (Vec<Record>, u64) {
        let (ledger, entries) = Ledger::open(path, IDENTITY).unwrap();
        assert_eq!(ledger.len(), entries.len());
        let records = entries.iter().map(|e| ledger.read(e.position).unwrap()).collect();
        (records, ledger.cut_bytes())
    }

    pub(in crate::store) fn first(n: usize) -> Vec<Record> {
        RECORDS[..n].iter().map(|&(key, payload)| Record { key, payload: payload.to_vec() }).collect()
    }

    #[test]
    fn records_come_back_in_their_order_and_by_their_keys() {
        let (_folder, path) = place();
        let positions = fill(&path);
        assert_eq!(contents(&path), (first(4), 0));
        let (ledger, entries) = Ledger::open(&path, IDENTITY).unwrap();
        assert_eq!(entries.iter().map(|e| e.position).collect::<Vec<_>>(), positions);
        for (entry, (key, payload)) in entries.iter().zip(RECORDS) {
            assert_eq!((entry.key, entry.payload_bytes), (key, payload.len() as u64));
            assert_eq!(ledger.position(key), Some(entry.position));
        }
        assert_eq!(ledger.position(5), None);
    }

    #[test]
    fn a_key_is_written_once() {
        let (_folder, path) = place();
        let positions = fill(&path);
        let (mut ledger, _) = Ledger::open(&path, IDENTITY).unwrap();
        let bytes = fs::metadata(&path).unwrap().len();
        assert_eq!(ledger.append(0, b"something else").unwrap(), positions[2]);
        assert_eq!(fs::metadata(&path).unwrap().len(), bytes);
        drop(ledger);
        // A file in which a key stands twice all the same.
        let mut file = fs::read(&path).unwrap();
        file.extend(format::record(7, b"second", bytes));
        file.extend(format::record(9, b"new", file.len() as u64));
        fs::write(&path, file).unwrap();
        let (records, cut_bytes) = contents(&path);
        assert_eq!(records[..4], first(4));
        assert_eq!(records[4..], [Record { key: 9, payload: b"new".to_vec() }]);
        assert_eq!(cut_bytes, 0);
    }

    #[test]
    fn a_ledger_is_held_by_one_at_a_time() {
        let (_folder, path) = place();
        let (held, _) = Ledger::open(&path, IDENTITY).unwrap();
        assert!(matches!(Ledger::open(&path, IDENTITY), Err(StoreError::Busy { .. })));
        drop(held);
        Ledger::open(&path, IDENTITY).unwrap();
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_called_so_and_the_record_is_not_there() {
        let (_folder, path) = place();
        fill(&path);
        let (mut ledger, _) = Ledger::open(&path, IDENTITY).unwrap();
        let full = OpenOptions::new().read(true).write(true).open("/dev/full").unwrap();
        let disk = std::mem::replace(&mut ledger.file, Positioned::new(full));
        let error = ledger.append(50, b"too much").unwrap_err();
        assert!(matches!(error, StoreError::Full { .. }), "{error}");
        assert_eq!(ledger.position(50), None);
        ledger.file = disk;
        ledger.append(50, b"room again").unwrap();
        ledger.sync().unwrap();
        drop(ledger);
        assert_eq!(contents(&path).0[4], Record { key: 50, payload: b"room again".to_vec() });
    }
}
