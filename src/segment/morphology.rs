//! Erosion and dilation on the triangles of a mesh, one ring of vertices at a time.
//!
//! Both look one ring of vertices around. Both are simultaneous: what a ring does depends on the state
//! before it only, never on the order of the triangles (the authors' dilation runs through the triangles
//! in file order and lets the first win; here the lowest triangle proposes, which is the same nearly
//! everywhere).

use super::bands::Bands;
use super::state::{Labels, NONE, State, UNSURE};
use rayon::prelude::*;

/// A removed triangle lies at the vertex.
const AT_REMOVED: u8 = 1;
/// An unknown triangle lies at the vertex, or one that is not loaded may.
const DOUBTFUL: u8 = 2;

/// Takes one ring off: a triangle goes when one of its vertices also belongs to a removed triangle. The
/// edge of the mesh is not eroded.
pub fn erode(bands: &Bands, state: &mut [State]) {
    let mesh = bands.mesh;
    let mut seen: Vec<u8> = mesh.complete.par_iter().map(|&c| if c { 0 } else { DOUBTFUL }).collect();
    let mark = |t: usize| match state[t] {
        State::Kept => None,
        State::Removed => Some(AT_REMOVED),
        State::Unknown => Some(DOUBTFUL),
    };
    bands.mark(&mut seen, mark, |seen, mark| *seen |= mark);
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
pub fn dilate(bands: &Bands, labels: &mut Labels) {
    let mut carried = carried(bands, labels);
    let front = front(bands, labels, &carried);
    for proposal in &front {
        for v in bands.mesh.triangles[(proposal.triangle & !MAY_JOIN) as usize] {
            let label = &mut carried[v as usize];
            let (free, unsure) = (*label & !UNSURE == NONE, (*label | proposal.body) & UNSURE);
            *label = unsure | !UNSURE & if free { proposal.body } else { *label };
        }
    }
    for t in front.iter().filter(|p| p.triangle & MAY_JOIN != 0).map(|p| (p.triangle & !MAY_JOIN) as usize) {
        let now = bands.mesh.triangles[t].map(|v| carried[v as usize]);
        // What proposals for its vertices hang on includes its vertices themselves.
        if (now[0] | now[1] | now[2]) & UNSURE != 0 {
            labels.state[t] = State::Unknown;
        } else if now[0] == now[1] && now[1] == now[2] && now[0] != NONE {
            labels.state[t] = State::Kept;
            labels.label[t] = now[0];
        }
    }
}

/// The body that each vertex carries, [`UNSURE`] if that is not certain.
fn carried(bands: &Bands, labels: &Labels) -> Vec<u32> {
    let mut carried: Vec<u32> = bands.mesh.complete.par_iter().map(|&c| if c { NONE } else { NONE | UNSURE }).collect();
    let says = |t: usize| match labels.state[t] {
        State::Removed => None,
        State::Kept => Some(labels.label[t]),
        State::Unknown => Some(UNSURE),
    };
    bands.mark(&mut carried, says, |carried, says| match says {
        UNSURE => *carried |= UNSURE,
        body => *carried = *carried & UNSURE | body,
    });
    carried
}

/// A triangle whose vertices do not agree, or not for certain.
struct Proposal {
    /// Its number, which is below 2^30; [`MAY_JOIN`] if it may join a body itself: it is removed, and not between two.
    triangle: u32,
    /// The body that it proposes for its vertices, [`NONE`] if that is none or not one; [`UNSURE`] if one of them is.
    body: u32,
}

/// Set in the number of a triangle that may join a body.
const MAY_JOIN: u32 = 1 << 31;

/// All proposals, ascending.
fn front(bands: &Bands, labels: &Labels, carried: &[u32]) -> Vec<Proposal> {
    let proposal = |(t, corners): (usize, &[u32; 3])| {
        let was = corners.map(|v| carried[v as usize]);
        let unsure = (was[0] | was[1] | was[2]) & UNSURE;
        if unsure == 0 && was[0] == was[1] && was[1] == was[2] {
            return None;
        }
        let may_join = labels.state[t] == State::Removed && !between_two_bodies(was);
        let triangle = t as u32 | if may_join { MAY_JOIN } else { 0 };
        Some(Proposal { triangle, body: only_body(was.map(|l| l & !UNSURE)) | unsure })
    };
    bands.mesh.triangles.par_iter().enumerate().filter_map(proposal).collect()
}

fn between_two_bodies(label: [u32; 3]) -> bool {
    (0..3).any(|i| {
        let (a, b) = (label[i], label[(i + 1) % 3]);
        a != b && a < NONE && b < NONE
    })
}

/// The one body among three labels; [`NONE`] where there is none or more than one.
fn only_body(label: [u32; 3]) -> u32 {
    let one = label[0].min(label[1]).min(label[2]);
    if label.iter().all(|&l| l == one || l == NONE) { one } else { NONE }
}
