//! Columns: numbers of one kind, one behind the other in a file, addressed by element.
//!
//! Little-endian, no header: the manifest beside them says what they are and how many. Read and written at
//! positions, from any thread; never mapped, since mapped pages would count as memory that the process holds.

use super::StoreError;
use super::positioned::Positioned;
use std::cell::RefCell;
use std::fs::OpenOptions;
use std::hash::Hasher;
use std::marker::PhantomData;
use std::ops::Range;
use std::path::{Path, PathBuf};
use twox_hash::XxHash3_64;

/// What a column may hold.
pub trait Element: Copy + Send + Sync {
    /// Bytes of one element.
    const BYTES: usize;
    /// Writes it into exactly so many bytes.
    fn put(self, to: &mut [u8]);
    /// Reads it from exactly so many bytes.
    fn get(from: &[u8]) -> Self;
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Element for $number {
            const BYTES: usize = size_of::<$number>();
            #[inline(always)]
            fn put(self, to: &mut [u8]) {
                to.copy_from_slice(&self.to_le_bytes());
            }
            #[inline(always)]
            fn get(from: &[u8]) -> Self {
                let mut bytes = [0; size_of::<$number>()];
                bytes.copy_from_slice(from);
                <$number>::from_le_bytes(bytes)
            }
        }
    )*};
}

numbers!(u8, u16, u32, u64, f32, f64);

impl<T: Element, const N: usize> Element for [T; N] {
    const BYTES: usize = N * T::BYTES;
    #[inline(always)]
    fn put(self, to: &mut [u8]) {
        for (part, element) in to.chunks_exact_mut(T::BYTES).zip(self) {
            element.put(part);
        }
    }
    #[inline(always)]
    fn get(from: &[u8]) -> Self {
        // Not by `array::from_fn`, which the compiler may leave as calls.
        let mut elements = [T::get(&from[..T::BYTES]); N];
        for (element, part) in elements.iter_mut().zip(from.chunks_exact(T::BYTES)) {
            *element = T::get(part);
        }
        elements
    }
}

/// Elements converted at a time: their bytes stay in the processor's cache.
const PIECE_BYTES: usize = 1 << 17;

/// Elements that are handed over at a time.
const SLICE: usize = 1 << 10;

thread_local! {
    /// Pieces of [`PIECE_BYTES`] that are not in use. Columns are read in many short runs, and fresh memory costs
    /// more than reading them.
    static PIECES: RefCell<Vec<Vec<u8>>> = const { RefCell::new(Vec::new()) };
}

/// [`PIECE_BYTES`] of whatever was there before; goes back when it is dropped.
#[derive(Debug)]
struct Piece(Vec<u8>);

impl Piece {
    fn new() -> Piece {
        let used = PIECES.with_borrow_mut(Vec::pop);
        Piece(used.unwrap_or_else(|| vec![0; PIECE_BYTES]))
    }
}

impl Drop for Piece {
    fn drop(&mut self) {
        let bytes = std::mem::take(&mut self.0);
        // While a thread ends there is nothing left to go back to.
        let _ = PIECES.try_with(|pieces| pieces.borrow_mut().push(bytes));
    }
}

/// A file of elements.
#[derive(Debug)]
pub struct Column<T> {
    file: Positioned,
    path: PathBuf,
    len: u64,
    of: PhantomData<T>,
}

impl<T: Element> Column<T> {
    /// Makes the file, replacing one that is there. Elements that are not written are zero bytes.
    ///
    /// # Errors
    /// The file cannot be made, or not in this length.
    pub fn create(path: &Path, len: u64) -> Result<Column<T>, StoreError> {
        let failed = |source| StoreError::io(path, "make the column", source);
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path).map_err(failed)?;
        file.set_len(len * T::BYTES as u64).map_err(failed)?;
        Ok(Column { file: Positioned::new(file), path: path.to_owned(), len, of: PhantomData })
    }

    /// Opens a file that must hold `len` elements, for reading and writing.
    ///
    /// # Errors
    /// It cannot be opened, or has another length.
    pub fn open(path: &Path, len: u64) -> Result<Column<T>, StoreError> {
        let failed = |source| StoreError::io(path, "open the column", source);
        let file = OpenOptions::new().read(true).write(true).open(path).map_err(failed)?;
        let (found, expected) = (file.metadata().map_err(failed)?.len(), len * T::BYTES as u64);
        if found != expected {
            let (path, element_bytes) = (path.to_owned(), T::BYTES);
            return Err(StoreError::ColumnLength { path, elements: len, element_bytes, expected, found });
        }
        Ok(Column { file: Positioned::new(file), path: path.to_owned(), len, of: PhantomData })
    }

    /// Number of elements.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Hands the elements of a range, converted, to `take`, in order, some at a time.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn each_slice<U>(
        &self,
        range: Range<u64>,
        convert: impl Fn(T) -> U,
        mut take: impl FnMut(&[U]),
    ) -> Result<(), StoreError> {
        let n = range.end.saturating_sub(range.start) as usize;
        let mut slice = Vec::with_capacity(n.min(SLICE));
        self.each_piece(range, |bytes| {
            for some in bytes.chunks(SLICE * T::BYTES) {
                slice.clear();
                slice.extend(some.chunks_exact(T::BYTES).map(|element| convert(T::get(element))));
                take(&slice);
            }
        })
    }

    /// Appends the elements of a range.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn read(&self, range: Range<u64>, to: &mut Vec<T>) -> Result<(), StoreError> {
        to.reserve(range.end.saturating_sub(range.start) as usize);
        self.each_piece(range, |bytes| to.extend(bytes.chunks_exact(T::BYTES).map(T::get)))
    }

    /// Fills a slice with the elements from number `first` on.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn read_into(&self, first: u64, to: &mut [T]) -> Result<(), StoreError> {
        let mut rest = to.iter_mut();
        self.each_piece(first..first + rest.len() as u64, |bytes| {
            bytes.chunks_exact(T::BYTES).zip(&mut rest).for_each(|(bytes, to)| *to = T::get(bytes));
        })
    }

    fn each_piece(&self, range: Range<u64>, mut take: impl FnMut(&[u8])) -> Result<(), StoreError> {
        let step = (PIECE_BYTES / T::BYTES) as u64;
        let mut piece = Piece::new();
        let mut at = range.start;
        while at < range.end {
            let n = step.min(range.end - at);
            let part = &mut piece.0[..n as usize * T::BYTES];
            self.read_bytes(part, at * T::BYTES as u64)?;
            take(part);
            at += n;
        }
        Ok(())
    }

    fn read_bytes(&self, bytes: &mut [u8], at: u64) -> Result<(), StoreError> {
        self.file.read_exact_at(bytes, at).map_err(|e| StoreError::io(&self.path, "read the column", e))
    }

    /// Writes elements from number `first` on.
    ///
    /// # Errors
    /// The file cannot be written, as on a full disk.
    pub fn write(&self, first: u64, elements: impl IntoIterator<Item = T>) -> Result<(), StoreError> {
        let mut writer = self.writer(first);
        elements.into_iter().try_for_each(|element| writer.put(element))?;
        writer.finish().map(|_| ())
    }

    /// A writer of elements from number `first` on.
    pub fn writer(&self, first: u64) -> ColumnWriter<'_, T> {
        ColumnWriter {
            column: self,
            piece: Piece::new(),
            filled: 0,
            at: first * T::BYTES as u64,
            hash: XxHash3_64::new(),
        }
    }

    /// XXH3-64 of the bytes of a range, which must be within the column.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn checksum(&self, range: Range<u64>) -> Result<u64, StoreError> {
        let (mut hash, mut at, end) = (XxHash3_64::new(), range.start * T::BYTES as u64, range.end * T::BYTES as u64);
        let mut piece = Piece::new();
        while at < end {
            let part = &mut piece.0[..(end - at).min(PIECE_BYTES as u64) as usize];
            self.read_bytes(part, at)?;
            hash.write(part);
            at += part.len() as u64;
        }
        Ok(hash.finish())
    }

    /// Waits until the disk has it.
    ///
    /// # Errors
    /// The disk says no.
    pub fn sync(&self) -> Result<(), StoreError> {
        self.file.file().sync_data().map_err(|e| self.unwritten(e))
    }

    fn unwritten(&self, source: std::io::Error) -> StoreError {
        StoreError::io(&self.path, "write the column", source)
    }
}

/// Writes elements one behind the other.
pub struct ColumnWriter<'a, T> {
    column: &'a Column<T>,
    piece: Piece,
    filled: usize,
    at: u64,
    hash: XxHash3_64,
}

impl<T: Element> ColumnWriter<'_, T> {
    /// Puts the next element.
    ///
    /// # Errors
    /// The file cannot be written, as on a full disk.
    #[inline]
    pub fn put(&mut self, element: T) -> Result<(), StoreError> {
        if self.filled + T::BYTES > PIECE_BYTES {
            self.write()?;
        }
        element.put(&mut self.piece.0[self.filled..self.filled + T::BYTES]);
        self.filled += T::BYTES;
        Ok(())
    }

    /// Writes what is left, and returns the XXH3-64 of all that was put.
    ///
    /// # Errors
    /// The file cannot be written, as on a full disk.
    pub fn finish(mut self) -> Result<u64, StoreError> {
        self.write()?;
        Ok(self.hash.finish())
    }

    fn write(&mut self) -> Result<(), StoreError> {
        let (column, bytes) = (self.column, &self.piece.0[..self.filled]);
        self.hash.write(bytes);
        column.file.write_all_at(bytes, self.at).map_err(|e| column.unwritten(e))?;
        (self.at, self.filled) = (self.at + self.filled as u64, 0);
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use std::fs::File;

    #[test]
    fn elements_come_back_from_where_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("column");
        let column = Column::<[f64; 3]>::create(&path, 100_000).unwrap();
        let element = |i: u64| [i as f64, -1.0 / i as f64, f64::MIN_POSITIVE * i as f64];
        column.write(50_000, (50_000..100_000).map(element)).unwrap();
        column.write(10, (10..50_000).map(element)).unwrap();
        let column = Column::<[f64; 3]>::open(&path, 100_000).unwrap();
        let mut found = Vec::new();
        column.read(5..99_990, &mut found).unwrap();
        assert_eq!(found[..5], [[0.0; 3]; 5]);
        assert!(found[5..].iter().zip(10..).all(|(&f, i)| f == element(i)));
        let mut slice = vec![[0.0; 3]; 40_000];
        column.read_into(20_000, &mut slice).unwrap();
        assert!(slice.iter().zip(20_000..).all(|(&f, i)| f == element(i)));
        assert!(column.read(99_999..100_001, &mut found).is_err());
    }

    #[test]
    fn a_writer_knows_the_checksum_of_what_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let column = Column::<[u32; 3]>::create(&folder.path().join("column"), 90_000).unwrap();
        let mut writer = column.writer(5);
        (0..80_000u32).for_each(|i| writer.put([i, i.wrapping_mul(i), 7]).unwrap());
        let checksum = writer.finish().unwrap();
        assert_eq!(column.checksum(5..80_005).unwrap(), checksum);
        assert_ne!(column.checksum(6..80_006).unwrap(), checksum);
        column.write(79_000, [[1, 2, 3]]).unwrap();
        assert_ne!(column.checksum(5..80_005).unwrap(), checksum);
    }

    #[test]
    fn a_column_of_another_length_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("column");
        Column::<u32>::create(&path, 7).unwrap();
        let error = Column::<u32>::open(&path, 8).unwrap_err().to_string();
        assert!(error.contains("has 28 bytes") && error.contains("32"), "{error}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_named_as_such() {
        let full = File::options().read(true).write(true).open("/dev/full").unwrap();
        let column = Column::<u64> { file: Positioned::new(full), path: "/dev/full".into(), len: 9, of: PhantomData };
        let error = column.write(0, 0..9).unwrap_err();
        assert!(matches!(error, StoreError::Full { .. }), "{error}");
    }
}
