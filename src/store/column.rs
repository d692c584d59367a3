//! A file of values of one width, addressed by their number.
//!
//! It has no header and no checksum: a manifest that is written afterwards, with
//! [`super::write_atomically`], says what it holds and that it is complete.

use super::positioned::Positioned;
use super::{Element, StoreError};
use std::fs::OpenOptions;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Values are converted in pieces of about this size, which stay in the processor's cache.
const PIECE_BYTES: usize = 1 << 17;

/// An open column. Several threads may read and write it at once, each its own elements.
#[derive(Debug)]
pub struct ColumnFile {
    path: PathBuf,
    file: Positioned,
    element_bytes: usize,
    elements: u64,
}

impl ColumnFile {
    /// Makes a column of zeros, in place of a file that may be there. `element_bytes` is at least 1.
    ///
    /// The disk may give its room only when the elements are written.
    ///
    /// # Errors
    /// The file cannot be made, or is longer than the file system allows.
    pub fn create(path: &Path, element_bytes: usize, elements: u64) -> Result<ColumnFile, StoreError> {
        let failed = |action| move |source| StoreError::io(path, action, source);
        let bytes = length(path, element_bytes, elements)?;
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path);
        let file = file.map_err(failed("create the column file"))?;
        file.set_len(bytes).map_err(failed("give the column file its length"))?;
        Ok(ColumnFile { path: path.to_owned(), file: Positioned::new(file), element_bytes, elements })
    }

    /// Opens a column that is there, for reading and writing.
    ///
    /// # Errors
    /// The file is not there, cannot be read and written, or has another length.
    pub fn open(path: &Path, element_bytes: usize, elements: u64) -> Result<ColumnFile, StoreError> {
        let failed = |action| move |source| StoreError::io(path, action, source);
        let expected = length(path, element_bytes, elements)?;
        let file = OpenOptions::new().read(true).write(true).open(path).map_err(failed("open the column file"))?;
        let found = file.metadata().map_err(failed("ask for the size of the column file"))?.len();
        if found != expected {
            return Err(StoreError::ColumnLength { path: path.to_owned(), elements, element_bytes, expected, found });
        }
        Ok(ColumnFile { path: path.to_owned(), file: Positioned::new(file), element_bytes, elements })
    }

    /// Replaces what is in `bytes` by the bytes of these elements.
    ///
    /// # Errors
    /// The column does not have these elements, or cannot be read.
    pub fn read_into(&self, range: Range<u64>, bytes: &mut Vec<u8>) -> Result<(), StoreError> {
        let count = self.count(&range)?;
        bytes.clear();
        bytes.resize(count * self.element_bytes, 0);
        self.read_bytes(range.start, bytes)
    }

    /// Writes whole elements, the first of them at number `first`.
    ///
    /// # Errors
    /// The column does not have these elements, `bytes` ends within one, or the disk is full or refuses.
    /// What lay in their places may then be lost.
    pub fn write_at(&self, first: u64, bytes: &[u8]) -> Result<(), StoreError> {
        let count = bytes.len() / self.element_bytes;
        if count * self.element_bytes != bytes.len() {
            return Err(self.no_whole_elements(bytes.len()));
        }
        self.count(&(first..first.saturating_add(count as u64)))?;
        let written = self.file.write_all_at(bytes, first * self.element_bytes as u64);
        written.map_err(|source| StoreError::io(&self.path, "write the column file", source))
    }

    /// Replaces what is in `values` by these elements.
    ///
    /// # Errors
    /// As [`ColumnFile::read_into`], or the elements are of another width.
    pub fn read_values<E: Element>(&self, range: Range<u64>, values: &mut Vec<E>) -> Result<(), StoreError> {
        self.check_width::<E>()?;
        let count = self.count(&range)?;
        values.clear();
        values.reserve(count);
        let piece = (PIECE_BYTES / E::BYTES).max(1);
        let mut bytes = vec![0; count.min(piece) * E::BYTES];
        for start in (0..count).step_by(piece) {
            bytes.truncate((count - start) * E::BYTES);
            self.read_bytes(range.start + start as u64, &mut bytes)?;
            E::read(&bytes, values);
        }
        Ok(())
    }

    /// Writes values, the first of them at number `first`.
    ///
    /// # Errors
    /// As [`ColumnFile::write_at`], or the elements are of another width.
    pub fn write_values<E: Element>(&self, first: u64, values: &[E]) -> Result<(), StoreError> {
        self.check_width::<E>()?;
        self.count(&(first..first.saturating_add(values.len() as u64)))?;
        let piece = (PIECE_BYTES / E::BYTES).max(1);
        let mut bytes = Vec::with_capacity(values.len().min(piece) * E::BYTES);
        for (values, start) in values.chunks(piece).zip((first..).step_by(piece)) {
            bytes.clear();
            E::write(values, &mut bytes);
            self.write_at(start, &bytes)?;
        }
        Ok(())
    }

    /// Flushes what was written to the disk.
    ///
    /// # Errors
    /// The disk is full or refuses; elements written since the last time may be lost.
    pub fn sync(&self) -> Result<(), StoreError> {
        let synced = self.file.file().sync_all();
        synced.map_err(|source| StoreError::io(&self.path, "flush the column file to the disk", source))
    }

    /// Number of elements.
    pub fn len(&self) -> u64 {
        self.elements
    }

    /// Whether there is no element.
    pub fn is_empty(&self) -> bool {
        self.elements == 0
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How many elements the range holds, all of them in the column.
    fn count(&self, range: &Range<u64>) -> Result<usize, StoreError> {
        let (first, end, elements) = (range.start, range.end, self.elements);
        match end.checked_sub(first).map(usize::try_from) {
            Some(Ok(count)) if end <= elements => Ok(count),
            _ => Err(StoreError::OutsideColumn { path: self.path.clone(), first, end, elements }),
        }
    }

    fn read_bytes(&self, first: u64, bytes: &mut [u8]) -> Result<(), StoreError> {
        let read = self.file.read_exact_at(bytes, first * self.element_bytes as u64);
        read.map_err(|source| StoreError::io(&self.path, "read the column file", source))
    }

    fn check_width<E: Element>(&self) -> Result<(), StoreError> {
        if E::BYTES == self.element_bytes { Ok(()) } else { Err(self.no_whole_elements(E::BYTES)) }
    }

    fn no_whole_elements(&self, bytes: usize) -> StoreError {
        StoreError::ElementBytes { path: self.path.clone(), element_bytes: self.element_bytes, bytes }
    }
}

/// Bytes of a column.
fn length(path: &Path, element_bytes: usize, elements: u64) -> Result<u64, StoreError> {
    elements.checked_mul(element_bytes as u64).filter(|_| element_bytes > 0).ok_or_else(|| {
        let source = io::Error::from(io::ErrorKind::FileTooLarge);
        StoreError::io(path, "give the column file its length", source)
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn column(element_bytes: usize, elements: u64) -> (tempfile::TempDir, ColumnFile) {
        let folder = tempfile::tempdir().unwrap();
        let column = ColumnFile::create(&folder.path().join("column"), element_bytes, elements).unwrap();
        (folder, column)
    }

    #[test]
    fn a_new_column_is_zeros_and_reads_back_what_is_written_after_reopening() {
        let (_folder, column) = column(3, 5);
        let mut bytes = vec![7; 100];
        column.read_into(0..5, &mut bytes).unwrap();
        assert_eq!(bytes, [0; 15]);
        column.write_at(1, &[1, 2, 3, 4, 5, 6]).unwrap();
        column.sync().unwrap();
        let again = ColumnFile::open(column.path(), 3, 5).unwrap();
        again.read_into(0..4, &mut bytes).unwrap();
        assert_eq!(bytes, [0, 0, 0, 1, 2, 3, 4, 5, 6, 0, 0, 0]);
        again.read_into(5..5, &mut bytes).unwrap();
        assert!(bytes.is_empty());
        ColumnFile::create(column.path(), 3, 5).unwrap().read_into(0..5, &mut bytes).unwrap();
        assert_eq!(bytes, [0; 15], "a column that is made again is new");
    }

    #[test]
    fn values_longer_than_a_piece_survive_at_any_place() {
        let elements = 3 * PIECE_BYTES as u64 / 24 + 17;
        let (_folder, column) = column(24, elements);
        let position = |i: u64| [i as f64, -0.5 * i as f64, 1e300 / (i as f64 + 1.0)];
        let values: Vec<[f64; 3]> = (5..elements).map(position).collect();
        column.write_values(5, &values).unwrap();
        let mut back = vec![[1.0; 3]];
        column.read_values(5..elements, &mut back).unwrap();
        assert!(back == values);
        column.read_values(elements - 2..elements, &mut back).unwrap();
        assert_eq!(back, [position(elements - 2), position(elements - 1)]);
        column.read_values(0..6, &mut back).unwrap();
        assert_eq!(back, [[0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3], position(5)]);
    }

    #[test]
    fn threads_write_and_read_their_own_elements() {
        let (_folder, column) = column(4, 4000);
        std::thread::scope(|scope| {
            for thread in 0..4u64 {
                let column = &column;
                scope.spawn(move || {
                    let mut back: Vec<u32> = Vec::new();
                    for start in (10 * thread..4000).step_by(40) {
                        let values: Vec<u32> = (start..start + 10).map(|i| i as u32 * 3).collect();
                        column.write_values(start, &values).unwrap();
                        column.read_values(start..start + 10, &mut back).unwrap();
                        assert_eq!(back, values);
                    }
                });
            }
        });
        let mut all: Vec<u32> = Vec::new();
        column.read_values(0..4000, &mut all).unwrap();
        assert!(all.iter().zip(0..).all(|(&v, i)| v == 3 * i));
    }

    #[test]
    fn a_column_of_another_length_is_refused() {
        let (_folder, column) = column(8, 10);
        for (element_bytes, elements) in [(8, 9), (8, 11), (4, 10)] {
            let error = ColumnFile::open(column.path(), element_bytes, elements).unwrap_err().to_string();
            let says = format!("has 80 bytes, but {elements} elements of {element_bytes} bytes take ");
            assert!(error.contains(&says) && error.contains("\nhelp: "), "{error}");
        }
        assert!(ColumnFile::open(&column.path().with_extension("none"), 8, 10).is_err());
        assert!(ColumnFile::create(column.path(), 8, u64::MAX / 2).is_err());
        assert!(ColumnFile::create(column.path(), 0, 3).is_err());
    }

    #[test]
    fn elements_that_are_not_there_are_neither_read_nor_written() {
        let (_folder, column) = column(2, 10);
        let (mut bytes, mut values) = (Vec::new(), Vec::<u16>::new());
        #[allow(clippy::reversed_empty_ranges)]
        for range in [0..11, 11..11, 10..11, 5..4, 0..u64::MAX, u64::MAX - 1..u64::MAX] {
            let error = column.read_into(range.clone(), &mut bytes).unwrap_err();
            assert!(matches!(error, StoreError::OutsideColumn { elements: 10, .. }), "{error}");
            assert!(column.read_values(range, &mut values).is_err());
        }
        for first in [9, 10, u64::MAX] {
            assert!(matches!(column.write_at(first, &[0; 4]), Err(StoreError::OutsideColumn { .. })));
            assert!(column.write_values(first, &[1u16, 2]).is_err());
        }
        assert!(matches!(column.write_at(0, &[0; 3]), Err(StoreError::ElementBytes { bytes: 3, .. })));
        assert!(matches!(column.write_values(0, &[1u32]), Err(StoreError::ElementBytes { bytes: 4, .. })));
        assert_eq!(std::fs::metadata(column.path()).unwrap().len(), 20);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_called_so() {
        let path = PathBuf::from("/dev/full");
        let file = Positioned::new(OpenOptions::new().write(true).open(&path).unwrap());
        let column = ColumnFile { path, file, element_bytes: 8, elements: 100 };
        let error = column.write_values(3, &[1.0, 2.0]).unwrap_err();
        assert!(matches!(error, StoreError::Full { .. }), "{error}");
        let text = error.to_string();
        assert!(text.starts_with("/dev/full: cannot write the column file, the disk is full: "), "{text}");
        assert!(text.contains("\nhelp: free some space"), "{text}");
    }
}
