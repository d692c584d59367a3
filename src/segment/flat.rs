//! Flat bodies: sheets and ridges are no stones.

use super::bands::Bands;
use super::state::{Labels, NONE, OVERSIZE, State};
use crate::geometry::{DVec3, flatter_than};
use rayon::prelude::*;

/// Removes bodies whose convex hull is less spherical than a grain may be: sheets and ridges.
///
/// Oversize bodies are not tested: nobody sees them whole.
pub fn drop_flat(bands: &Bands, labels: &mut Labels, min_sphericity: f64) {
    if min_sphericity <= 0.0 {
        return;
    }
    let bodies = Bodies::of(bands, labels);
    let flat: Vec<u32> = (0..bodies.lowest.len())
        .into_par_iter()
        .filter(|&body| {
            let points: Vec<DVec3> = bodies.vertices(body).iter().map(|&v| bands.mesh.positions[v as usize]).collect();
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
    fn of(bands: &Bands, labels: &Labels) -> Bodies {
        let is_lowest = |(t, label): &(usize, &u32)| *t as u32 == **label;
        let lowest: Vec<u32> = labels.label.par_iter().enumerate().filter(is_lowest).map(|(t, _)| t as u32).collect();
        // Nearly every vertex has one body; further ones, where bodies touch in a point, come beside.
        let body = |t: usize| Some(labels.label[t]).filter(|&label| label < OVERSIZE);
        let mut first: Vec<u32> = rayon::iter::repeat_n(NONE, bands.mesh.positions.len()).collect();
        bands.mark(&mut first, body, |first, body| {
            if *first == NONE {
                *first = body;
            }
        });
        let first_of = &first;
        let others = |(t, corners): (usize, &[u32; 3])| {
            let all = body(t).map(|body| corners.map(|v| (body, v)));
            all.into_iter().flatten().filter(|&(body, v)| first_of[v as usize] != body)
        };
        let mut further: Vec<(u32, u32)> = bands.mesh.triangles.par_iter().enumerate().flat_map_iter(others).collect();
        further.sort_unstable();
        further.dedup();
        // Vertices of one body mostly follow one another.
        let (mut last, mut number) = (NONE, 0);
        let mut number = |body: u32| {
            if body != last {
                (last, number) = (body, lowest.partition_point(|&t| t < body));
            }
            number
        };
        let mut end = vec![0; lowest.len() + 1];
        let all = first.iter().filter(|body| **body != NONE).chain(further.iter().map(|(body, _)| body));
        all.for_each(|&body| end[number(body) + 1] += 1);
        for body in 1..end.len() {
            end[body] += end[body - 1];
        }
        let mut vertices = vec![0u32; end[lowest.len()]];
        let mut put = |body: u32, v: u32| {
            let place = &mut end[number(body)];
            vertices[*place] = v;
            *place += 1;
        };
        for (v, &body) in first.iter().enumerate().filter(|(_, body)| **body != NONE) {
            put(body, v as u32);
        }
        further.iter().for_each(|&(body, v)| put(body, v));
        let touched: Vec<usize> = further.chunk_by(|a, b| a.0 == b.0).map(|same| number(same[0].0)).collect();
        let mut bodies = Bodies { lowest, end, vertices };
        for body in touched {
            let range = bodies.range(body);
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
