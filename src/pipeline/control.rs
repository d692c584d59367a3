//! Whether to go on: one flag that Ctrl-C sets and every job asks.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// A cancel flag, shared by its clones.
#[derive(Debug, Clone, Default)]
pub struct Control {
    state: Arc<AtomicU8>,
}

const GOING: u8 = 0;
const CANCELLED: u8 = 1;
const COMMITTED: u8 = 2;

/// What a cancellation met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cancelled {
    /// Work, which will stop.
    Work,
    /// An earlier cancellation.
    Before,
    /// Nothing: the results are complete and are getting their names.
    TooLate,
}

/// The run was cancelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted; no result was written, but what is done is kept\nhelp: the same command with --resume goes on")]
pub struct Interrupted;

impl Control {
    /// Asks everything to stop.
    pub fn cancel(&self) -> Cancelled {
        match self.state.compare_exchange(GOING, CANCELLED, Ordering::Relaxed, Ordering::Relaxed) {
            Ok(_) => Cancelled::Work,
            Err(CANCELLED) => Cancelled::Before,
            Err(_) => Cancelled::TooLate,
        }
    }

    /// Whether to go on.
    ///
    /// # Errors
    /// [`Interrupted`] when not.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.state.load(Ordering::Relaxed) == CANCELLED { Err(Interrupted) } else { Ok(()) }
    }

    /// Says that the results are complete: from here on nothing can be cancelled, so that what is told of a
    /// cancelled run is true.
    ///
    /// # Errors
    /// [`Interrupted`] when it has been cancelled before.
    pub fn commit(&self) -> Result<(), Interrupted> {
        match self.state.compare_exchange(GOING, COMMITTED, Ordering::Relaxed, Ordering::Relaxed) {
            Err(CANCELLED) => Err(Interrupted),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_cancelled_or_committed_and_never_both() {
        let control = Control::default();
        assert_eq!(control.cancel(), Cancelled::Work);
        assert_eq!((control.cancel(), control.clone().commit()), (Cancelled::Before, Err(Interrupted)));
        let control = Control::default();
        assert_eq!(control.commit(), Ok(()));
        assert_eq!((control.cancel(), control.check()), (Cancelled::TooLate, Ok(())));
    }
}
