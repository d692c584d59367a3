//! The vertices of a tile in bands, with the triangles near each: what all threads can work on at once.

use crate::tile::TileMesh;
use rayon::prelude::*;
use std::ops::Range;

/// Triangles that are passed over at once where none of them has a vertex in a band.
const BLOCK: usize = if cfg!(test) { 3 } else { 1 << 11 };
/// Vertices that one thread marks at a time: few enough for the processor's cache, many enough that most triangles have
/// all theirs in one band.
const MARKED: usize = if cfg!(test) { 5 } else { 1 << 17 };

/// Where the triangles are that have vertices in a band.
pub struct Bands<'m> {
    pub(super) mesh: &'m TileMesh,
    /// Lowest and highest vertex of each block of triangles.
    reach: Vec<[u32; 2]>,
}

impl Bands<'_> {
    /// Looks where the triangles of a tile are.
    pub fn of(mesh: &TileMesh) -> Bands<'_> {
        let reach = |block: &[[u32; 3]]| {
            block.as_flattened().iter().fold([u32::MAX, 0], |[low, high], &v| [low.min(v), high.max(v)])
        };
        Bands { mesh, reach: mesh.triangles.par_chunks(BLOCK).map(reach).collect() }
    }

    /// Blocks of triangles, some of which have vertices in a band; ascending.
    pub(super) fn near<'a>(&'a self, vertices: &'a Range<usize>) -> impl Iterator<Item = Range<usize>> + 'a {
        let meets = |[low, high]: [u32; 2]| (low as usize) < vertices.end && high as usize >= vertices.start;
        let block = |i: usize| BLOCK * i..(BLOCK * (i + 1)).min(self.mesh.triangles.len());
        self.reach.iter().enumerate().filter(move |(_, reach)| meets(**reach)).map(move |(i, _)| block(i))
    }

    /// Lets every triangle of which `of` says something leave a mark at its three vertices: each vertex gets those of
    /// its triangles one after the other, the lowest triangle's first.
    pub(super) fn mark<T: Send, M: Copy>(
        &self,
        values: &mut [T],
        of: impl Fn(usize) -> Option<M> + Sync,
        put: impl Fn(&mut T, M) + Sync,
    ) {
        values.par_chunks_mut(MARKED).enumerate().for_each(|(band, values)| {
            let first = MARKED * band;
            for t in self.near(&(first..first + values.len())).flatten() {
                let Some(mark) = of(t) else { continue };
                for v in self.mesh.triangles[t] {
                    if let Some(value) = values.get_mut((v as usize).wrapping_sub(first)) {
                        put(value, mark);
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;

    #[test]
    fn every_vertex_is_marked_by_its_triangles_in_their_order() {
        let mut seed = 5u64;
        let mut below = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        for _ in 0..300 {
            let (vertices, faces) = (1 + below(60), below(80));
            let mesh = TileMesh {
                triangles: (0..faces).map(|_| [0; 3].map(|_| below(vertices) as u32)).collect(),
                positions: vec![DVec3::ZERO; vertices as usize],
                ..TileMesh::default()
            };
            let said = |t: usize| (!t.is_multiple_of(3)).then_some(t);
            let mut marks = vec![Vec::new(); vertices as usize];
            Bands::of(&mesh).mark(&mut marks, said, |marks, t| marks.push(t));
            let mut expected = vec![Vec::new(); vertices as usize];
            for (t, corners) in mesh.triangles.iter().enumerate().filter(|(t, _)| t % 3 != 0) {
                corners.iter().for_each(|&v| expected[v as usize].push(t));
            }
            assert_eq!(marks, expected);
        }
    }
}
