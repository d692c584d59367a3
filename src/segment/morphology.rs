//! Erosion and dilation on the triangles of a mesh, one ring of vertices at a time.
//!
//! Both look one ring of vertices around. Both are simultaneous: what a ring does depends on the state
//! before it only, never on the order of the triangles (the authors' dilation runs through the triangles
//! in file order and lets the first win; here the lowest triangle proposes, which is the same nearly
//! everywhere).

use super::state::{Labels, NONE, State};
use crate::tile::TileMesh;

/// Takes one ring off: a triangle goes when one of its vertices also belongs to a removed triangle. The
/// edge of the mesh is not eroded.
pub fn erode(mesh: &TileMesh, state: &mut [State]) {
    let n = mesh.positions.len();
    let mut removed = vec![false; n];
    let mut doubtful: Vec<bool> = mesh.complete.iter().map(|&c| !c).collect();
    for (corners, s) in mesh.triangles.iter().zip(&*state) {
        for &v in corners {
            removed[v as usize] |= *s == State::Removed;
            doubtful[v as usize] |= *s == State::Unknown;
        }
    }
    for (corners, s) in mesh.triangles.iter().zip(state) {
        if corners.iter().any(|&v| removed[v as usize]) {
            *s = State::Removed;
        } else if *s == State::Kept && corners.iter().any(|&v| doubtful[v as usize]) {
            *s = State::Unknown;
        }
    }
}

/// Gives one ring back: a free triangle next to one body joins it, unless its vertices go to another.
///
/// A vertex carries the body of its highest kept triangle. A vertex that carries none takes the body
/// proposed by the lowest triangle that touches exactly one body there. A triangle joins when its three
/// vertices then agree; one whose vertices agreed before (a pocket inside a body, or open ground) stays.
pub fn dilate(mesh: &TileMesh, labels: &mut Labels) {
    let before = VertexLabels::carried(mesh, labels);
    let after = before.proposed(mesh);
    for (t, corners) in mesh.triangles.iter().enumerate() {
        if labels.state[t] != State::Removed {
            continue;
        }
        let was = corners.map(|v| before.label[v as usize]);
        let sure = corners.map(|v| before.sure[v as usize]);
        let all_sure = sure == [true; 3];
        if all_sure && was[0] == was[1] && was[1] == was[2] {
            continue;
        }
        if between_two_bodies(was, sure) {
            continue;
        }
        let now = corners.map(|v| after.label[v as usize]);
        if all_sure && corners.iter().all(|&v| after.sure[v as usize]) {
            if now[0] == now[1] && now[1] == now[2] && now[0] != NONE {
                labels.state[t] = State::Kept;
                labels.label[t] = now[0];
            }
        } else {
            labels.state[t] = State::Unknown;
        }
    }
}

fn between_two_bodies(label: [u32; 3], sure: [bool; 3]) -> bool {
    (0..3).any(|i| {
        let j = (i + 1) % 3;
        sure[i] && sure[j] && label[i] != NONE && label[j] != NONE && label[i] != label[j]
    })
}

/// The body that each vertex carries, and whether that is certain.
struct VertexLabels {
    label: Vec<u32>,
    sure: Vec<bool>,
}

impl VertexLabels {
    fn carried(mesh: &TileMesh, labels: &Labels) -> VertexLabels {
        let mut of = VertexLabels { label: vec![NONE; mesh.positions.len()], sure: mesh.complete.clone() };
        for (t, corners) in mesh.triangles.iter().enumerate() {
            for &v in corners {
                match labels.state[t] {
                    State::Kept => of.label[v as usize] = labels.label[t],
                    State::Unknown => of.sure[v as usize] = false,
                    State::Removed => {}
                }
            }
        }
        of
    }

    fn proposed(&self, mesh: &TileMesh) -> VertexLabels {
        let mut after = VertexLabels { label: self.label.clone(), sure: mesh.complete.clone() };
        for corners in &mesh.triangles {
            let label = corners.map(|v| self.label[v as usize]);
            let sure = corners.iter().all(|&v| self.sure[v as usize]);
            let proposal = only_body(label);
            for &v in corners {
                let v = v as usize;
                if self.label[v] == NONE && after.label[v] == NONE {
                    after.label[v] = proposal;
                }
                after.sure[v] &= sure;
            }
        }
        after
    }
}

/// The one body among three labels; [`NONE`] where there is none or more than one.
fn only_body(label: [u32; 3]) -> u32 {
    label
        .into_iter()
        .filter(|&l| l != NONE)
        .fold(None, |one, l| match one {
            None => Some(l),
            Some(other) if other == l => Some(l),
            Some(_) => Some(NONE),
        })
        .unwrap_or(NONE)
}
