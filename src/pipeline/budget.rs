//! The memory budget: jobs reserve their bytes before they load anything.

use super::control::{Control, Interrupted};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Bytes that jobs in flight may take together.
#[derive(Clone)]
pub struct Budget {
    shared: Arc<Shared>,
}

struct Shared {
    total: u64,
    /// Largest reservation of one job.
    most: u64,
    used: Mutex<u64>,
    freed: Condvar,
}

/// Bytes held until dropped.
pub struct Reservation {
    shared: Arc<Shared>,
    bytes: u64,
}

impl Budget {
    /// A budget of some bytes. A job that needs more is worked alone.
    pub fn new(total: u64) -> Budget {
        Budget::limited(total, u64::MAX)
    }

    /// A budget of some bytes, in which no job may grow above all of them.
    pub fn strict(total: u64) -> Budget {
        Budget::limited(total, total)
    }

    fn limited(total: u64, most: u64) -> Budget {
        Budget { shared: Arc::new(Shared { total, most, used: Mutex::new(0), freed: Condvar::new() }) }
    }

    /// All of it, bytes.
    pub fn total_bytes(&self) -> u64 {
        self.shared.total
    }

    /// Waits until the bytes are free and takes them. A job larger than the whole budget waits until it
    /// is alone.
    ///
    /// # Errors
    /// [`Interrupted`] when the run is cancelled meanwhile.
    pub fn reserve(&self, bytes: u64, control: &Control) -> Result<Reservation, Interrupted> {
        let mut used = self.shared.used.lock().unwrap_or_else(PoisonError::into_inner);
        while *used > 0 && *used + bytes > self.shared.total {
            control.check()?;
            let waited = self.shared.freed.wait_timeout(used, Duration::from_millis(100));
            used = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        control.check()?;
        *used += bytes;
        Ok(Reservation { shared: Arc::clone(&self.shared), bytes })
    }
}

impl Reservation {
    /// Changes the reservation to `bytes` without waiting: a job that widened must go on. Others wait the longer.
    ///
    /// # Errors
    /// [`OverBudget`] when a strict budget does not hold so much at all.
    pub fn change_to(&mut self, bytes: u64) -> Result<(), OverBudget> {
        if bytes > self.shared.most {
            return Err(OverBudget { needed: bytes, total: self.shared.total });
        }
        let mut used = self.shared.used.lock().unwrap_or_else(PoisonError::into_inner);
        *used = *used - self.bytes + bytes;
        self.bytes = bytes;
        drop(used);
        self.shared.freed.notify_all();
        Ok(())
    }
}

/// One job alone needs more than the whole budget.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("needs {} MiB, but the memory for tiles is {} MiB", needed >> 20, total >> 20)]
pub struct OverBudget {
    /// What it needs, bytes.
    pub needed: u64,
    /// The budget, bytes.
    pub total: u64,
}

impl Drop for Reservation {
    fn drop(&mut self) {
        *self.shared.used.lock().unwrap_or_else(PoisonError::into_inner) -= self.bytes;
        self.shared.freed.notify_all();
    }
}
