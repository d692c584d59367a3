//! A grain: what one settled segment of the surface says about the stone under it.

use super::completed::Completed;
use crate::geometry::DVec3;
use crate::segment::Evidence;
use serde::{Deserialize, Serialize};

/// One polygon of an outline: the outer ring counter-clockwise, holes clockwise, none closed (the first
/// point is not repeated), in steps of the outline grid from the local origin
/// (see [`crate::open::Frame::outline_position`]).
pub type Polygon = Vec<Vec<[i64; 2]>>;

/// One grain, all lengths in metres, local frame.
///
/// It is measured from the visible part of the stone only: buried and hidden flanks are not guessed, so
/// `axes_m[2]`, volume and hull area are lower bounds. Only `completed` guesses, and says how surely.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Grain {
    /// Smallest global triangle id of the grain: names it whatever the tiling.
    pub anchor: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Number of distinct vertices.
    pub vertices: u64,
    /// Area-weighted centroid of the visible surface, local metres.
    pub centroid: DVec3,
    /// Highest point, local metres.
    pub top_z: f64,
    /// Extents along the principal axes of the vertices (PCA bounding box), a >= b >= c.
    pub axes_m: [f64; 3],
    /// Unit vectors of a, b, c: right-handed, c upward (z >= 0), a eastward (x >= 0).
    pub directions: [DVec3; 3],
    /// Full axes of the least-squares ellipsoid, a >= b >= c; none where no ellipsoid fits.
    pub ellipsoid_axes_m: Option<[f64; 3]>,
    /// Axes of the stone completed by what is buried; none where too little is seen for a fit.
    pub completed: Option<Completed>,
    /// Summed area of the triangles.
    pub surface_area_m2: f64,
    /// Area of the convex hull, both sides of a flat one; NaN where no hull could be made.
    pub hull_area_m2: f64,
    /// Volume of the convex hull; NaN likewise.
    pub hull_volume_m3: f64,
    /// Area of the outline in plan.
    pub footprint_area_m2: f64,
    /// Mean colour of the vertices, red, green, blue in 0 to 1; none where the mesh has no colours.
    pub color_mean: Option<[f64; 3]>,
    /// Population standard deviation of the same.
    pub color_std: Option<[f64; 3]>,
    /// Whether an edge of the mesh (survey border, scan shadow) bounds the grain.
    pub touches_edge: bool,
    /// What speaks for it; none where the method does not tell.
    pub evidence: Option<Evidence>,
    /// Outline in plan: union of the projected triangles.
    pub outline: Vec<Polygon>,
    /// Global triangle ids, ascending; empty unless a labelled mesh was asked for.
    pub triangle_ids: Vec<u64>,
}
