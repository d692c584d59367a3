//! A sample scene with known pebbles, and the score of a segmentation against them.
//!
//! A patch of gravel bar is built from a seed: stones dropped on rippled sand, seen from above as a
//! photogrammetric survey sees it (overhanging flanks down to the view limit, nothing beyond), smoothed
//! and noisy as such a surface is. Every triangle knows its true stone, so that a run can be scored the
//! way the field's paper does (Rheinwalt et al. 2025): [`make_scene`], segment, [`score()`].
//!
//! ```text
//!  placement ──> bed (implicit stones and sand) ──> voxels ──> surface ──> sight ──> finish ──> Scene
//! ```
//!
//! The same seed gives the same bytes on one platform. The shapes use `powf`, `sin`, `cos` and `exp`,
//! whose last bit differs between C libraries, so that a triangle may differ between platforms.

mod bed;
mod color;
mod finish;
mod placement;
mod ply;
mod random;
mod scene;
mod score;
mod settings;
mod sheet;
mod show;
mod sight;
mod stone;
mod surface;
mod voxels;

pub use crate::picture::{Picture, PictureError, top_view, write_png};
pub use crate::validate::Detection;
pub use ply::{write_ply, write_truth_csv};
pub use scene::{Scene, Stone, make_scene};
pub use score::{MIN_GRAIN_AREA_M2, Score, VISIBLE_AREA_FACTOR, score};
pub use settings::{SAND, SceneSettings};
pub use show::{DemoError, Demonstration, Shown, demonstrate};
