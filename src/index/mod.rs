//! Indexing: one pass over the survey sorts its triangles into square cells in plan and gathers what
//! must be the same for every tile.

mod scale;

pub use scale::Scale;
