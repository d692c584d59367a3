//! Concave pockets inside a single grain are filled.

use super::adjacency::Adjacency;
use super::bands::Bands;
use super::components::Components;
use super::state::{Labels, NONE, OVERSIZE, State, UNSURE};
use crate::settings::SegmentSettings;
use rayon::prelude::*;
use std::ops::Range;

/// Fills every removed component that touches, by shared vertices, exactly one body.
///
/// A pocket wider than the widest grain is open ground; so is, unless `fill_edge_holes`, one that an
/// edge of the mesh bounds, since nobody knows what it touches beyond; so is one in an oversize body.
pub fn fill_holes(bands: &Bands, adjacency: &Adjacency, settings: &SegmentSettings, labels: &mut Labels) {
    let mesh = bands.mesh;
    let pockets = Components::of(adjacency, |t| labels.state[t] == State::Removed);
    let touching = contacts(bands, labels);
    let add = |mut all: u32, run: Range<usize>| {
        for corners in &mesh.triangles[run] {
            if all & !UNSURE == SEVERAL {
                break;
            }
            all = corners.map(|v| touching[v as usize]).into_iter().fold(all, merge);
        }
        all
    };
    let contact = pockets.fold(NONE, |_| true, add, merge);
    drop(touching);
    let undecided = |pocket: usize| contact[pocket] & !UNSURE != SEVERAL && contact[pocket] & !UNSURE != OVERSIZE;
    let mut stays = pockets.wider_than(mesh, settings.max_grain_m, undecided);
    if !settings.fill_edge_holes {
        let at_edge = pockets.holding(adjacency.at_mesh_edge());
        stays.iter_mut().zip(at_edge).for_each(|(stays, at_edge)| *stays |= at_edge);
    }
    for (pocket, run) in pockets.runs() {
        let pocket = pocket as usize;
        if pocket >= stays.len() || stays[pocket] || !undecided(pocket) {
            continue;
        }
        // A pocket that the cut has opened, or beside something unknown, has vertices that are not sure.
        if contact[pocket] & UNSURE != 0 {
            labels.state[run].fill(State::Unknown);
        } else if contact[pocket] != NONE {
            labels.state[run.clone()].fill(State::Kept);
            labels.label[run].fill(contact[pocket]);
        }
    }
}

/// More than one body; below [`OVERSIZE`] and [`NONE`], above every triangle.
const SEVERAL: u32 = OVERSIZE - 1;

/// The only body of both, or [`SEVERAL`]; [`UNSURE`] if either is.
fn merge(a: u32, b: u32) -> u32 {
    let unsure = (a | b) & UNSURE;
    let only = match (a & !UNSURE, b & !UNSURE) {
        (NONE, other) | (other, NONE) => other,
        (a, b) if a == b => a,
        _ => SEVERAL,
    };
    only | unsure
}

/// The only body that touches each vertex ([`NONE`], or [`SEVERAL`]), [`UNSURE`] if that is not certain.
fn contacts(bands: &Bands, labels: &Labels) -> Vec<u32> {
    let mut touching: Vec<u32> =
        bands.mesh.complete.par_iter().map(|&c| if c { NONE } else { NONE | UNSURE }).collect();
    let adds = |t: usize| match labels.state[t] {
        State::Kept => Some(labels.label[t]),
        State::Unknown => Some(NONE | UNSURE),
        State::Removed => None,
    };
    bands.mark(&mut touching, adds, |touching, adds| {
        if *touching != adds {
            *touching = merge(*touching, adds);
        }
    });
    touching
}
