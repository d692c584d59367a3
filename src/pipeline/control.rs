//! Whether to go on: one flag that Ctrl-C sets and every job asks.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A cancel flag, shared by its clones.
#[derive(Debug, Clone, Default)]
pub struct Control {
    cancelled: Arc<AtomicBool>,
}

/// The run was cancelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted; no result was written, but what is done is kept\nhelp: the same command with --resume goes on")]
pub struct Interrupted;

impl Control {
    /// Asks everything to stop. Returns whether it had been asked before.
    pub fn cancel(&self) -> bool {
        self.cancelled.swap(true, Ordering::Relaxed)
    }

    /// Whether to go on.
    ///
    /// # Errors
    /// [`Interrupted`] when not.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.cancelled.load(Ordering::Relaxed) { Err(Interrupted) } else { Ok(()) }
    }
}
