//! Measuring: one whole segment becomes a [`Grain`].

mod grain;

pub use grain::{Grain, Polygon};
