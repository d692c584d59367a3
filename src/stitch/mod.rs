//! Stitching: what the tiles published becomes one catalogue, the same whatever the tiles were.

mod catalogue;

pub use catalogue::{Catalogue, NumberedGrain, Oversize, TileReport};
