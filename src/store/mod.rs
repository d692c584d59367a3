//! What a run keeps on disk while it works: files that a crash at any moment leaves readable.
//!
//! [`Ledger`] collects records one after the other, [`write_atomically`] replaces a small file as a whole,
//! [`Column`] holds numbers that are addressed by element, [`Scatter`] sorts records that memory does not hold.
//! None of them knows what the bytes mean. `ARCHITECTURE.md` has the formats.

mod atomic_file;
mod column;
mod error;
mod fail_point;
mod ledger;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod ledger_damage;
mod ledger_format;
mod positioned;
mod scatter;
mod shelf;

pub use atomic_file::{PARTIAL, sync_folder, write_atomically};
pub use column::{Column, ColumnWriter, Element};
pub use error::StoreError;
pub use fail_point::{FAIL_POINTS, KILL_AT, PANIC_AT, fail_point, panic_point};
pub use ledger::{Ledger, Record};
pub use ledger_format::Entry;
pub use scatter::{Scatter, ScatterWriter};
pub use shelf::Shelf;
