//! What a run keeps on disk while it works: files that a crash at any moment leaves readable.
//!
//! [`Ledger`] collects records one after the other, [`write_atomically`] replaces a small file as a whole,
//! [`ColumnFile`] holds numbers that are addressed by element. None of them knows what the bytes mean.
//! `ARCHITECTURE.md` has the formats.

mod atomic_file;
mod column;
mod element;
mod error;
mod fail_point;
mod ledger;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod ledger_damage;
mod ledger_format;
mod positioned;

pub use atomic_file::{PARTIAL, sync_folder, write_atomically};
pub use column::ColumnFile;
pub use element::Element;
pub use error::StoreError;
pub use fail_point::{FAIL_POINTS, KILL_AT, fail_point};
pub use ledger::{Ledger, Record};
pub use ledger_format::Entry;
