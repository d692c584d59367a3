//! Scattering: records sorted into buckets, a bucket at a time in memory afterwards.
//!
//! Blocks of records stay in memory as long as there is room, and go to disk from then on.

use super::positioned::Positioned;
use super::{Element, Shelf, StoreError};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Bytes that a writer gathers for a bucket before it hands them on: fewer where there are many buckets.
const BLOCK_BYTES: usize = 64 << 10;
/// Part of the room that all writers together may take while they gather.
const WRITERS_SHARE: u64 = 4;
/// Bytes of a block, at least: the disk should not have to look for much less.
const LEAST_BLOCK_BYTES: usize = 2 << 10;

/// Buckets of records. What does not stay in memory is in one scratch file, which goes when this goes.
#[derive(Debug)]
pub struct Scatter<R> {
    file: Positioned,
    path: PathBuf,
    end: AtomicU64,
    /// Bytes that may still stay in memory.
    room: AtomicU64,
    block_records: usize,
    buckets: Vec<Mutex<Vec<Block<R>>>>,
}

#[derive(Debug)]
enum Block<R> {
    InMemory(Vec<R>),
    OnDisk { at: u64, records: usize },
}

/// What one thread scatters.
#[derive(Debug)]
pub struct ScatterWriter<'a, R> {
    of: &'a Scatter<R>,
    gathered: Vec<Vec<R>>,
    bytes: Vec<u8>,
}

impl<R: Element> Scatter<R> {
    /// Empty buckets, which keep about `room` bytes in memory.
    ///
    /// # Errors
    /// The scratch file cannot be made.
    pub fn new(shelf: &Shelf, name: &str, buckets: usize, room: u64) -> Result<Scatter<R>, StoreError> {
        let (file, path) = shelf.scratch(name)?;
        let of_writer = room / WRITERS_SHARE / rayon::current_num_threads() as u64;
        let block = (of_writer as usize / buckets.max(1)).clamp(LEAST_BLOCK_BYTES, BLOCK_BYTES);
        Ok(Scatter {
            file: Positioned::new(file),
            path,
            end: AtomicU64::new(0),
            room: AtomicU64::new(room - room / WRITERS_SHARE),
            block_records: (block / size_of::<R>()).max(1),
            buckets: (0..buckets).map(|_| Mutex::default()).collect(),
        })
    }

    /// A writer for one thread. What it has gathered is handed on by [`ScatterWriter::finish`].
    pub fn writer(&self) -> ScatterWriter<'_, R> {
        let gathered = (0..self.buckets.len()).map(|_| Vec::new()).collect();
        ScatterWriter { of: self, gathered, bytes: Vec::new() }
    }

    /// Takes all records out of a bucket, in blocks, in no particular order.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn take(&self, bucket: usize) -> Result<Vec<Vec<R>>, StoreError> {
        let blocks = std::mem::take(&mut *self.buckets[bucket].lock().unwrap_or_else(PoisonError::into_inner));
        let mut bytes = Vec::new();
        let records = |block| match block {
            Block::InMemory(records) => Ok(records),
            Block::OnDisk { at, records } => {
                bytes.resize(records * R::BYTES, 0);
                self.file
                    .read_exact_at(&mut bytes, at)
                    .map_err(|e| StoreError::io(&self.path, "read what was sorted", e))?;
                Ok(bytes.chunks_exact(R::BYTES).map(R::get).collect())
            }
        };
        blocks.into_iter().map(records).collect()
    }
}

impl<R: Element> ScatterWriter<'_, R> {
    /// Puts a record into a bucket.
    ///
    /// # Errors
    /// The file cannot be written, as on a full disk.
    #[inline]
    pub fn put(&mut self, bucket: usize, record: R) -> Result<(), StoreError> {
        if self.gathered[bucket].len() == self.gathered[bucket].capacity() {
            self.make_room(bucket)?;
        }
        self.gathered[bucket].push(record);
        Ok(())
    }

    /// Hands on what is left.
    ///
    /// # Errors
    /// The file cannot be written, as on a full disk.
    pub fn finish(mut self) -> Result<(), StoreError> {
        (0..self.gathered.len()).try_for_each(|bucket| self.hand_on(bucket))
    }

    #[cold]
    fn make_room(&mut self, bucket: usize) -> Result<(), StoreError> {
        self.hand_on(bucket)?;
        if self.gathered[bucket].capacity() == 0 {
            self.gathered[bucket] = Vec::with_capacity(self.of.block_records);
        }
        Ok(())
    }

    /// Leaves nothing gathered for the bucket.
    fn hand_on(&mut self, bucket: usize) -> Result<(), StoreError> {
        let of = self.of;
        let gathered = &mut self.gathered[bucket];
        if gathered.is_empty() {
            return Ok(());
        }
        let taken = (gathered.capacity() * size_of::<R>()) as u64;
        let left = |room: u64| room.checked_sub(taken);
        let block = if of.room.fetch_update(Ordering::Relaxed, Ordering::Relaxed, left).is_ok() {
            Block::InMemory(std::mem::take(gathered))
        } else {
            self.bytes.resize(gathered.len() * R::BYTES, 0);
            for (to, &record) in self.bytes.chunks_exact_mut(R::BYTES).zip(gathered.iter()) {
                record.put(to);
            }
            let at = of.end.fetch_add(self.bytes.len() as u64, Ordering::Relaxed);
            of.file.write_all_at(&self.bytes, at).map_err(|e| StoreError::io(&of.path, "write what is sorted", e))?;
            let records = gathered.len();
            gathered.clear();
            Block::OnDisk { at, records }
        };
        of.buckets[bucket].lock().unwrap_or_else(PoisonError::into_inner).push(block);
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn records_come_back_from_memory_and_from_disk() {
        let folder = tempfile::tempdir().unwrap();
        let shelf = Shelf::new(folder.path()).unwrap();
        for room in [0, 300 << 10, u64::MAX] {
            let scatter = Scatter::<[u32; 3]>::new(&shelf, "records", 3, room).unwrap();
            std::thread::scope(|scope| {
                for thread in 0..2u32 {
                    let mut writer = scatter.writer();
                    scope.spawn(move || {
                        for i in 0..50_000u32 {
                            writer.put((i % 3) as usize, [i, thread, i ^ 7]).unwrap();
                        }
                        writer.finish().unwrap();
                    });
                }
            });
            assert_eq!(scatter.end.load(Ordering::Relaxed) > 0, room < u64::MAX);
            assert_eq!(scatter.room.load(Ordering::Relaxed) < room, room > 0);
            for bucket in 0..3u32 {
                let mut found = scatter.take(bucket as usize).unwrap().concat();
                found.sort_unstable();
                let all = (bucket..50_000).step_by(3).flat_map(|i| [[i, 0, i ^ 7], [i, 1, i ^ 7]]);
                assert!(found.iter().copied().eq(all), "bucket {bucket} with room for {room} bytes");
            }
        }
    }
}
