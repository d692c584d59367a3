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
    used: Mutex<u64>,
    freed: Condvar,
}

/// Bytes held until dropped.
pub struct Reservation {
    shared: Arc<Shared>,
    bytes: u64,
}

impl Budget {
    /// A budget of some bytes.
    pub fn new(total: u64) -> Budget {
        Budget { shared: Arc::new(Shared { total, used: Mutex::new(0), freed: Condvar::new() }) }
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
    /// Raises the reservation to `bytes` without waiting: a job that widened has its data already. The
    /// loader waits the longer for it.
    pub fn grow_to(&mut self, bytes: u64) {
        let more = bytes.saturating_sub(self.bytes);
        *self.shared.used.lock().unwrap_or_else(PoisonError::into_inner) += more;
        self.bytes += more;
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        *self.shared.used.lock().unwrap_or_else(PoisonError::into_inner) -= self.bytes;
        self.shared.freed.notify_all();
    }
}
