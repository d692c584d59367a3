//! Measuring: one whole segment becomes a [`Grain`].

pub mod attitude;
mod grain;
pub mod shape;

pub use grain::{Grain, Polygon};
