//! Measuring: one whole segment becomes a [`Grain`].

pub mod attitude;
mod axes;
mod body;
mod completed;
pub mod confidence;
mod ellipsoid;
mod grain;
mod outline;
mod patch;
pub mod shape;

pub use axes::{Axes, axes};
pub use completed::{Completed, completed};
pub use ellipsoid::ellipsoid_axes;
pub use grain::{Grain, Polygon};
pub use outline::outline;
pub use patch::Patch;

use crate::geometry::{DVec3, hull, triangle_area, triangle_centroid};
use crate::segment::Segment;
use crate::settings::ShapePrior;
use crate::tile::TileMesh;

/// What measuring needs besides the mesh.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Step of the outline grid, metres.
    pub outline_step_m: f64,
    /// What is expected of the shape of stones, where they are buried.
    pub shape_prior: ShapePrior,
    /// Whether the grain keeps its triangle ids, for a labelled mesh.
    pub triangle_ids: bool,
}

/// Measures the grain that one segment shows. `color` gives the colour of a
/// local vertex, if the survey has colours.
///
/// All sums run by ascending id, so the result is the same bits in every tile that sees the grain whole.
pub fn measure(
    mesh: &TileMesh,
    segment: &Segment,
    wanted: Wanted,
    color: &(dyn Fn(u32) -> Option<[f64; 3]> + Sync),
) -> Grain {
    let patch = Patch::of(mesh, &segment.triangles);
    let points = &patch.points;
    let box_axes = axes(points);
    let hull = hull(points);
    let (outline, footprint_area_m2) = outline(&patch, wanted.outline_step_m);
    let (centroid, surface_area_m2) = centroid_and_area(&patch);
    let (color_mean, color_std) = colors(patch.vertices.iter().map(|&v| color(v)));
    let ids = || segment.triangles.iter().map(|&t| mesh.triangle_id(t));
    Grain {
        anchor: ids().next().unwrap_or(u64::MAX),
        triangles: segment.triangles.len() as u64,
        vertices: points.len() as u64,
        centroid,
        top_z: points.iter().fold(f64::NEG_INFINITY, |top, p| top.max(p.z)),
        axes_m: box_axes.extents_m,
        directions: box_axes.directions,
        ellipsoid_axes_m: ellipsoid_axes(points),
        completed: completed(&patch, &box_axes, &wanted.shape_prior),
        surface_area_m2,
        hull_area_m2: hull.map_or(f64::NAN, |h| h.area_m2),
        hull_volume_m3: hull.map_or(f64::NAN, |h| h.volume_m3),
        footprint_area_m2,
        color_mean,
        color_std,
        touches_edge: segment.at_mesh_edge,
        evidence: segment.evidence,
        outline,
        triangle_ids: if wanted.triangle_ids { ids().collect() } else { Vec::new() },
    }
}

/// Area-weighted centroid (local metres) and area (m²).
fn centroid_and_area(patch: &Patch) -> (DVec3, f64) {
    let Some([origin, ..]) = patch.triangles().next() else { return (DVec3::ZERO, 0.0) };
    let (mut moment, mut area) = (DVec3::ZERO, 0.0);
    for corners in patch.triangles() {
        let a = triangle_area(corners);
        moment += (triangle_centroid(corners) - origin) * a;
        area += a;
    }
    (if area > 0.0 { origin + moment / area } else { origin }, area)
}

/// Mean and population standard deviation of the vertices' colours; none where one has none.
fn colors(colors: impl Iterator<Item = Option<[f64; 3]>>) -> (Option<[f64; 3]>, Option<[f64; 3]>) {
    let Some(colors) = colors.collect::<Option<Vec<[f64; 3]>>>() else { return (None, None) };
    let n = colors.len() as f64;
    let mut sum = [0.0; 3];
    for color in &colors {
        (0..3).for_each(|i| sum[i] += color[i]);
    }
    let mean = sum.map(|s| s / n);
    let mut square = [0.0; 3];
    for color in &colors {
        (0..3).for_each(|i| square[i] += (color[i] - mean[i]).powi(2));
    }
    (Some(mean), Some(square.map(|s| (s / n).sqrt())))
}
