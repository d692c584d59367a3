//! Concave triangles, and the small concave pockets that are given back.

use super::Sizes;
use super::adjacency::Adjacency;
use super::components::Components;
use super::state::State;
use crate::settings::{ConcaveRule, SegmentSettings};
use crate::tile::TileMesh;
use rayon::prelude::*;

/// Removes concave triangles: those whose divergence (the least of the three vertices, or their mean)
/// lies below the threshold.
///
/// `divergence` is per local vertex, 1/m. The threshold is `concave_below` per mean edge length; with 0,
/// as published, a flat vertex is convex.
pub fn remove_concave(mesh: &TileMesh, divergence: &[f64], mean_edge_m: f64, settings: &SegmentSettings) -> Vec<State> {
    let threshold = settings.concave_below / mean_edge_m;
    let state = |value: f64| if value < threshold { State::Removed } else { State::Kept };
    let of = |corners: &[u32; 3]| corners.map(|v| divergence[v as usize]);
    match settings.concave_rule {
        ConcaveRule::Min => mesh.triangles.par_iter().map(of).map(|d| state(d[0].min(d[1]).min(d[2]))).collect(),
        ConcaveRule::Mean => mesh.triangles.par_iter().map(of).map(|d| state((d[0] + d[1] + d[2]) / 3.0)).collect(),
    }
}

/// Triangles that span more height than a grain's surface may, ascending.
pub fn too_tall(mesh: &TileMesh, settings: &SegmentSettings) -> Vec<u32> {
    let most_m = settings.max_triangle_height_m;
    if most_m <= 0.0 {
        return Vec::new();
    }
    let z = || mesh.positions.iter().map(|p| p.z);
    let least = z().fold(f64::INFINITY, |least, z| if z < least { z } else { least });
    let most = z().fold(f64::NEG_INFINITY, |most, z| if z > most { z } else { most });
    if most - least <= most_m {
        // Rounding keeps order: no triangle spans more than the tile.
        return Vec::new();
    }
    let tall = |t: &u32| {
        let z = mesh.triangles[*t as usize].map(|v| mesh.positions[v as usize].z);
        z[0].max(z[1]).max(z[2]) - z[0].min(z[1]).min(z[2]) > most_m
    };
    (0..mesh.triangles.len() as u32).filter(tall).collect()
}

/// Gives back concave components smaller than the smallest grain: dents, not gaps between stones.
///
/// A component that reaches the halo's outer side is known to stay once what is seen of it is large
/// enough; else it is unknown.
pub fn give_back_dents(mesh: &TileMesh, adjacency: &Adjacency, sizes: &Sizes, state: &mut [State]) {
    let concave = Components::sized(mesh, adjacency, sizes, |t| state[t] == State::Removed);
    let open = concave.holding(adjacency.open());
    let becomes: Vec<State> = concave
        .size
        .iter()
        .zip(open)
        .map(|(&size, open)| match (size < sizes.smallest, open) {
            (false, _) => State::Removed,
            (true, true) => State::Unknown,
            (true, false) => State::Kept,
        })
        .collect();
    for (part, run) in concave.runs() {
        match becomes.get(part as usize) {
            None | Some(State::Removed) => {}
            Some(becomes) => state[run].fill(*becomes),
        }
    }
}
