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
    let bodies = Bodies::of(mesh, labels);
    let flat: Vec<u32> = (0..bodies.lowest.len())
        .into_par_iter()
        .filter(|&body| {
            let points: Vec<DVec3> = bodies.vertices(body).iter().map(|&v| mesh.positions[v as usize]).collect();
            flatter_than(&points, min_sphericity)
        })
        .map(|body| bodies.lowest[body])
        .collect();
    drop(bodies);
    if flat.is_empty() {
        return;
    }
    // Triangles of one body mostly follow one another.
    let (mut last, mut is_flat) = (NONE, false);
    for (state, label) in labels.state.iter_mut().zip(&mut labels.label).filter(|(_, label)| **label < OVERSIZE) {
        if *label != last {
            (last, is_flat) = (*label, flat.binary_search(label).is_ok());
        }
        if is_flat {
            (*state, *label) = (State::Removed, NONE);
        }
    }
}

/// The vertices of each body, ascending, each once.
struct Bodies {
    /// The lowest triangle of each body, ascending: its label.
    lowest: Vec<u32>,
    /// Where the list of each body ends.
    end: Vec<usize>,
    vertices: Vec<u32>,
}

impl Bodies {
    fn of(mesh: &TileMesh, labels: &Labels) -> Bodies {
        let lowest: Vec<u32> = (0..).zip(&labels.label).filter(|(t, label)| t == *label).map(|(t, _)| t).collect();
        // Nearly every vertex has one body; further ones, where bodies touch in a point, come beside.
        let mut first = vec![NONE; mesh.positions.len()];
        let mut further: Vec<(u32, u32)> = Vec::new();
        let (mut last, mut number) = (NONE, NONE);
        for (corners, &label) in mesh.triangles.iter().zip(&labels.label).filter(|(_, label)| **label < OVERSIZE) {
            if label != last {
                // Triangles of one body mostly follow one another.
                (last, number) = (label, lowest.partition_point(|&t| t < label) as u32);
            }
            for &v in corners {
                let first = &mut first[v as usize];
                if *first != number {
                    if *first == NONE {
                        *first = number;
                    } else {
                        further.push((number, v));
                    }
                }
            }
        }
        further.sort_unstable();
        further.dedup();
        let mut end = vec![0; lowest.len() + 1];
        let all = first.iter().filter(|body| **body != NONE).chain(further.iter().map(|(body, _)| body));
        all.for_each(|&body| end[body as usize + 1] += 1);
        for body in 1..end.len() {
            end[body] += end[body - 1];
        }
        let mut vertices = vec![0u32; end[lowest.len()]];
        let mut put = |body: u32, v: u32| {
            let place = &mut end[body as usize];
            vertices[*place] = v;
            *place += 1;
        };
        for (v, &body) in first.iter().enumerate().filter(|(_, body)| **body != NONE) {
            put(body, v as u32);
        }
        further.iter().for_each(|&(body, v)| put(body, v));
        let mut bodies = Bodies { lowest, end, vertices };
        for same in further.chunk_by(|a, b| a.0 == b.0) {
            let range = bodies.range(same[0].0 as usize);
            bodies.vertices[range].sort_unstable();
        }
        bodies
    }

    fn range(&self, body: usize) -> std::ops::Range<usize> {
        body.checked_sub(1).map_or(0, |before| self.end[before])..self.end[body]
    }

    fn vertices(&self, body: usize) -> &[u32] {
        &self.vertices[self.range(body)]
    }
}
