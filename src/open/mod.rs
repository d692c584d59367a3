//! Opening a survey: files become arrays in one frame. Knows formats and georeferencing, nothing else.

mod frame;
mod surface;

pub use frame::{Crs, Frame};
pub use surface::{MemorySurface, Surface};
