//! Settling: which grains a tile may publish, and where it must look further.

use super::Sizes;
use super::adjacency::Adjacency;
use super::components::Components;
use super::state::{Labels, NONE, OVERSIZE, State, unknown};
use crate::geometry::{ExactSum, PlanBox};
use crate::tile::TileMesh;
use serde::{Deserialize, Serialize};

/// What a tile found.
///
/// **What may be published.** Every grain here is one of the untiled run, whole. A grain of the untiled run
/// whose lowest triangle lies in the core is either here, or its lowest triangle is in `unsettled`, never both.
/// So the rest can be sought with a wider halo around the unsettled triangles alone, if only grains are taken
/// whose lowest triangle is one of them: none is lost, none comes twice. Proof: let t be the lowest triangle
/// of a grain, in the core. What is known is true, so t is unknown at the end, and unsettled; or it is kept, and
/// what is seen of its body is a part of the grain, whose lowest triangle is t again. If that part is closed,
/// it is the grain, and published; else all its core triangles are unsettled, t among them. A published
/// triangle is not unsettled: no step turns an unknown triangle into a kept one.
///
/// Likewise every core triangle of an oversize body is in one of the pieces here, or in `unsettled`.
#[derive(Debug, Clone, Default)]
pub struct Settled {
    /// The grains that the tile's core owns and that are certain, by ascending lowest triangle.
    pub grains: Vec<Segment>,
    /// Pieces of oversize bodies inside the core.
    pub oversize: Vec<OversizePiece>,
    /// Core triangles whose fate this tile does not know: local numbers, ascending, each once. They were
    /// unknown when bodies were told apart, or are at the end, or belong to a body that is not whole and
    /// whose lowest triangle lies in the core.
    ///
    /// A body that is not whole is no reason to look further when a triangle of it outside the core lies lower
    /// than all in it: every core triangle is known, so its lowest triangle cannot be here.
    pub unsettled: Vec<u32>,
}

/// What speaks for a grain, as far as the method tells; of vertices, areas in m².
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Mean of the least bending along the rim, in 1 over the mean edge length: how sharp its border is; far below 0 where
    /// valleys surround it.
    pub rim_bend: f64,
    /// Share of the rim where it ends without meeting anything, 0 to 1.
    pub free_rim: f64,
    /// Mean curvature times the square root of the area: 2.5 for half a ball, 0 for a plane.
    pub bulge: f64,
    /// Share of the area that lies away from valleys, and was not only grown into.
    pub core_share: f64,
    /// Patches that were joined.
    pub patches: u32,
}

/// The triangles of one grain.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Segment {
    /// Local triangle numbers, ascending.
    pub triangles: Vec<u32>,
    /// Whether an edge of the mesh (survey border, scan shadow) bounds it.
    pub at_mesh_edge: bool,
    /// What speaks for it; none where the method does not tell.
    pub evidence: Option<Evidence>,
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
    /// The edges, each by the survey's numbers of its two vertices, the lower first, beyond which the body may go
    /// on outside the core. Pieces that name the same edge are parts of one body.
    pub crossings: Vec<[u64; 2]>,
}

/// Oversize bodies as they stand before dilation.
#[derive(Debug, Clone, Default)]
pub struct Oversize {
    /// Their pieces in the core, by ascending lowest triangle of the body.
    pub pieces: Vec<OversizePiece>,
    /// Core triangles that may be part of a body. A later step may remove such a triangle for sure.
    pub unknown: Vec<u32>,
}

/// Gathers the pieces of oversize bodies that lie in the core.
pub fn oversize_pieces(mesh: &TileMesh, adjacency: &Adjacency, labels: &Labels) -> Oversize {
    let of_body = |t: usize| labels.label[t] == OVERSIZE;
    let inside = |t: usize| of_body(t) && mesh.in_core[t];
    let outside = |t: usize| of_body(t) && !mesh.in_core[t];
    let mut found = Oversize { unknown: unknown(&labels.state), ..Oversize::default() };
    found.unknown.retain(|&t| mesh.in_core[t as usize]);
    let any_of = |block: &[u32]| block.iter().fold(false, |any, &label| any | (label == OVERSIZE));
    if !labels.label.chunks(1024).any(any_of) {
        return found;
    }
    let bodies = Components::of(adjacency, of_body);
    let unknown_or_outside = |t: usize| labels.state[t] == State::Unknown || outside(t);
    let mut forked: Vec<u32> = adjacency.forks().flatten().copied().collect();
    forked.sort_unstable();
    found.pieces = vec![OversizePiece::default(); bodies.count()];
    for t in (0..labels.label.len()).filter(|&t| inside(t)) {
        let piece = &mut found.pieces[bodies.of[t] as usize];
        if piece.triangles == 0 {
            piece.anchor = mesh.triangle_id(t as u32);
        }
        piece.triangles += 1;
        piece.area_m2.add(mesh.area_m2(t as u32));
        let bounds = piece.bounds.get_or_insert(PlanBox::EMPTY);
        mesh.corners(t as u32).into_iter().for_each(|c| bounds.include(c));
        let corners = mesh.triangles[t];
        let forked = forked.binary_search(&(t as u32)).is_ok();
        for (i, &side) in adjacency.sides(t).iter().enumerate() {
            let ends = [corners[i], corners[(i + 1) % 3]];
            let cut_off = ends.iter().all(|&v| !mesh.complete[v as usize]);
            if forked || cut_off || unknown_or_outside(side as usize) {
                let [a, b] = ends.map(|v| mesh.vertex_id(v));
                piece.crossings.push([a.min(b), a.max(b)]);
            }
        }
    }
    found.pieces.retain(|p| p.triangles > 0);
    found
}

/// Drops small bodies for the last time and sorts out what the core may publish.
///
/// A grain is owned through its lowest triangle.
pub fn settle(mesh: &TileMesh, adjacency: &Adjacency, sizes: &Sizes, labels: &Labels, oversize: Oversize) -> Settled {
    let bodies = Components::sized(mesh, adjacency, sizes, |t| labels.label[t] < OVERSIZE);
    let unknown = unknown(&labels.state);
    let open = bodies.holding(adjacency.open());
    let at_mesh_edge = bodies.holding(adjacency.at_mesh_edge());
    let doubtful = bodies.beside(adjacency, &unknown);
    let triangles = bodies.fold(0, |_| true, |count, run| count + run.len(), |a, b| a + b);
    let owned = |part: usize| mesh.in_core[bodies.lowest[part] as usize];
    let closed = |part: usize| !open[part] && !doubtful[part];
    let mut grains: Vec<Option<Segment>> = (0..bodies.count())
        .map(|part| {
            let publish = owned(part) && closed(part) && bodies.size[part] >= sizes.smallest;
            let segment =
                |n| Segment { triangles: Vec::with_capacity(n), at_mesh_edge: at_mesh_edge[part], evidence: None };
            publish.then(|| segment(triangles[part]))
        })
        .collect();
    let mut unsettled = oversize.unknown;
    unsettled.extend(unknown.into_iter().filter(|&t| mesh.in_core[t as usize]));
    for (part, run) in bodies.runs().filter(|(part, _)| *part != NONE) {
        let part = part as usize;
        let run = run.start as u32..run.end as u32;
        if let Some(grain) = &mut grains[part] {
            grain.triangles.extend(run);
        } else if owned(part) && !closed(part) {
            unsettled.extend(run.filter(|&t| mesh.in_core[t as usize]));
        }
    }
    unsettled.sort_unstable();
    unsettled.dedup();
    Settled { grains: grains.into_iter().flatten().collect(), oversize: oversize.pieces, unsettled }
}
