//! Erosion and dilation on the triangles of a mesh, one ring of vertices at a time.
//!
//! Both look one ring of vertices around. Both are simultaneous: what a ring does depends on the state
//! before it only, never on the order of the triangles (the authors' dilation runs through the triangles
//! in file order and lets the first win; here the lowest triangle proposes, which is the same nearly
//! everywhere).

use super::state::{Labels, NONE, State, UNSURE};
use crate::tile::TileMesh;
use rayon::prelude::*;

/// A removed triangle lies at the vertex.
const AT_REMOVED: u8 = 1;
/// An unknown triangle lies at the vertex, or one that is not loaded may.
const DOUBTFUL: u8 = 2;

/// Takes one ring off: a triangle goes when one of its vertices also belongs to a removed triangle. The
/// edge of the mesh is not eroded.
pub fn erode(mesh: &TileMesh, state: &mut [State]) {
    let mut seen: Vec<u8> = mesh.complete.iter().map(|&c| if c { 0 } else { DOUBTFUL }).collect();
    for (corners, s) in mesh.triangles.iter().zip(&*state) {
        let mark = match s {
            State::Kept => continue,
            State::Removed => AT_REMOVED,
            State::Unknown => DOUBTFUL,
        };
        corners.iter().for_each(|&v| seen[v as usize] |= mark);
    }
    mesh.triangles.par_iter().zip(state).filter(|(_, s)| **s != State::Removed).for_each(|(corners, s)| {
        let seen = corners.iter().fold(0, |all, &v| all | seen[v as usize]);
        if seen & AT_REMOVED != 0 {
            *s = State::Removed;
        } else if seen & DOUBTFUL != 0 {
            *s = State::Unknown;
        }
    });
}

/// Gives one ring back: a free triangle next to one body joins it, unless its vertices go to another.
///
/// A vertex carries the body of its highest kept triangle. A vertex that carries none takes the body
/// proposed by the lowest triangle that touches exactly one body there. A triangle joins when its three
/// vertices then agree; one whose vertices agreed before (a pocket inside a body, or open ground) stays.
pub fn dilate(mesh: &TileMesh, labels: &mut Labels) {
    let before = carried(mesh, labels);
    let (after, front) = proposed(mesh, labels, &before);
    for &t in &front {
        let corners = mesh.triangles[t as usize];
        let was = corners.map(|v| before[v as usize]);
        if between_two_bodies(was) {
            continue;
        }
        let now = corners.map(|v| after[v as usize]);
        // What proposals for its vertices hang on includes its vertices themselves.
        if (now[0] | now[1] | now[2]) & UNSURE != 0 {
            labels.state[t as usize] = State::Unknown;
        } else if now[0] == now[1] && now[1] == now[2] && now[0] != NONE {
            labels.state[t as usize] = State::Kept;
            labels.label[t as usize] = now[0];
        }
    }
}

fn between_two_bodies(label: [u32; 3]) -> bool {
    (0..3).any(|i| {
        let (a, b) = (label[i], label[(i + 1) % 3]);
        a != b && a < NONE && b < NONE
    })
}

/// The body that each vertex carries, [`UNSURE`] if that is not certain.
fn carried(mesh: &TileMesh, labels: &Labels) -> Vec<u32> {
    let mut carried: Vec<u32> = mesh.complete.iter().map(|&c| if c { NONE } else { NONE | UNSURE }).collect();
    for ((corners, state), &label) in mesh.triangles.iter().zip(&labels.state).zip(&labels.label) {
        match state {
            State::Removed => {}
            State::Kept => corners.iter().map(|&v| v as usize).for_each(|v| carried[v] = carried[v] & UNSURE | label),
            State::Unknown => corners.iter().for_each(|&v| carried[v as usize] |= UNSURE),
        }
    }
    carried
}

/// The body that each vertex carries or is given, [`UNSURE`] if that is not certain; and the removed triangles
/// whose vertices do not agree before.
fn proposed(mesh: &TileMesh, labels: &Labels, before: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut after = before.to_vec();
    let mut front = Vec::new();
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let was = corners.map(|v| before[v as usize]);
        let unsure = (was[0] | was[1] | was[2]) & UNSURE;
        if unsure == 0 && was[0] == was[1] && was[1] == was[2] {
            continue;
        }
        if labels.state[t] == State::Removed {
            front.push(t as u32);
        }
        let proposal = only_body(was.map(|l| l & !UNSURE));
        for &v in corners {
            let label = &mut after[v as usize];
            let free = *label & !UNSURE == NONE;
            *label = if free { proposal | *label & UNSURE } else { *label } | unsure;
        }
    }
    (after, front)
}

/// The one body among three labels; [`NONE`] where there is none or more than one.
fn only_body(label: [u32; 3]) -> u32 {
    let one = label[0].min(label[1]).min(label[2]);
    if label.iter().all(|&l| l == one || l == NONE) { one } else { NONE }
}
