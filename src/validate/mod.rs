//! Holding a run against known stones, as the paper does (Rheinwalt, Purinton & Bookhagen 2025, section 3).
//!
//! ```text
//!  truth (mesh, stone of each triangle, table of stones) ─┐
//!  labels (grain of each triangle) ──> overlap ──> judgement ──> matched ──> score ──> report, table, map
//! ```
//!
//! Four results: *detection* (which stones were found), *axes* (how long they are), *orientation* (how they lie) and
//! *area* (how much of each stone's surface is in its grain). The true labels themselves are scored in the same way:
//! stones are partly buried and meshes are smooth, so that even these have errors of size and attitude, for which no
//! segmentation is to blame.
//!
//! It is no stage: it knows nothing of how a segmentation was made, and measures by itself.

mod arrays;
mod detection;
mod error;
mod grain_table;
mod judgement;
mod labels;
mod map;
mod matched;
mod overlap;
mod principal;
mod report;
mod score;
mod sphere;
mod spread;
mod stones;
mod table;
mod table_file;
mod truth;

pub use detection::Detection;
pub use error::ValidateError;
pub use grain_table::{Bin, Reliability, SizedBy};
pub use judgement::{Judgement, Mostly};
pub use labels::Labels;
pub use map::{Shown, draw, shown};
pub use matched::{AttitudeError, Ball, Match};
pub use overlap::{Overlaps, TrueSurface};
pub use principal::{PrincipalBox, Turned};
pub use report::{Astray, Report, Validated, Validation, WRITTEN, validate};
pub use score::{
    AreaShares, AxisError, AxisErrors, BAxis, Counts, Errors, MiddleMax, Orientation, ReferenceMean, References, Score,
    Scored, Spheres, score,
};
pub use sphere::Sphere;
pub use spread::{Middle, Percentiles};
pub use stones::TrueStone;
pub use truth::{Truth, TruthRule};
