//! Opening a survey: files become arrays in one frame. Knows formats and georeferencing, nothing else.

mod frame;

pub use frame::{Crs, Frame};
