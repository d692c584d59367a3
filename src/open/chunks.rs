//! Sequential passes over a survey, a chunk at a time, on all threads of the pool.

use super::Surface;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Elements of a chunk: enough to hide its cost, few enough to share out.
const CHUNK: u64 = 1 << 15;
/// Elements that are read at a time: they stay in the processor's cache.
const PIECE: u64 = 1 << 11;
/// Chunks between two releases of the survey's pages: some tens of megabytes.
const RELEASE: u64 = 32;

/// Hands 0..`n` to `work` in chunks. Every thread makes its own state with `start`.
///
/// Chunks come in no particular order, so `work` must not care. What was read of the surface is let go as
/// the pass goes on, but for what the next pass may read first.
pub(crate) fn over_chunks<S, E: Send>(
    surface: &dyn Surface,
    n: u64,
    start: impl Fn() -> Result<S, E> + Sync,
    work: impl Fn(&mut S, Range<u64>) -> Result<(), E> + Sync,
) -> Result<(), E> {
    over_chunks_then(surface, n, start, work, |_| Ok(()))
}

/// [`over_chunks`], with an `end` for the state of each thread.
pub(crate) fn over_chunks_then<S, E: Send>(
    surface: &dyn Surface,
    n: u64,
    start: impl Fn() -> Result<S, E> + Sync,
    work: impl Fn(&mut S, Range<u64>) -> Result<(), E> + Sync,
    end: impl Fn(S) -> Result<(), E> + Sync,
) -> Result<(), E> {
    let next = AtomicU64::new(0);
    let done = rayon::broadcast(|_| {
        let mut state = start()?;
        loop {
            let chunk = next.fetch_add(1, Ordering::Relaxed);
            if chunk * CHUNK >= n {
                return end(state);
            }
            work(&mut state, chunk * CHUNK..((chunk + 1) * CHUNK).min(n))?;
            if chunk % RELEASE == RELEASE - 1 {
                surface.release();
            }
        }
    });
    done.into_iter().collect()
}

/// Cuts what a thread works into pieces that are read at a time.
pub(crate) fn pieces(range: Range<u64>) -> impl Iterator<Item = Range<u64>> {
    range.clone().step_by(PIECE as usize).map(move |first| first..(first + PIECE).min(range.end))
}
