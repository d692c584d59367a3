//! What the weld did, for `run.json`, and for later runs that use the index again.

use crate::geometry::PlanBox;
use serde::{Deserialize, Serialize};

/// What became of the borders between files.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct WeldFacts {
    /// Vertices of different files that are as near as this are one, metres.
    pub tolerance_m: f64,
    /// Vertices that became one of an earlier file.
    pub welded_vertices: u64,
    /// Each two files that come near each other.
    pub pairs: Vec<PairFacts>,
}

/// Two files that come near each other.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PairFacts {
    /// Their places among the inputs, from 0.
    pub files: [usize; 2],
    /// Vertices of the second that became one of the first.
    pub welded_vertices: u64,
    /// Triangles of the second whose three vertices are those of one of the first.
    pub identical_triangles: u64,
    /// Squares of eight mean edges in which both are.
    pub border_squares: u64,
    /// Length of these in a row, metres.
    pub border_m: f64,
    /// What both hold.
    pub doubled: Doubled,
    /// Where one lies high above the other.
    pub stacked: Doubled,
}

/// Ground that two files cover.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Doubled {
    /// Squares of eight mean edges of which both cover so much that it is half a square more than there is.
    pub squares: u64,
    /// Area in plan that both cover, m²: all that both cover of these squares, and what is more than there is of those
    /// in which it is less than half a square.
    pub area_m2: f64,
    /// Triangles of the first and of the second file in these squares.
    pub triangles: [u64; 2],
    /// Box around these squares, input units.
    pub place: Option<PlanBox>,
}

impl WeldFacts {
    /// Files of which a vertex was welded.
    pub fn welded_files(&self) -> usize {
        let welded = self.pairs.iter().filter(|pair| pair.welded_vertices > 0).flat_map(|pair| pair.files);
        welded.collect::<std::collections::BTreeSet<_>>().len()
    }

    /// In one line.
    pub fn summary(&self) -> String {
        let tolerance = format!("{:.1e} m", self.tolerance_m);
        match self.welded_files() {
            0 => format!("no vertices of different files lie within {tolerance} of each other, so none were welded"),
            files => format!("{} vertices welded between {files} files, within {tolerance}", self.welded_vertices),
        }
    }
}
