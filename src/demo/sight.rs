//! What a survey from above sees of the bed.

use super::sheet::{BORDER, components, neighbours, sizes};
use super::surface::Mesh;
use super::voxels::Voxels;
use crate::geometry::DVec3;

/// Length of a step along a line of sight, voxels.
const STEP: f64 = 0.8;
/// How far off the surface a line of sight starts, voxels: clear of the voxels that the surface crosses.
const CLEARANCE: f64 = 1.3;
/// A face that a line of sight grazes more closely than this (cosine) is not reconstructed.
const GRAZING: f64 = 0.12;
/// Smaller seen specks and unseen pinholes take the state of what surrounds them, triangles.
const SPECK: usize = 40;

/// Whether each triangle is seen from above or from one of eight oblique directions.
pub(super) fn seen(mesh: &Mesh, voxels: &Voxels, view_limit_deg: f64) -> Vec<bool> {
    let directions = directions(view_limit_deg);
    let across = neighbours(&mesh.triangles);
    let mut seen: Vec<bool> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let start = ((a + b + c) / 3.0 - voxels.origin) / voxels.voxel_m + normal * CLEARANCE;
            directions.iter().any(|&d| normal.dot(d) > GRAZING && clear(voxels, start, d))
        })
        .collect();
    for _ in 0..2 {
        seen = majority(&across, &seen);
    }
    without_specks(&across, &mut seen);
    seen
}

/// The vertical, four directions at half the limit and four at the limit, turned by 45 degrees.
fn directions(view_limit_deg: f64) -> [DVec3; 9] {
    std::array::from_fn(|i| {
        let (tilt, turn) = match i {
            0 => (0.0, 0.0),
            1..=4 => (0.5 * view_limit_deg, 90.0 * i as f64),
            _ => (view_limit_deg, 90.0 * i as f64 + 45.0),
        };
        let ((sin, cos), (turn_sin, turn_cos)) = (tilt.to_radians().sin_cos(), turn.to_radians().sin_cos());
        DVec3::new(sin * turn_cos, sin * turn_sin, cos)
    })
}

fn clear(voxels: &Voxels, start: DVec3, direction: DVec3) -> bool {
    let mut at = start;
    loop {
        match voxels.solid(at) {
            Some(true) => return false,
            Some(false) => at += direction * STEP,
            None => return true,
        }
    }
}

/// Each triangle takes the state of two or three agreeing neighbours: smooths a ragged border.
fn majority(across: &[[u32; 3]], seen: &[bool]) -> Vec<bool> {
    let vote = |(sides, own): (&[u32; 3], &bool)| {
        let votes = sides.iter().filter(|&&n| if n == BORDER { *own } else { seen[n as usize] }).count();
        votes >= 2
    };
    across.iter().zip(seen).map(vote).collect()
}

fn without_specks(across: &[[u32; 3]], seen: &mut [bool]) {
    let (part, count) = components(across, seen);
    let size = sizes(&part, count);
    for (state, &p) in seen.iter_mut().zip(&part) {
        if size[p as usize] < SPECK {
            *state = !*state;
        }
    }
}
