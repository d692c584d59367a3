//! Concave triangles, and the small concave pockets that are given back.

use super::Sizes;
use super::components::Components;
use super::edges::Edges;
use super::state::State;
use crate::settings::{ConcaveRule, SegmentSettings};
use crate::tile::TileMesh;

/// Removes concave triangles: those whose divergence (the least of the three vertices, or their mean)
/// lies below the threshold, and those taller than allowed.
///
/// `divergence` is per local vertex, 1/m. The threshold is `concave_below` per mean edge length; with 0,
/// as published, a flat vertex is convex.
pub fn remove_concave(mesh: &TileMesh, divergence: &[f64], mean_edge_m: f64, settings: &SegmentSettings) -> Vec<State> {
    let threshold = settings.concave_below / mean_edge_m;
    (0..mesh.triangles.len())
        .map(|t| {
            let d = mesh.triangles[t].map(|v| divergence[v as usize]);
            let value = match settings.concave_rule {
                ConcaveRule::Min => d[0].min(d[1]).min(d[2]),
                ConcaveRule::Mean => (d[0] + d[1] + d[2]) / 3.0,
            };
            if value < threshold || too_tall(mesh, t, settings) { State::Removed } else { State::Kept }
        })
        .collect()
}

/// Whether a triangle spans more height than a grain's surface may.
pub fn too_tall(mesh: &TileMesh, triangle: usize, settings: &SegmentSettings) -> bool {
    let z = mesh.corners(triangle as u32).map(|c| c.z);
    let height = z[0].max(z[1]).max(z[2]) - z[0].min(z[1]).min(z[2]);
    settings.max_triangle_height_m > 0.0 && height > settings.max_triangle_height_m
}

/// Gives back concave components smaller than the smallest grain: dents, not gaps between stones.
///
/// A component that reaches the halo's outer side is known to stay once what is seen of it is large
/// enough; else it is unknown.
pub fn give_back_dents(mesh: &TileMesh, edges: &Edges, sizes: &Sizes, state: &mut [State]) {
    let concave = Components::of(mesh, edges, &sizes.of, |t| state[t] == State::Removed, |_| false);
    for (t, s) in state.iter_mut().enumerate() {
        if let Some(part) = concave.part(t)
            && part.size < sizes.smallest
        {
            *s = if part.open { State::Unknown } else { State::Kept };
        }
    }
}
