//! Bodies: the convex components that are left, told apart from sheets, crumbs and bedrock.

use super::Sizes;
use super::components::{Components, Part};
use super::edges::Edges;
use super::state::{Labels, NONE, OVERSIZE, State};
use crate::geometry::flatter_than;
use crate::settings::SegmentSettings;
use crate::tile::TileMesh;
use rayon::prelude::*;

/// Removes components smaller than the smallest grain, and labels the others by their lowest triangle.
///
/// A component wider than `max_grain_m` is [`OVERSIZE`], known as soon as the part that is seen is wide
/// enough. Every other component that is not whole is unknown from here on.
pub fn tell_apart(
    mesh: &TileMesh,
    edges: &Edges,
    sizes: &Sizes,
    mut state: Vec<State>,
    settings: &SegmentSettings,
) -> Labels {
    let possible = Components::of(mesh, edges, &sizes.of, |t| state[t] != State::Removed, |_| false);
    let sure = Components::of(mesh, edges, &sizes.of, |t| state[t] == State::Kept, |t| state[t] == State::Unknown);
    let wide = |part: &Part| settings.max_grain_m > 0.0 && part.bounds.width_m() > settings.max_grain_m;
    let mut label = vec![NONE; state.len()];
    for t in 0..state.len() {
        let Some(most) = possible.part(t) else { continue };
        // Whatever the truth is, it lies within `most`, and contains `sure.part(t)` where there is one.
        if !most.open && most.size < sizes.smallest {
            state[t] = State::Removed;
            continue;
        }
        match sure.part(t) {
            Some(part) if part.closed() && part.size < sizes.smallest => state[t] = State::Removed,
            Some(part) if part.size >= sizes.smallest && wide(part) => label[t] = OVERSIZE,
            Some(part) if part.closed() => label[t] = part.lowest,
            _ => state[t] = State::Unknown,
        }
    }
    Labels { state, label }
}

/// Removes bodies whose convex hull is less spherical than a grain may be: sheets and ridges.
///
/// Oversize bodies are not tested: nobody sees them whole.
pub fn drop_flat(mesh: &TileMesh, labels: &mut Labels, min_sphericity: f64) {
    if min_sphericity <= 0.0 {
        return;
    }
    let mut members: Vec<(u32, u32)> = (0..labels.label.len() as u32)
        .filter(|&t| labels.label[t as usize] < OVERSIZE)
        .map(|t| (labels.label[t as usize], t))
        .collect();
    members.sort_unstable();
    let bodies: Vec<&[(u32, u32)]> = members.chunk_by(|a, b| a.0 == b.0).collect();
    let flat: Vec<bool> = bodies
        .par_iter()
        .map(|body| {
            let triangles: Vec<u32> = body.iter().map(|&(_, t)| t).collect();
            flatter_than(&mesh.points_of(&triangles), min_sphericity)
        })
        .collect();
    for (_, t) in bodies.iter().zip(&flat).filter(|(_, f)| **f).flat_map(|(b, _)| b.iter()) {
        labels.state[*t as usize] = State::Removed;
        labels.label[*t as usize] = NONE;
    }
}
