//! Scattering: records sorted into buckets on disk, a bucket at a time in memory afterwards.

use super::positioned::Positioned;
use super::{Element, Shelf, StoreError};
use std::marker::PhantomData;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Bytes that a writer gathers for a bucket before it writes them.
const BLOCK_BYTES: usize = 64 << 10;

/// Buckets of records in one scratch file, which goes when this goes.
#[derive(Debug)]
pub struct Scatter<R> {
    file: Positioned,
    path: PathBuf,
    end: AtomicU64,
    /// Of each bucket its blocks: first byte and length.
    blocks: Vec<Mutex<Vec<(u64, usize)>>>,
    of: PhantomData<R>,
}

/// What one thread scatters.
#[derive(Debug)]
pub struct ScatterWriter<'a, R> {
    of: &'a Scatter<R>,
    buffers: Vec<Vec<u8>>,
}

impl<R: Element> Scatter<R> {
    /// Empty buckets.
    ///
    /// # Errors
    /// The scratch file cannot be made.
    pub fn new(shelf: &Shelf, name: &str, buckets: usize) -> Result<Scatter<R>, StoreError> {
        let (file, path) = shelf.scratch(name)?;
        let blocks = (0..buckets).map(|_| Mutex::default()).collect();
        Ok(Scatter { file: Positioned::new(file), path, end: AtomicU64::new(0), blocks, of: PhantomData })
    }

    /// A writer for one thread. What it has gathered is written by [`ScatterWriter::finish`].
    pub fn writer(&self) -> ScatterWriter<'_, R> {
        ScatterWriter { of: self, buffers: vec![Vec::new(); self.blocks.len()] }
    }

    /// All records of a bucket, in no particular order.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn read(&self, bucket: usize) -> Result<Vec<R>, StoreError> {
        let blocks = self.blocks[bucket].lock().unwrap_or_else(PoisonError::into_inner).clone();
        let mut records = Vec::with_capacity(blocks.iter().map(|b| b.1).sum::<usize>() / R::BYTES);
        let mut bytes = Vec::new();
        for (at, len) in blocks {
            bytes.resize(len, 0);
            self.file
                .read_exact_at(&mut bytes, at)
                .map_err(|e| StoreError::io(&self.path, "read what was sorted", e))?;
            records.extend(bytes.chunks_exact(R::BYTES).map(R::get));
        }
        Ok(records)
    }
}

impl<R: Element> ScatterWriter<'_, R> {
    /// Puts a record into a bucket.
    ///
    /// # Errors
    /// The file cannot be written, as on a full disk.
    #[inline]
    pub fn put(&mut self, bucket: usize, record: R) -> Result<(), StoreError> {
        let buffer = &mut self.buffers[bucket];
        let at = buffer.len();
        buffer.resize(at + R::BYTES, 0);
        record.put(&mut buffer[at..]);
        if buffer.len() >= BLOCK_BYTES { self.write(bucket) } else { Ok(()) }
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// The file cannot be written, as on a full disk.
    pub fn finish(mut self) -> Result<(), StoreError> {
        (0..self.buffers.len()).try_for_each(|b| if self.buffers[b].is_empty() { Ok(()) } else { self.write(b) })
    }

    fn write(&mut self, bucket: usize) -> Result<(), StoreError> {
        let of = self.of;
        let buffer = &mut self.buffers[bucket];
        let at = of.end.fetch_add(buffer.len() as u64, Ordering::Relaxed);
        of.file.write_all_at(buffer, at).map_err(|e| StoreError::io(&of.path, "write what is sorted", e))?;
        of.blocks[bucket].lock().unwrap_or_else(PoisonError::into_inner).push((at, buffer.len()));
        buffer.clear();
        Ok(())
    }
}
