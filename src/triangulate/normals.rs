//! Which way the surface faces at every point: the plane that fits the points around it, and its upper, or outer, side.

use super::Site;
use super::near::Neighbour;
use crate::geometry::DVec3;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// Points around a point that its plane is fitted to.
pub(super) const FITTED: usize = 16;
/// A plane that is less steep than this faces up: cosine of its slope.
const CLEARLY_UP: f64 = 0.25;
/// How many times steep planes are turned as those around them are. Each looks further than the one before.
pub(super) const TURNS: usize = 6;

/// The sides to which planes face.
pub(super) struct Facing {
    /// Unit normals; zero where nobody looked.
    pub(super) normals: Vec<DVec3>,
    known: Vec<bool>,
    /// Points whose side is open, and where the points around each start, with the end behind the last.
    open: Vec<u32>,
    start: Vec<usize>,
    around: Vec<u32>,
}

impl Facing {
    /// Nothing is known of so many points.
    pub(super) fn new(points: usize) -> Facing {
        Facing {
            normals: vec![DVec3::ZERO; points],
            known: vec![false; points],
            open: Vec::new(),
            start: vec![0],
            around: Vec::new(),
        }
    }

    /// Fits the plane of a point to its neighbours, nearest first. Those up to `turn_reach_m` away will say to which side
    /// it faces, if it is steep, or covered from above.
    pub(super) fn fit(
        &mut self,
        point: usize,
        (sites, found): (&[Site], &[Neighbour]),
        turn_reach_m: f64,
        is_covered: impl FnOnce() -> bool,
    ) -> DVec3 {
        let fitted = &found[..found.len().min(FITTED)];
        let normal = plane_normal(fitted.iter().map(|n| sites[n.1 as usize].at - sites[point].at));
        self.normals[point] = normal;
        self.known[point] = normal.z >= CLEARLY_UP && !is_covered();
        if !self.known[point] {
            self.open.push(point as u32);
            let near = fitted.iter().take_while(|n| n.0 <= turn_reach_m * turn_reach_m);
            self.around.extend(near.map(|n| n.1));
            self.start.push(self.around.len());
        }
        normal
    }

    /// Points whose side is still open.
    pub(super) fn open(&self) -> impl Iterator<Item = usize> + '_ {
        self.open.iter().map(|&point| point as usize).filter(|&point| !self.known[point])
    }

    /// Turns open planes to the side to which those around them face, from those that clearly face up. Returns which
    /// were turned over.
    pub(super) fn turn(&mut self) -> Vec<bool> {
        let mut turned = vec![false; self.normals.len()];
        for _ in 0..TURNS {
            let mut agreed = Vec::new();
            for (i, &point) in self.open.iter().enumerate().filter(|&(_, &point)| !self.known[point as usize]) {
                let around = self.around[self.start[i]..self.start[i + 1]].iter().map(|&j| j as usize);
                let normal = self.normals[point as usize];
                let sum: f64 = around.filter(|&j| self.known[j]).map(|j| self.normals[j].dot(normal)).sum();
                if sum != 0.0 {
                    agreed.push((point as usize, sum < 0.0));
                }
            }
            for (point, over) in agreed {
                self.known[point] = true;
                if over {
                    turned[point] = true;
                    self.normals[point] = -self.normals[point];
                }
            }
        }
        turned
    }
}

/// Normal of the plane that fits the origin and points around it best, facing up.
fn plane_normal(points: impl ExactSizeIterator<Item = DVec3> + Clone) -> DVec3 {
    let n = points.len() as f64 + 1.0;
    let mean = points.clone().fold(DVec3::ZERO, |sum, p| sum + p) / n;
    let mut spread = Matrix3::<f64>::zeros();
    for p in points.chain([DVec3::ZERO]) {
        let d = Vector3::from((p - mean).to_array());
        spread += d * d.transpose();
    }
    let eigen = SymmetricEigen::new(spread);
    let least = (0..3).min_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b])).unwrap_or(2);
    let normal = DVec3::from_array(eigen.eigenvectors.column(least).into_owned().into()).normalize_or(DVec3::Z);
    // A plane that stands upright has no upper side: the sign is at least the same in every block.
    if (normal.z, normal.y, normal.x) < (0.0, 0.0, 0.0) { -normal } else { normal }
}
