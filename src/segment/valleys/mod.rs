//! Segmentation along valleys: what lies between creases is a stone.
//!
//! | step | file | looks around |
//! |---|---|---|
//! | normals, smoothed along the surface but not across creases | [`normals`] | `normal_passes` + 1 rings of vertices |
//! | least curvature: where it is low, across a crease, is a valley | [`bend`] | one more ring |
//! | seeds: what is further than `bridge_edges` from all valleys | [`cores`] | `bridge_edges`, and a seed |
//! | cores: seeds take back what lies around them on their side of the valleys | [`cores`] | `refill_edges` |
//! | what a core is: a stone, a fragment, or a sheet | [`mod@judge`] | a core |
//! | growth up to the valley line, which is far where it is deep | [`growth`] | `growth_edges` |
//! | all of this once more, smoothed more, on what nothing claimed | [`second`] | the same again, with `second_passes` |
//! | cores of one stone joined, also across a gap | [`joins`] | `join_reach_edges`, and two cores |
//! | grains: triangles by the majority of their vertices | [`settle`] | a grain |
//!
//! Lengths are in mean edge lengths of the survey (`_edges`), so that one default serves meshes of 0.1 mm and of 5 mm.
//!
//! **Certainty.** Vertices whose bending hangs on triangles beyond the halo are unknown, and what could be reached from
//! an unknown vertex as soon as from a known one is unknown as well. A core is whole if nothing unknown lies beside it.
//! A grain is settled if all its cores are whole, nothing unknown lies beside what grew from them, and nothing unknown, nor
//! a core that is not whole, lies where something could be joined to them. Then it is exactly the grain of the untiled run.
//! The second look is cut where the first growth is in doubt: what lies beside that is to it what lies at the cut is to the first.

pub mod bend;
pub mod cores;
pub mod evidence;
pub mod fates;
pub mod flood;
pub mod growth;
pub mod joins;
pub mod judge;
mod lanes;
pub mod look;
pub mod neighbours;
pub mod normals;
pub mod patch;
pub mod second;
pub mod settle;
pub mod spread;

use super::bands::Bands;
use super::settle::Settled;
use super::{Sizes, smallest_grain_area_m2};
use crate::geometry::PlanBox;
use crate::index::Scale;
use crate::settings::{SegmentSettings, ValleySettings};
use crate::tile::TileMesh;
use bend::{Bend, bends};
use cores::{Cores, Ground, beside_unknown};
use evidence::evidence;
use fates::Fates;
use growth::Growth;
use joins::join;
use judge::judge;
use look::Look;
use neighbours::Neighbours;
use normals::Normals;
use second::look_again;

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
    let smallest_m2 = smallest_grain_area_m2(scale, segment);
    let first = Look::first(settings, smallest_m2, scale);
    let surface = Surface::of(mesh, &Bands::of(mesh), scale, &first);
    let ground = surface.ground(mesh, scale);
    let mut cores = Cores::of(&ground, &first);
    let mut judged = judge(&ground, &cores, (segment, &first));
    let mut growth = Growth::over(&ground, settings);
    let mut grown = growth.grow(&cores, &judged);
    if let Some(look) = Look::second(settings, smallest_m2, scale)
        && look_again((mesh, &surface), &grown, (&mut cores, &mut judged), (scale, segment, &look))
    {
        grown = growth.grow(&cores, &judged);
    }
    drop(growth);
    let joined = join(&ground, &cores.of, &judged, mesh.seen.as_ref().unwrap_or(&PlanBox::EVERYWHERE), settings);
    let whole = whole(&surface.neighbours, &cores, &grown);
    let fates = Fates::of(&judged, &joined, whole, segment.max_grain_m);
    let evidence = evidence(&ground, &grown, &judged, &fates);
    settle::settle(mesh, &surface.neighbours, &grown, (&fates, &evidence), &Sizes::new(scale, segment))
}

/// Of which cores nothing that belongs to them, or grew from them, is unknown or lies beside what is.
fn whole(neighbours: &Neighbours, cores: &Cores, grown: &[u32]) -> Vec<bool> {
    let mut whole: Vec<bool> =
        beside_unknown(neighbours, grown, cores.count()).into_iter().map(|beside| !beside).collect();
    // What starts late may have lost its own vertices to what is in doubt, so that none is left to lie beside it.
    for (&core, &grown) in cores.of.iter().zip(grown) {
        if core < UNKNOWN && grown == UNKNOWN {
            whole[core as usize] = false;
        }
    }
    whole
}

/// What the surface is like at every vertex.
pub(super) struct Surface {
    neighbours: Neighbours,
    normals: Normals,
    bends: Vec<Bend>,
    unknown: Option<Vec<bool>>,
}

impl Surface {
    fn of(mesh: &TileMesh, bands: &Bands, scale: &Scale, look: &Look) -> Surface {
        let neighbours = Neighbours::of(bands);
        let mut normals = Normals::of(bands);
        normals.smooth(&neighbours, look.normal_passes, look.crease as f32);
        let bends = bends(&mesh.positions, &neighbours, &normals, scale.mean_edge_m);
        let unknown = within_rings_of_the_cut(mesh, &neighbours, look.normal_passes + 1);
        Surface { neighbours, normals, bends, unknown }
    }

    fn ground<'g>(&'g self, mesh: &'g TileMesh, scale: &Scale) -> Ground<'g> {
        Ground {
            positions: &mesh.positions,
            neighbours: &self.neighbours,
            bends: &self.bends,
            normals: &self.normals.unit,
            unknown: self.unknown.as_deref(),
            area_m2: &self.normals.area_m2,
            mean_edge_m: scale.mean_edge_m,
        }
    }
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
