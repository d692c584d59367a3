//! Tiles: cores that partition the survey, each worked together with a halo around it.
//!
//! **Owner rule.** A triangle belongs to the tile whose core holds the cell of its centroid, a vertex to
//! the tile whose core holds its own cell, a grain to the tile that owns its lowest-numbered triangle.
//! Cores are blocks of whole cells of the index, half-open, so that everything has exactly one owner.
//!
//! **Certainty.** What a tile loads is cut off at the outer side of its halo. Whatever the cut could have
//! changed is unknown: a neighbour search that reaches the cut ([`NormalField`]), a vertex around which
//! not all triangles were loaded ([`TileMesh::complete`]).

mod field;
mod mesh;
mod patch;
mod plan;
mod read;
mod runs;

pub use field::NormalField;
pub use mesh::{BYTES_PER_TRIANGLE, Owned, TileMesh};
pub use patch::Patch;
pub use plan::{CoreSize, Plan, Tile};
pub use read::read_of;
pub use runs::Runs;
