//! Columns: numbers of one kind, one behind the other in a file, addressed by element.
//!
//! Little-endian, no header: the manifest beside them says what they are and how many. Read and written at
//! positions, from any thread; never mapped, since mapped pages would count as memory that the process holds.

use super::StoreError;
use std::fs::{File, OpenOptions};
use std::marker::PhantomData;
use std::ops::Range;
use std::path::{Path, PathBuf};

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
        std::array::from_fn(|i| T::get(&from[i * T::BYTES..(i + 1) * T::BYTES]))
    }
}

/// Elements converted at a time: their bytes stay in the processor's cache.
const PIECE_BYTES: usize = 1 << 18;

/// A file of elements.
#[derive(Debug)]
pub struct Column<T> {
    file: File,
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
        let failed = |source| StoreError::file(path, "make", source);
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path).map_err(failed)?;
        file.set_len(len * T::BYTES as u64).map_err(failed)?;
        Ok(Column { file, path: path.to_owned(), len, of: PhantomData })
    }

    /// Opens a file that must hold `len` elements, for reading and writing.
    ///
    /// # Errors
    /// It cannot be opened, or has another length.
    pub fn open(path: &Path, len: u64) -> Result<Column<T>, StoreError> {
        let failed = |source| StoreError::file(path, "open", source);
        let file = OpenOptions::new().read(true).write(true).open(path).map_err(failed)?;
        let (found, expected) = (file.metadata().map_err(failed)?.len(), len * T::BYTES as u64);
        if found != expected {
            return Err(StoreError::Length { path: path.to_owned(), found, expected });
        }
        Ok(Column { file, path: path.to_owned(), len, of: PhantomData })
    }

    /// Number of elements.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Hands the elements of a range to `take`, in order.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn each(&self, range: Range<u64>, mut take: impl FnMut(T)) -> Result<(), StoreError> {
        let step = (PIECE_BYTES / T::BYTES) as u64;
        let mut bytes = vec![0; PIECE_BYTES.min((range.end.saturating_sub(range.start)) as usize * T::BYTES)];
        let mut at = range.start;
        while at < range.end {
            let n = step.min(range.end - at);
            let part = &mut bytes[..n as usize * T::BYTES];
            read_at(&self.file, part, at * T::BYTES as u64).map_err(|e| StoreError::file(&self.path, "read", e))?;
            part.chunks_exact(T::BYTES).for_each(|element| take(T::get(element)));
            at += n;
        }
        Ok(())
    }

    /// Appends the elements of a range.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn read(&self, range: Range<u64>, to: &mut Vec<T>) -> Result<(), StoreError> {
        to.reserve(range.end.saturating_sub(range.start) as usize);
        self.each(range, |element| to.push(element))
    }

    /// Writes elements from number `first` on.
    ///
    /// # Errors
    /// The file cannot be written, as on a full disk.
    pub fn write(&self, first: u64, elements: impl IntoIterator<Item = T>) -> Result<(), StoreError> {
        let mut bytes = vec![0; PIECE_BYTES / T::BYTES * T::BYTES];
        let (mut at, mut filled) = (first * T::BYTES as u64, 0);
        let write = |part: &[u8], at| write_at(&self.file, part, at).map_err(|e| self.unwritten(e));
        for element in elements {
            element.put(&mut bytes[filled..filled + T::BYTES]);
            filled += T::BYTES;
            if filled == bytes.len() {
                write(&bytes, at)?;
                (at, filled) = (at + filled as u64, 0);
            }
        }
        write(&bytes[..filled], at)
    }

    /// Waits until the disk has it.
    ///
    /// # Errors
    /// The disk says no.
    pub fn sync(&self) -> Result<(), StoreError> {
        self.file.sync_data().map_err(|e| self.unwritten(e))
    }

    fn unwritten(&self, source: std::io::Error) -> StoreError {
        StoreError::file(&self.path, "write", source)
    }
}

#[cfg(unix)]
pub(super) fn read_at(file: &File, to: &mut [u8], at: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, to, at)
}

#[cfg(unix)]
pub(super) fn write_at(file: &File, from: &[u8], at: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, from, at)
}

#[cfg(windows)]
pub(super) fn read_at(file: &File, mut to: &mut [u8], mut at: u64) -> std::io::Result<()> {
    use std::os::windows::fs::FileExt;
    while !to.is_empty() {
        let n = file.seek_read(to, at)?;
        if n == 0 {
            return Err(std::io::ErrorKind::UnexpectedEof.into());
        }
        to = &mut to[n..];
        at += n as u64;
    }
    Ok(())
}

#[cfg(windows)]
pub(super) fn write_at(file: &File, mut from: &[u8], mut at: u64) -> std::io::Result<()> {
    use std::os::windows::fs::FileExt;
    while !from.is_empty() {
        let n = file.seek_write(from, at)?;
        from = &from[n..];
        at += n as u64;
    }
    Ok(())
}
