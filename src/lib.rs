//! gravelometer: every pebble of a gravel river bed, from a reach-scale 3D survey.
//!
//! The modules are the river, in the order in which the data flows:
//!
//! ```text
//!  open ──> weld / triangulate ──> index ──> tile ──> curvature ──> segment ──> measure ──> stitch ──> statistics ──> write
//!                                            └──────────── per tile, in the pipeline ────────────┘
//! ```
//!
//! [`run`] is the page that shows all of it. A stage may use the stages above it, never those below;
//! [`pipeline`] schedules tiles and [`store`] keeps records on disk; neither knows any geometry.

// What every stage may use.
pub mod geometry;
pub mod progress;
pub mod settings;

// The river. Blank lines keep the order.
pub mod open;

pub mod weld;

pub mod triangulate;

pub mod index;

pub mod tile;

pub mod curvature;

pub mod segment;

pub mod measure;

pub mod stitch;

pub mod statistics;

pub mod write;

// What schedules it, what keeps its records, and what stands beside it.
pub mod pipeline;
pub mod store;

pub mod cli;
pub mod costs;
pub mod cuts;
pub mod demo;
pub mod divergence;
pub mod error;
pub mod facts;
pub mod forecast;
pub mod inspect;
pub mod opening;
pub mod passes;
pub mod picture;
pub mod resume;
pub mod run;
pub mod surfaces;
pub mod validate;
