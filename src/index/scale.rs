//! The scale of a survey: every number that all tiles must share.

use crate::geometry::DVec3;
use serde::{Deserialize, Serialize};

/// Survey-wide figures, from exact sums: the same bits whatever the tiling or the order of the file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scale {
    /// Number of vertices that triangles use.
    pub vertices: u64,
    /// Number of triangles, zero-area ones included.
    pub triangles: u64,
    /// Lowest corner of the box of the vertices that triangles use, local metres.
    pub min: DVec3,
    /// Highest corner of the same, local metres.
    pub max: DVec3,
    /// Summed triangle area, m².
    pub surface_area_m2: f64,
    /// Mean triangle area, m².
    pub mean_triangle_area_m2: f64,
    /// Mean length of the triangles' edges (an edge counts once per triangle), metres.
    pub mean_edge_m: f64,
    /// Mean distance from a vertex that triangles use to the nearest triangle centroid, metres; 0 where
    /// no step of the method asks for it.
    pub spacing_m: f64,
    /// Triangles of zero area.
    pub zero_area_triangles: u64,
}
