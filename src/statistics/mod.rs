//! Statistics: what the catalogue says about the reach as a whole and about every cell of a raster.
//!
//! Counting every grain of an area is *area-by-number*; a Wolman count on a grid is *grid-by-number*.
//! Both are given, and every name says which it is.

mod cover;
mod grid;
pub mod percentiles;
mod raster;
mod summary;

pub use grid::{RasterError, RasterGrid, automatic_cell_m};
pub use percentiles::Sizes;
pub use raster::{Band, GrainSizeRaster, NODATA};
pub use summary::{Areas, BAxis, Summary, near_equant};
