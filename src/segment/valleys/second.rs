//! The second look: at the ground that nothing claimed, and with calmer eyes.
//!
//! In the gaps of a crowded bed few cameras see the stones, and the surface is so rough that most of it counts as valley.
//! What was left over by the first look, and does not face down, is a small mesh of its own: its normals are smoothed more, which
//! disturbs no neighbour, and the same steps find seeds and cores on it. Then growth goes on, with the cores of both.

use super::cores::Cores;
use super::judge::{Judged, judge};
use super::look::Look;
use super::neighbours::Neighbours;
use super::{NONE, Surface, UNKNOWN};
use crate::geometry::DVec3;
use crate::index::Scale;
use crate::segment::bands::Bands;
use crate::settings::SegmentSettings;
use crate::tile::TileMesh;
use rayon::prelude::*;

/// What faces further down than this (upward part of the unit normal) no camera above the bed has seen.
const DOWN: f32 = -0.3;

/// The ground that nothing claimed and that does not face down, as a mesh of its own.
struct Left {
    /// The tile's number of each vertex, ascending.
    vertices: Vec<u32>,
    mesh: TileMesh,
}

/// Adds to the cores of a first look, from which `grown` grew, those that are found in what it left over; tells whether it
/// found any, or might have.
pub(super) fn look_again(
    (mesh, surface): (&TileMesh, &Surface),
    grown: &[u32],
    (cores, judged): (&mut Cores, &mut Vec<Judged>),
    (scale, segment, look): (&Scale, &SegmentSettings, &Look),
) -> bool {
    let vertices = left_over(surface, grown);
    let may_hold = |v: &u32| f64::from(surface.normals.area_m2[*v as usize]);
    let in_doubt = surface.unknown.is_some();
    if !in_doubt && vertices.iter().map(may_hold).sum::<f64>() < look.seed_area_m2 {
        return false;
    }
    let left = Left::of(mesh, &surface.neighbours, grown, vertices);
    let found_on = Surface::of(&left.mesh, &Bands::of(&left.mesh), scale, look);
    let ground = found_on.ground(&left.mesh, scale);
    let found = Cores::of(&ground, look);
    let first = cores.count() as u32;
    judged.extend(judge(&ground, &found, (segment, look)).into_iter().map(|core| {
        let vertices = core.vertices.iter().map(|&v| left.vertices[v as usize]).collect();
        Judged { vertices, ..core }
    }));
    cores.open.extend(&found.open);
    // What may have been left over may be part of a core.
    cores
        .of
        .par_iter_mut()
        .zip(grown)
        .filter(|(core, grown)| **core == NONE && **grown == UNKNOWN)
        .for_each(|(core, _)| *core = UNKNOWN);
    for (&v, &core) in left.vertices.iter().zip(&found.of) {
        cores.of[v as usize] = if core < UNKNOWN { first + core } else { core };
    }
    in_doubt || !found.open.is_empty()
}

impl Left {
    fn of(mesh: &TileMesh, neighbours: &Neighbours, grown: &[u32], vertices: Vec<u32>) -> Left {
        if vertices.is_empty() {
            return Left { vertices, mesh: TileMesh::default() };
        }
        let mut place = vec![NONE; grown.len()];
        (0u32..).zip(&vertices).for_each(|(here, &v)| place[v as usize] = here);
        let triangles: Vec<[u32; 3]> = mesh
            .triangles
            .par_iter()
            .map(|corners| corners.map(|v| place[v as usize]))
            .filter(|corners| corners.iter().all(|&v| v != NONE))
            .collect();
        let positions: Vec<DVec3> = vertices.iter().map(|&v| mesh.positions[v as usize]).collect();
        let complete = vertices.iter().map(|&v| is_complete(mesh, neighbours, grown, v as usize)).collect();
        Left { mesh: TileMesh { positions, complete, triangles, ..TileMesh::default() }, vertices }
    }
}

/// The vertices that surely nothing claimed, and that do not face down, ascending.
fn left_over(surface: &Surface, grown: &[u32]) -> Vec<u32> {
    let is_left = |v: usize| grown[v] == NONE && surface.normals.unit[v].z > DOWN;
    (0..grown.len()).into_par_iter().filter(|&v| is_left(v)).map(|v| v as u32).collect()
}

/// Whether of all triangles around a vertex it is known which of their corners are left over.
fn is_complete(mesh: &TileMesh, neighbours: &Neighbours, grown: &[u32], v: usize) -> bool {
    mesh.complete[v] && neighbours.around(v).iter().all(|&u| grown[u as usize] != UNKNOWN)
}
