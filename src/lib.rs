//! gravelometer: every pebble of a gravel river bed, from a reach-scale 3D survey.
//!
//! The modules are the river, in the order in which the data flows:
//!
//! ```text
//!  open ──> index ──> tile ──> curvature ──> segment ──> measure ──> stitch ──> statistics ──> write
//!                      └──────────── per tile, in the pipeline ────────────┘
//! ```
//!
//! [`run`] is the page that shows all of it. A stage may use the stages above it, never those below;
//! [`pipeline`] schedules tiles and knows no geometry.

pub mod demo;
pub mod geometry;
pub mod settings;

pub mod index;
pub mod measure;
pub mod open;
pub mod stitch;
