//! The triangles of one grain with vertices of their own, numbered from 0: what all measures work on.

use crate::geometry::DVec3;
use crate::tile::TileMesh;

/// A piece of a tile's mesh. Its order is that of the global ids, and so the same in every tile.
#[derive(Debug, Clone, Default)]
pub struct Patch {
    /// The tile's numbers of the vertices, ascending, each once.
    pub vertices: Vec<u32>,
    /// Their positions, local metres.
    pub points: Vec<DVec3>,
    /// The corners of every triangle, as places in `points`.
    pub corners: Vec<[u32; 3]>,
}

impl Patch {
    /// The patch of some triangles of a tile, ascending.
    pub fn of(mesh: &TileMesh, triangles: &[u32]) -> Patch {
        let global = || triangles.iter().map(|&t| mesh.triangles[t as usize]);
        let places = Places::of(global());
        let vertices = places.vertices();
        Patch {
            points: vertices.iter().map(|&v| mesh.positions[v as usize]).collect(),
            corners: global().map(|corners| corners.map(|v| places.of_vertex(v))).collect(),
            vertices,
        }
    }

    /// Corners of every triangle, local metres.
    pub fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.corners.iter().map(|corners| corners.map(|i| self.points[i as usize]))
    }
}

/// A set of vertices that knows the place of each in their ascending order.
enum Places {
    /// For every 32 numbers from the lowest on, one bit each, and above these how many are in the set before them.
    Dense { lowest: u32, words: Vec<u64> },
    /// All numbers, ascending: for few vertices far apart in a large tile.
    Sparse(Vec<u32>),
}

impl Places {
    fn of(corners: impl ExactSizeIterator<Item = [u32; 3]> + Clone) -> Places {
        let (mut lowest, mut highest) = (u32::MAX, 0);
        for [a, b, c] in corners.clone() {
            (lowest, highest) = (lowest.min(a).min(b).min(c), highest.max(a).max(b).max(c));
        }
        let words = (highest.saturating_sub(lowest) / 32) as usize + 1;
        if words > 16 * corners.len() {
            let mut sorted: Vec<u32> = corners.flatten().collect();
            sorted.sort_unstable();
            sorted.dedup();
            return Places::Sparse(sorted);
        }
        let mut words = vec![0u64; words];
        for v in corners.flatten() {
            words[((v - lowest) / 32) as usize] |= 1 << ((v - lowest) % 32);
        }
        let mut count = 0;
        for word in &mut words {
            let here = word.count_ones();
            *word |= count << 32;
            count += u64::from(here);
        }
        Places::Dense { lowest, words }
    }

    /// All vertices, ascending.
    fn vertices(&self) -> Vec<u32> {
        match self {
            Places::Sparse(sorted) => sorted.clone(),
            Places::Dense { lowest, words } => {
                let mut vertices = Vec::new();
                for (first, &word) in (*lowest..).step_by(32).zip(words) {
                    let mut left = word as u32;
                    while left != 0 {
                        vertices.push(first + left.trailing_zeros());
                        left &= left - 1;
                    }
                }
                vertices
            }
        }
    }

    /// How many vertices of the set come before one that is in it.
    fn of_vertex(&self, v: u32) -> u32 {
        match self {
            Places::Sparse(sorted) => sorted.partition_point(|&other| other < v) as u32,
            Places::Dense { lowest, words } => {
                let word = words[((v - lowest) / 32) as usize];
                (word >> 32) as u32 + (word as u32 & ((1 << ((v - lowest) % 32)) - 1)).count_ones()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keeps_order_and_corners(stride: u32) {
        let n = 500 * stride + 1;
        let mesh = TileMesh {
            positions: (0..n).map(|v| DVec3::splat(f64::from(v))).collect(),
            triangles: (0..100u32)
                .map(|t| [t * 7 % 501, t * 13 % 501, (t + 1) * 5 % 501].map(|v| v * stride))
                .collect(),
            ..TileMesh::default()
        };
        let triangles: Vec<u32> = (0..100).step_by(3).collect();
        let patch = Patch::of(&mesh, &triangles);
        assert!(patch.vertices.is_sorted_by(|a, b| a < b));
        for (&t, corners) in triangles.iter().zip(patch.triangles()) {
            assert_eq!(mesh.corners(t), corners);
        }
        let used: std::collections::BTreeSet<u32> = patch.corners.iter().flatten().copied().collect();
        assert_eq!(used.into_iter().collect::<Vec<_>>(), (0..patch.points.len() as u32).collect::<Vec<_>>());
    }

    #[test]
    fn vertices_close_together_keep_their_order_and_triangles_their_corners() {
        keeps_order_and_corners(1);
    }

    #[test]
    fn vertices_far_apart_keep_their_order_and_triangles_their_corners() {
        keeps_order_and_corners(1000);
    }

    #[test]
    fn no_triangles_have_no_vertices() {
        let patch = Patch::of(&TileMesh::default(), &[]);
        assert!(patch.vertices.is_empty() && patch.corners.is_empty());
    }
}
