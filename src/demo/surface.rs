//! The surface of the sampled bed by surface nets (Gibson 1998), one vertex per sheet in each voxel.
//!
//! A voxel that two sheets cross gets two vertices (dual marching cubes, Nielson 2004), so that every
//! edge has at most two triangles.

use super::voxels::Voxels;
use crate::geometry::DVec3;

/// Triangles over shared vertices, metres.
#[derive(Debug, Clone, Default)]
pub(super) struct Mesh {
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// No vertex in this voxel.
const EMPTY: u32 = u32::MAX;

/// The surface where the sign changes, facing outward; open at the sides of the grid.
pub(super) fn polygonise(voxels: &Voxels) -> Mesh {
    let mut mesh = Mesh::default();
    let mut slots = vec![EMPTY; voxels.value.len()];
    let mut sheets: Vec<[u32; 12]> = Vec::new();
    let [nx, ny, nz] = voxels.size;
    for k in 0..nz - 1 {
        for j in 0..ny - 1 {
            for i in 0..nx - 1 {
                if let Some(vertex_of_edge) = crossed_voxel(voxels, [i, j, k], &mut mesh.vertices) {
                    slots[voxels.index([i, j, k])] = sheets.len() as u32;
                    sheets.push(vertex_of_edge);
                }
            }
        }
    }
    for k in 1..nz - 1 {
        for j in 0..ny - 1 {
            for i in 0..nx - 1 {
                for axis in 0..3 {
                    if let Some(quad) = quad(voxels, [i, j, k], axis, (&slots, &sheets)) {
                        split(&mut mesh, quad);
                    }
                }
            }
        }
    }
    mesh
}

/// Corner `c` of a voxel lies at bit 0 of `c` in x, bit 1 in y, bit 2 in z. Edge `4 axis + o1 + 2 o2`
/// runs along `axis`, at `o1` in the next axis (cyclic) and `o2` in the one after.
fn edge_corners(edge: usize) -> [usize; 2] {
    let (axis, o1, o2) = (edge / 4, edge & 1, edge >> 1 & 1);
    let start = o1 << ((axis + 1) % 3) | o2 << ((axis + 2) % 3);
    [start, start | 1 << axis]
}

/// Places the vertices of a voxel that the surface crosses; gives the vertex of each crossed edge.
fn crossed_voxel(voxels: &Voxels, at: [usize; 3], vertices: &mut Vec<DVec3>) -> Option<[u32; 12]> {
    let value: [f32; 8] =
        std::array::from_fn(|c| voxels.value[voxels.index([at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)])]);
    let inside = value.map(|v| v < 0.0);
    if inside.iter().all(|&s| s == inside[0]) {
        return None;
    }
    let crossed: [bool; 12] = std::array::from_fn(|e| {
        let [a, b] = edge_corners(e);
        inside[a] != inside[b]
    });
    let sheet = sheets_of(&crossed);
    let mut vertex_of_edge = [EMPTY; 12];
    for root in 0..12 {
        let members = (0..12).filter(|&e| crossed[e] && sheet[e] == root);
        let points = members.clone().map(|e| {
            let [a, b] = edge_corners(e);
            let t = f64::from(value[a]) / (f64::from(value[a]) - f64::from(value[b]));
            let corner = |c: usize| DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64);
            corner(a).lerp(corner(b), t.clamp(0.02, 0.98))
        });
        let (sum, count) = points.fold((DVec3::ZERO, 0.0), |(sum, count), p| (sum + p, count + 1.0));
        if count > 0.0 {
            let base = DVec3::new(at[0] as f64, at[1] as f64, at[2] as f64);
            members.for_each(|e| vertex_of_edge[e] = vertices.len() as u32);
            vertices.push(voxels.origin + (base + sum / count) * voxels.voxel_m);
        }
    }
    Some(vertex_of_edge)
}

/// Joins crossed edges that share a face: the smallest edge of each edge's sheet.
fn sheets_of(crossed: &[bool; 12]) -> [usize; 12] {
    let mut sheet: [usize; 12] = std::array::from_fn(|e| e);
    for axis in 0..3 {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in 0..2 {
            let face = [4 * b + 2 * side, 4 * b + 1 + 2 * side, 4 * c + side, 4 * c + side + 2];
            let mut cut = face.into_iter().filter(|&e| crossed[e]);
            if let (Some(first), Some(second)) = (cut.next(), cut.next()) {
                let (low, high) = (sheet[first].min(sheet[second]), sheet[first].max(sheet[second]));
                sheet.iter_mut().filter(|s| **s == high).for_each(|s| *s = low);
            }
        }
    }
    sheet
}

/// The vertices around a grid edge that the surface crosses, counter-clockwise from outside.
fn quad(voxels: &Voxels, at: [usize; 3], axis: usize, net: (&[u32], &[[u32; 12]])) -> Option<[u32; 4]> {
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut end = at;
    end[axis] += 1;
    if at[b] == 0 || at[c] == 0 {
        return None;
    }
    let starts_inside = voxels.value[voxels.index(at)] < 0.0;
    if starts_inside == (voxels.value[voxels.index(end)] < 0.0) {
        return None;
    }
    let mut around = [EMPTY; 4];
    for (vertex, (o1, o2)) in around.iter_mut().zip([(0, 0), (1, 0), (1, 1), (0, 1)]) {
        let mut voxel = at;
        voxel[b] -= o1;
        voxel[c] -= o2;
        let slot = net.0[voxels.index(voxel)];
        if slot == EMPTY {
            return None;
        }
        *vertex = net.1[slot as usize][4 * axis + o1 + 2 * o2];
    }
    if !starts_inside {
        around.reverse();
    }
    Some(around)
}

/// Two triangles along the shorter diagonal.
fn split(mesh: &mut Mesh, [a, b, c, d]: [u32; 4]) {
    let apart = |i: u32, j: u32| mesh.vertices[i as usize].distance_squared(mesh.vertices[j as usize]);
    let halves = if apart(a, c) <= apart(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
    mesh.triangles.extend(halves);
}
