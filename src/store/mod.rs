//! What a run keeps on disk between its stages: columns of numbers and scratch files.

mod column;
mod error;
mod scatter;
mod shelf;

pub use column::{Column, Element};
pub use error::StoreError;
pub use scatter::{Scatter, ScatterWriter};
pub use shelf::Shelf;
