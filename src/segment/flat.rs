//! Flat bodies: sheets and ridges are no stones.

use super::state::{Labels, NONE, OVERSIZE, State};
use crate::geometry::{DVec3, flatter_than};
use crate::tile::TileMesh;
use rayon::prelude::*;

/// Removes bodies whose convex hull is less spherical than a grain may be: sheets and ridges.
///
/// Oversize bodies are not tested: nobody sees them whole.
pub fn drop_flat(mesh: &TileMesh, labels: &mut Labels, min_sphericity: f64) {
    if min_sphericity <= 0.0 {
        return;
    }
    let vertices = BodyVertices::of(mesh, labels);
    let flat: Vec<u32> = (0..labels.label.len() as u32)
        .into_par_iter()
        .filter(|&t| labels.label[t as usize] == t)
        .filter(|&body| {
            let points: Vec<DVec3> = vertices.of_body(body).iter().map(|&v| mesh.positions[v as usize]).collect();
            flatter_than(&points, min_sphericity)
        })
        .collect();
    drop(vertices);
    let mut is_flat = vec![false; labels.label.len()];
    flat.iter().for_each(|&body| is_flat[body as usize] = true);
    for (state, label) in labels.state.iter_mut().zip(&mut labels.label) {
        if is_flat.get(*label as usize) == Some(&true) {
            (*state, *label) = (State::Removed, NONE);
        }
    }
}

/// The vertices of each body, ascending, each once.
struct BodyVertices {
    /// After the lists are filled, that of the body with lowest triangle t ends at `end[t]`.
    end: Vec<u32>,
    vertices: Vec<u32>,
}

impl BodyVertices {
    fn of(mesh: &TileMesh, labels: &Labels) -> BodyVertices {
        // Nearly every vertex has one body; further ones, where bodies touch in a point, come beside.
        let mut first = vec![NONE; mesh.positions.len()];
        let mut further: Vec<(u32, u32)> = Vec::new();
        for (corners, &body) in mesh.triangles.iter().zip(&labels.label).filter(|(_, body)| **body < OVERSIZE) {
            for &v in corners {
                match first[v as usize] {
                    NONE => first[v as usize] = body,
                    other if other != body => further.push((body, v)),
                    _ => {}
                }
            }
        }
        further.sort_unstable();
        further.dedup();
        let mut end = vec![0u32; labels.label.len() + 1];
        let bodies = first.iter().copied().filter(|&body| body != NONE).chain(further.iter().map(|&(body, _)| body));
        for body in bodies {
            end[body as usize + 1] += 1;
        }
        for t in 1..end.len() {
            end[t] += end[t - 1];
        }
        let mut vertices = vec![0u32; end[end.len() - 1] as usize];
        let mut put = |body: u32, v: u32| {
            let place = &mut end[body as usize];
            vertices[*place as usize] = v;
            *place += 1;
        };
        for (v, &body) in first.iter().enumerate().filter(|(_, body)| **body != NONE) {
            put(body, v as u32);
        }
        further.iter().for_each(|&(body, v)| put(body, v));
        drop(first);
        let mut of = BodyVertices { end, vertices };
        for same in further.chunk_by(|a, b| a.0 == b.0) {
            let range = of.range(same[0].0);
            of.vertices[range].sort_unstable();
        }
        of
    }

    fn range(&self, body: u32) -> std::ops::Range<usize> {
        let start = body.checked_sub(1).map_or(0, |before| self.end[before as usize]);
        start as usize..self.end[body as usize] as usize
    }

    fn of_body(&self, body: u32) -> &[u32] {
        &self.vertices[self.range(body)]
    }
}
