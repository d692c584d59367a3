//! From the exact surface to one as photogrammetry gives it: cut to what is seen, smoothed, noisy.

use super::random::noise;
use super::sheet::{BORDER, components, neighbours, sizes};
use super::surface::Mesh;
use crate::geometry::DVec3;

/// Wavelength of the noise, edge lengths: matching windows make it spatially correlated.
const NOISE_WAVELENGTH: f64 = 2.5;

/// The parts of the kept triangles that have at least so many of them, with the vertices that they use.
///
/// The largest part stays in any case.
pub(super) fn cut(mesh: &Mesh, keep: &[bool], least: usize) -> Mesh {
    let kept: Vec<[u32; 3]> = mesh.triangles.iter().zip(keep).filter(|&(_, &k)| k).map(|(t, _)| *t).collect();
    let (part, count) = components(&neighbours(&kept), &vec![(); kept.len()]);
    let size = sizes(&part, count);
    let least = least.min(size.iter().copied().max().unwrap_or(0));
    let mut cut = Mesh::default();
    let mut new_id = vec![u32::MAX; mesh.vertices.len()];
    for (triangle, _) in kept.iter().zip(&part).filter(|&(_, &p)| size[p as usize] >= least) {
        cut.triangles.push(triangle.map(|v| {
            let id = &mut new_id[v as usize];
            if *id == u32::MAX {
                *id = cut.vertices.len() as u32;
                cut.vertices.push(mesh.vertices[v as usize]);
            }
            *id
        }));
    }
    cut
}

/// Moves every vertex half way to the mean of its neighbours; a border follows itself only.
pub(super) fn smooth(mesh: &mut Mesh, passes: u32) {
    let across = neighbours(&mesh.triangles);
    let mut on_border = vec![false; mesh.vertices.len()];
    let mut inner = Vec::new();
    let mut border = Vec::new();
    for (triangle, sides) in mesh.triangles.iter().zip(&across) {
        for side in 0..3 {
            let (from, to) = (triangle[side], triangle[(side + 1) % 3]);
            if sides[side] == BORDER {
                border.push((from, to));
                on_border[from as usize] = true;
                on_border[to as usize] = true;
            } else if from < to {
                inner.push((from, to));
            }
        }
    }
    for _ in 0..passes {
        let mut sum = vec![(DVec3::ZERO, 0.0); mesh.vertices.len()];
        let mut pull = |to: u32, from: u32| {
            let entry = &mut sum[to as usize];
            entry.0 += mesh.vertices[from as usize];
            entry.1 += 1.0;
        };
        for &(a, b) in &inner {
            if !on_border[a as usize] {
                pull(a, b);
            }
            if !on_border[b as usize] {
                pull(b, a);
            }
        }
        for &(a, b) in &border {
            pull(a, b);
            pull(b, a);
        }
        for (vertex, (total, count)) in mesh.vertices.iter_mut().zip(sum) {
            if count > 0.0 {
                *vertex = 0.5 * (*vertex + total / count);
            }
        }
    }
}

/// Moves vertices along their normals; `amplitude_m` is about the standard deviation.
pub(super) fn roughen(mesh: &mut Mesh, seed: u64, amplitude_m: f64, edge_m: f64) {
    // Value noise has a deviation of about 0.3.
    let scale = amplitude_m / 0.3;
    let normals = vertex_normals(mesh);
    for (vertex, normal) in mesh.vertices.iter_mut().zip(normals) {
        *vertex += normal * (scale * noise(seed, *vertex / (NOISE_WAVELENGTH * edge_m)));
    }
}

fn vertex_normals(mesh: &Mesh) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; mesh.vertices.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|&v| normals[v as usize] += normal);
    }
    normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
    normals
}
