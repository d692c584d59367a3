//! Segmentation along valleys: what lies between creases is a stone.
//!
//! | step | file | looks around |
//! |---|---|---|
//! | normals, smoothed along the surface but not across creases | [`normals`] | `normal_passes` + 1 rings of vertices |
//! | least curvature: where it is low, across a crease, is a valley | [`bend`] | one more ring |
//! | seeds: what is further than `bridge_edges` from all valleys | [`cores`] | `bridge_edges`, and a seed |
//! | cores: seeds given back what lies around them on their side of the valleys | [`cores`] | `refill_edges` |
//! | growth up to the valley line, which is far where it is deep | [`cores`] | `growth_edges` |
//! | cores of one stone joined, sheets of sand and membranes dropped | [`judge`] | a core, and those beside it |
//! | grains: triangles by the majority of their vertices | [`settle`] | a grain |
//!
//! Lengths are in mean edge lengths of the survey (`_edges`), so that one default serves meshes of 0.1 mm and of 5 mm.
//!
//! **Certainty.** Vertices whose bending hangs on triangles beyond the halo are unknown, and what could be reached from
//! an unknown vertex as soon as from a known one is unknown as well. A core is whole if nothing unknown lies beside it,
//! and a grain is settled if all its cores are whole, nothing unknown lies beside what grew from them, and each
//! neighbour that might be joined to them is whole too. Then it is exactly the grain of the untiled run.

pub mod bend;
pub mod borders;
pub mod cores;
pub mod flood;
pub mod judge;
pub mod neighbours;
pub mod normals;
pub mod settle;

use super::bands::Bands;
use super::settle::Settled;
use super::{Sizes, smallest_grain_area_m2};
use crate::index::Scale;
use crate::settings::{SegmentSettings, ValleySettings};
use crate::tile::TileMesh;
use bend::bends;
use cores::{Cores, Ground, spread};
use flood::parts;
use neighbours::Neighbours;
use normals::Normals;

/// No core, no grain.
pub const NONE: u32 = u32::MAX;
/// Not known: what is not loaded could decide it.
pub const UNKNOWN: u32 = NONE - 1;

/// Segments a tile along its valleys.
pub fn segment_along_valleys(
    mesh: &TileMesh,
    scale: &Scale,
    segment: &SegmentSettings,
    settings: &ValleySettings,
) -> Settled {
    let bands = Bands::of(mesh);
    let neighbours = Neighbours::of(&bands);
    let mut normals = Normals::of(&bands);
    normals.smooth(&neighbours, settings.normal_passes, settings.crease as f32);
    let bends = bends(&mesh.positions, &neighbours, &normals, scale.mean_edge_m);
    let Normals { area_m2, unit } = normals;
    drop(unit);
    let unknown = within_rings_of_the_cut(mesh, &neighbours, settings.normal_passes + 1);
    let ground = Ground {
        positions: &mesh.positions,
        neighbours: &neighbours,
        bends: &bends,
        unknown: unknown.as_deref(),
        area_m2: &area_m2,
        mean_edge_m: scale.mean_edge_m,
    };
    let sizes = Sizes::new(scale, segment);
    let cores = Cores::of(&ground, settings, settings.seed_share * smallest_grain_area_m2(scale, segment));
    let steepness = |v: usize| 1.0 + settings.valley_cost * f64::from(-bends[v].least).max(0.0);
    let uphill = |a: usize, b: usize| Some(parts(ground.edges(a, b) * 0.5 * (steepness(a) + steepness(b))));
    let grown = spread(&ground, &cores.of, parts(settings.growth_edges) as u16, uphill);
    let fates = judge::judge(&ground, &cores, &grown, (segment, settings));
    settle::settle(mesh, &neighbours, &grown, &fates, &sizes)
}

/// Vertices within so many rings of one that is not complete; none where all are.
fn within_rings_of_the_cut(mesh: &TileMesh, neighbours: &Neighbours, rings: u32) -> Option<Vec<bool>> {
    let mut front: Vec<u32> = (0..).zip(&mesh.complete).filter(|(_, complete)| !**complete).map(|(v, _)| v).collect();
    if front.is_empty() {
        return None;
    }
    let mut within: Vec<bool> = mesh.complete.iter().map(|complete| !complete).collect();
    for _ in 0..rings {
        let mut next = Vec::new();
        for &u in front.iter().flat_map(|&v| neighbours.around(v as usize)) {
            if !within[u as usize] {
                within[u as usize] = true;
                next.push(u);
            }
        }
        front = next;
    }
    Some(within)
}
