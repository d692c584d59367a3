//! Normals of the vertices, smoothed along the surface but not across creases.

use super::lanes::{self, Lanes};
use super::neighbours::Neighbours;
use crate::segment::bands::Bands;
use glam::{Vec3A, Vec4};
use rayon::prelude::*;

/// Normals and areas of the vertices of a tile.
pub struct Normals {
    /// Unit normals by the right-hand rule; zero where none is.
    pub unit: Vec<Vec3A>,
    /// A third of the triangles around each vertex, m².
    pub area_m2: Vec<f32>,
}

impl Normals {
    /// Area-weighted normals of the vertices. Sums run by ascending triangle.
    pub fn of(bands: &Bands) -> Normals {
        let mesh = bands.mesh;
        let mut sums = vec![Vec4::ZERO; mesh.positions.len()];
        let of = |t: usize| {
            let [a, b, c] = mesh.corners(t as u32);
            let normal = (b - a).as_vec3a().cross((c - a).as_vec3a());
            // Half of its length is the area of the triangle.
            Some(normal.extend(normal.length() / 6.0))
        };
        bands.mark(&mut sums, of, |sum, normal_and_area| *sum += normal_and_area);
        let unit = sums.par_iter().map(|sum| Vec3A::from_vec4(*sum).normalize_or_zero()).collect();
        Normals { unit, area_m2: sums.par_iter().map(|sum| sum.w).collect() }
    }

    /// Takes the mean over each vertex and its neighbours, so many times, weighted by area and by how alike the
    /// normals are: those that differ by `crease` (length of the difference of unit normals) weigh a quarter.
    ///
    /// What a vertex gets depends on as many rings of neighbours as there are passes.
    pub fn smooth(&mut self, neighbours: &Neighbours, passes: u32, crease: f32) {
        let sharpness = 1.0 / (crease * crease);
        // Normal and area together: one place in memory for each neighbour.
        let mut now: Vec<Vec4> = self.unit.iter().zip(&self.area_m2).map(|(n, &area)| n.extend(area)).collect();
        let vertices = now.len();
        // Where a ring of neighbours is filled up there is nothing, which weighs nothing.
        now.push(Vec4::ZERO);
        let mut next = vec![Vec4::ZERO; now.len()];
        for _ in 0..passes {
            next[..vertices].par_iter_mut().enumerate().with_min_len(1 << 12).for_each(|(v, next)| {
                *next = mean_around(&now, v, neighbours, sharpness);
            });
            std::mem::swap(&mut now, &mut next);
        }
        self.unit.par_iter_mut().zip(&now).for_each(|(unit, now)| *unit = Vec3A::from_vec4(*now));
    }
}

/// The mean normal of a vertex and its neighbours, with the vertex's own area. All are given with their areas, and
/// behind the last vertex nothing.
#[inline]
fn mean_around(normals: &[Vec4], v: usize, neighbours: &Neighbours, sharpness: f32) -> Vec4 {
    let own = normals[v];
    let mut sums = [Vec4::ZERO; 3];
    neighbours.each_four(v, |four| {
        let Lanes { x, y, z, w: area } = Lanes::of(four.map(|u| normals[u as usize]));
        let [across, along, up] = [x - own.x, y - own.y, z - own.z];
        let unlike = Vec4::ONE + (across * across + along * along + up * up) * sharpness;
        let weight = area / (unlike * unlike);
        sums = [sums[0] + x * weight, sums[1] + y * weight, sums[2] + z * weight];
    });
    let mean = Vec3A::from_vec4(own) * own.w + Vec3A::from_array(sums.map(lanes::sum));
    mean.normalize_or_zero().extend(own.w)
}
