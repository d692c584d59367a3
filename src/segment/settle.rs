//! Settling: which grains a tile may publish, and whether it must look further.

use super::Sizes;
use super::components::Components;
use super::edges::Edges;
use super::state::{Labels, NONE, OVERSIZE, State};
use crate::geometry::{ExactSum, PlanBox};
use crate::tile::TileMesh;
use serde::{Deserialize, Serialize};

/// What a tile found.
#[derive(Debug, Clone, Default)]
pub struct Settled {
    /// The grains that the tile's core owns, by ascending lowest triangle.
    pub grains: Vec<Segment>,
    /// Pieces of oversize bodies inside the core.
    pub oversize: Vec<OversizePiece>,
    /// Core triangles that are still unknown, or belong to a grain that is, and that this tile may own.
    /// The result is the untiled one only when this is 0.
    pub unsettled: Vec<u32>,
}

/// The triangles of one grain.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Segment {
    /// Local triangle numbers, ascending.
    pub triangles: Vec<u32>,
    /// Whether an edge of the mesh (survey border, scan shadow) bounds it.
    pub at_mesh_edge: bool,
}

/// The part of an oversize body that lies in a tile's core.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct OversizePiece {
    /// Lowest global triangle id in the core.
    pub anchor: u64,
    /// Triangles in the core.
    pub triangles: u64,
    /// Their area, m².
    pub area_m2: ExactSum,
    /// Their box in plan, local metres.
    pub bounds: Option<PlanBox>,
    /// Global triangle ids on both sides of every edge where the body leaves the core: inside, outside.
    pub crossings: Vec<[u64; 2]>,
}

/// Oversize bodies as they stand before dilation, and how many core triangles leave open where one ends.
pub fn oversize_pieces(mesh: &TileMesh, edges: &Edges, labels: &Labels) -> (Vec<OversizePiece>, u64) {
    let of_body = |t: usize| labels.label[t] == OVERSIZE;
    // A later step may remove an unknown triangle for sure, but it may be part of a body here.
    let mut unsettled = unknown_in_core(mesh, labels);
    if !(0..labels.label.len()).any(of_body) {
        return (Vec::new(), unsettled);
    }
    let bodies = Components::of(mesh, edges, &vec![1; labels.label.len()], of_body, |_| false);
    let mut pieces = vec![OversizePiece::default(); bodies.parts.len()];
    for t in (0..labels.label.len()).filter(|&t| of_body(t) && mesh.in_core[t]) {
        let piece = &mut pieces[bodies.of[t] as usize];
        if piece.triangles == 0 {
            piece.anchor = mesh.triangle_id(t as u32);
        }
        piece.triangles += 1;
        piece.area_m2.add(mesh.area_m2(t as u32));
        let bounds = piece.bounds.get_or_insert(PlanBox::EMPTY);
        mesh.corners(t as u32).into_iter().for_each(|c| bounds.include(c));
    }
    for (ends, around) in edges.iter() {
        let open = ends.iter().all(|&v| !mesh.complete[v as usize]);
        for &inside in around.iter().filter(|&&t| of_body(t as usize) && mesh.in_core[t as usize]) {
            let unknown = |&t: &u32| labels.state[t as usize] == State::Unknown;
            unsettled += u64::from(open || around.iter().any(unknown));
            for &outside in around.iter().filter(|&&t| of_body(t as usize) && !mesh.in_core[t as usize]) {
                pieces[bodies.of[inside as usize] as usize]
                    .crossings
                    .push([mesh.triangle_id(inside), mesh.triangle_id(outside)]);
            }
        }
    }
    pieces.retain(|p| p.triangles > 0);
    (pieces, unsettled)
}

fn unknown_list(mesh: &TileMesh, labels: &Labels) -> Vec<u32> {
    (0..labels.state.len() as u32)
        .filter(|&t| mesh.in_core[t as usize] && labels.state[t as usize] == State::Unknown)
        .collect()
}
fn unknown_in_core(mesh: &TileMesh, labels: &Labels) -> u64 {
    let unknown = |t: &usize| mesh.in_core[*t] && labels.state[*t] == State::Unknown;
    (0..labels.state.len()).filter(unknown).count() as u64
}

/// Drops small bodies for the last time and sorts out what the core may publish.
///
/// A grain is owned through its lowest triangle. A body that is not whole is no reason to look further
/// when a triangle of it outside the core lies lower than all in it: every core triangle is known, so its
/// lowest triangle cannot be here.
pub fn settle(
    mesh: &TileMesh,
    edges: &Edges,
    sizes: &Sizes,
    labels: &Labels,
    (oversize, open_oversize): (Vec<OversizePiece>, u64),
) -> Settled {
    let state = &labels.state;
    let bodies = Components::of(
        mesh,
        edges,
        &sizes.of,
        |t| state[t] == State::Kept && labels.label[t] < OVERSIZE,
        |t| state[t] == State::Unknown,
    );
    assert!(open_oversize == 0);
    let unsettled = unknown_list(mesh, labels);
    let mut settled = Settled { oversize, unsettled, ..Settled::default() };
    let mut grain_of = vec![NONE; bodies.parts.len()];
    for (part, grain) in bodies.parts.iter().zip(&mut grain_of) {
        if !mesh.in_core[part.lowest as usize] {
            continue;
        }
        if !part.closed() {
            let lowest = part.lowest;
            let id = bodies.of[lowest as usize];
            settled
                .unsettled
                .extend((0..state.len() as u32).filter(|&t| bodies.of[t as usize] == id && mesh.in_core[t as usize]));
        } else if part.size >= sizes.smallest {
            *grain = settled.grains.len() as u32;
            settled.grains.push(Segment { triangles: Vec::new(), at_mesh_edge: part.at_mesh_edge });
        }
    }
    for (t, &part) in bodies.of.iter().enumerate() {
        if let Some(&grain) = grain_of.get(part as usize)
            && grain != NONE
        {
            settled.grains[grain as usize].triangles.push(t as u32);
        }
    }
    settled
}
