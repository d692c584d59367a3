//! A sample of a core, and how two of them lie to each other.

use super::cores::Ground;
use crate::geometry::DVec3;

/// Vertices of a core that are compared, at most.
const SAMPLE: usize = 150;

/// A sample of a core: places and normals, in the order of the vertices.
#[derive(Debug, Clone)]
pub struct Patch {
    /// Places, local metres.
    pub points: Vec<DVec3>,
    normals: Vec<DVec3>,
}

impl Patch {
    /// A sample of some vertices.
    pub fn of(ground: &Ground, vertices: &[u32]) -> Patch {
        let sample = || vertices.iter().step_by(vertices.len().div_ceil(SAMPLE).max(1));
        Patch {
            points: sample().map(|&v| ground.positions[v as usize]).collect(),
            normals: sample().map(|&v| ground.normals[v as usize].as_dvec3()).collect(),
        }
    }

    /// How far each point lies from the nearest of another patch, and each of that from the nearest of this one, m.
    pub fn gaps_m(&self, other: &Patch) -> [Vec<f64>; 2] {
        let mut theirs = vec![f64::INFINITY; other.points.len()];
        let mut ours = Vec::with_capacity(self.points.len());
        for p in &self.points {
            let mut nearest = f64::INFINITY;
            for (q, theirs) in other.points.iter().zip(&mut theirs) {
                let squared = (*q - *p).length_squared();
                nearest = nearest.min(squared);
                *theirs = theirs.min(squared);
            }
            ours.push(nearest.sqrt());
        }
        theirs.iter_mut().for_each(|squared| *squared = squared.sqrt());
        [ours, theirs]
    }

    /// Whether the points of another patch rise, in the mean, less steeply than `most` over the tangent planes of those of
    /// this one's points that have a gap no wider: the mean of the sines, where what lies below counts 0.
    pub fn rises_less(&self, gaps_m: &[f64], widest_m: f64, other: &Patch, most: f64) -> bool {
        let near = || self.points.iter().zip(&self.normals).zip(gaps_m).filter(|(_, gap)| **gap <= widest_m);
        // No term is below 0, so that what is too much can be told early.
        let enough = most * (near().count() * other.points.len()) as f64;
        let mut sum = 0.0;
        for ((p, normal), _) in near() {
            for q in &other.points {
                let way = *q - *p;
                sum += (way.dot(*normal) / way.length().max(f64::MIN_POSITIVE)).max(0.0);
            }
            if sum >= enough {
                return false;
            }
        }
        sum < enough
    }
}
