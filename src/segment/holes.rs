//! Concave pockets inside a single grain are filled.

use super::Sizes;
use super::components::Components;
use super::edges::Edges;
use super::state::{Labels, NONE, OVERSIZE, State};
use crate::settings::SegmentSettings;
use crate::tile::TileMesh;

/// Fills every removed component that touches, by shared vertices, exactly one body.
///
/// A pocket wider than the widest grain is open ground; so is, unless `fill_edge_holes`, one that an
/// edge of the mesh bounds, since nobody knows what it touches beyond; so is one in an oversize body.
pub fn fill_holes(mesh: &TileMesh, edges: &Edges, sizes: &Sizes, settings: &SegmentSettings, labels: &mut Labels) {
    let state = &labels.state;
    let pockets =
        Components::of(mesh, edges, &sizes.of, |t| state[t] == State::Removed, |t| state[t] == State::Unknown);
    let touching = Contacts::of(mesh, labels);
    let mut contact = vec![(NONE, true); pockets.parts.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        if let Some((only, sure)) = contact.get_mut(pockets.of[t] as usize) {
            for &v in corners {
                *only = merge(*only, touching.only[v as usize]);
                *sure &= touching.sure[v as usize];
            }
        }
    }
    for t in 0..mesh.triangles.len() {
        let Some(part) = pockets.part(t) else { continue };
        let (only, sure) = contact[pockets.of[t] as usize];
        let wide = settings.max_grain_m > 0.0 && part.bounds.width_m() > settings.max_grain_m;
        let at_edge = part.at_mesh_edge && !settings.fill_edge_holes;
        if only == SEVERAL || only == OVERSIZE || wide || at_edge {
            continue;
        }
        if !sure || !part.closed() {
            labels.state[t] = State::Unknown;
        } else if only < SEVERAL {
            labels.state[t] = State::Kept;
            labels.label[t] = only;
        }
    }
}

/// More than one body; below [`OVERSIZE`] and [`NONE`], above every triangle.
const SEVERAL: u32 = OVERSIZE - 1;

fn merge(a: u32, b: u32) -> u32 {
    match (a, b) {
        (NONE, other) | (other, NONE) => other,
        (a, b) if a == b => a,
        _ => SEVERAL,
    }
}

/// The only body that touches each vertex ([`NONE`], or [`SEVERAL`]), and whether that is certain.
struct Contacts {
    only: Vec<u32>,
    sure: Vec<bool>,
}

impl Contacts {
    fn of(mesh: &TileMesh, labels: &Labels) -> Contacts {
        let mut contacts = Contacts { only: vec![NONE; mesh.positions.len()], sure: mesh.complete.clone() };
        for (t, corners) in mesh.triangles.iter().enumerate() {
            for &v in corners {
                match labels.state[t] {
                    State::Kept => contacts.only[v as usize] = merge(contacts.only[v as usize], labels.label[t]),
                    State::Unknown => contacts.sure[v as usize] = false,
                    State::Removed => {}
                }
            }
        }
        contacts
    }
}
