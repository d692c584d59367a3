//! Counting bytes for whoever watches.

use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes done of a known total, told to a callback from any thread.
pub(super) struct Progress<'a> {
    done: AtomicU64,
    total: u64,
    tell: &'a (dyn Fn(u64, u64) + Sync),
}

impl<'a> Progress<'a> {
    /// Nothing done of `total` bytes.
    pub(super) fn new(total: u64, tell: &'a (dyn Fn(u64, u64) + Sync)) -> Progress<'a> {
        Progress { done: AtomicU64::new(0), total, tell }
    }

    /// Adds bytes that were read. Malformed files may be read twice in part, hence the cap.
    pub(super) fn add(&self, bytes: u64) {
        let done = self.done.fetch_add(bytes, Ordering::Relaxed) + bytes;
        (self.tell)(done.min(self.total), self.total);
    }

    /// Sets the count, at the end of a file.
    pub(super) fn reach(&self, bytes: u64) {
        self.done.store(bytes, Ordering::Relaxed);
        (self.tell)(bytes.min(self.total), self.total);
    }
}
