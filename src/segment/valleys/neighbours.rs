//! Which vertices lie side by side, found once per tile.

use crate::segment::bands::Bands;
use rayon::prelude::*;
use std::ops::Range;

/// Vertices whose neighbours one thread gathers at a time.
const BAND: usize = if cfg!(test) { 7 } else { 1 << 15 };

/// The vertices of a mesh, side by side: joined by an edge of some triangle.
///
/// The neighbours of a vertex stand in the order in which its triangles, lowest first, name them: in every tile that
/// has loaded all of these triangles, in the same.
pub struct Neighbours {
    start: Vec<u32>,
    of: Vec<u32>,
    at_mesh_edge: Vec<bool>,
}

impl Neighbours {
    /// Gathers the neighbours of all vertices.
    pub fn of(bands: &Bands) -> Neighbours {
        let vertices = bands.mesh.positions.len();
        let gathered: Vec<InBand> = (0..vertices.div_ceil(BAND))
            .into_par_iter()
            .map(|band| InBand::of(bands, BAND * band..(BAND * (band + 1)).min(vertices)))
            .collect();
        let mut all = Neighbours {
            start: Vec::with_capacity(vertices + 1),
            of: Vec::with_capacity(gathered.iter().map(|band| band.of.len()).sum()),
            at_mesh_edge: Vec::with_capacity(vertices),
        };
        for band in gathered {
            let before = all.of.len() as u32;
            all.start.extend(band.start.iter().map(|start| before + start));
            all.of.extend(band.of);
            all.at_mesh_edge.extend(band.at_mesh_edge);
        }
        all.start.push(all.of.len() as u32);
        all
    }

    /// The neighbours of a vertex.
    #[inline]
    pub fn around(&self, vertex: usize) -> &[u32] {
        &self.of[self.start[vertex] as usize..self.start[vertex + 1] as usize]
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.at_mesh_edge.len()
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.at_mesh_edge.is_empty()
    }

    /// Whether the mesh ends at a vertex: an edge from it has one triangle, as far as triangles are loaded.
    #[inline]
    pub fn at_mesh_edge(&self, vertex: usize) -> bool {
        self.at_mesh_edge[vertex]
    }
}

/// The neighbours of a range of vertices.
struct InBand {
    /// Where those of each begin.
    start: Vec<u32>,
    of: Vec<u32>,
    at_mesh_edge: Vec<bool>,
}

impl InBand {
    fn of(bands: &Bands, vertices: Range<usize>) -> InBand {
        let place = |v: u32| (v as usize).wrapping_sub(vertices.start);
        let blocks: Vec<&[[u32; 3]]> = bands.near(&vertices).map(|block| &bands.mesh.triangles[block]).collect();
        // Two for each corner, of which most come twice.
        let mut end = vec![0u32; vertices.len() + 1];
        for &v in blocks.iter().flat_map(|block| block.as_flattened()) {
            if place(v) < vertices.len() {
                end[place(v)] += 2;
            }
        }
        let mut total = 0;
        for end in &mut end {
            total += std::mem::replace(end, total);
        }
        let mut named = vec![0u32; total as usize];
        for &[a, b, c] in blocks.iter().copied().flatten() {
            for [v, next, other] in [[a, b, c], [b, c, a], [c, a, b]] {
                if place(v) < vertices.len() {
                    let at = end[place(v)] as usize;
                    [named[at], named[at + 1]] = [next, other];
                    end[place(v)] += 2;
                }
            }
        }
        let mut found = InBand {
            start: Vec::with_capacity(vertices.len()),
            of: Vec::with_capacity(total as usize / 2 + vertices.len()),
            at_mesh_edge: Vec::with_capacity(vertices.len()),
        };
        let mut begin = 0;
        for (v, &end) in vertices.clone().zip(&end) {
            let at_mesh_edge = found.each_once(v as u32, &named[begin..end as usize]);
            found.at_mesh_edge.push(at_mesh_edge);
            begin = end as usize;
        }
        found
    }

    /// Adds the neighbours of a vertex, each once, and tells whether one of them is named once only.
    fn each_once(&mut self, vertex: u32, named: &[u32]) -> bool {
        let first = self.of.len();
        self.start.push(first as u32);
        // A bit for each neighbour that is named an odd number of times would miss a fork of three; more than once is
        // enough here.
        let mut once = 0u64;
        let mut beyond = false;
        for &other in named.iter().filter(|&&other| other != vertex) {
            match self.of[first..].iter().position(|&known| known == other) {
                Some(place) if place < 64 => once &= !(1 << place),
                Some(_) => {}
                None => {
                    match self.of.len() - first {
                        place @ 0..64 => once |= 1 << place,
                        _ => beyond = true,
                    }
                    self.of.push(other);
                }
            }
        }
        if beyond {
            let times = |other: &u32| named.iter().filter(|named| *named == other).count();
            return self.of[first..].iter().any(|other| times(other) == 1);
        }
        once != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;
    use crate::tile::TileMesh;

    #[test]
    fn every_vertex_has_the_ends_of_its_edges_each_once_in_the_order_of_its_triangles() {
        let mut seed = 11u64;
        let mut below = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let mut edges = 0;
        for round in 0..400 {
            let (vertices, faces) = if round == 0 { (200, 900) } else { (1 + below(40), below(90)) };
            let corner = |below: &mut dyn FnMut(u64) -> u64| below(vertices) as u32;
            let triangles: Vec<[u32; 3]> = (0..faces)
                .map(|_| {
                    let hub = if round == 0 { 0 } else { corner(&mut below) };
                    [hub, corner(&mut below), corner(&mut below)]
                })
                .collect();
            let mesh = TileMesh {
                triangles: triangles.clone(),
                positions: vec![DVec3::ZERO; vertices as usize],
                ..TileMesh::default()
            };
            let found = Neighbours::of(&Bands::of(&mesh));
            for v in 0..vertices as u32 {
                let mut expected: Vec<(u32, usize)> = Vec::new();
                for &[a, b, c] in &triangles {
                    for [here, next, other] in [[a, b, c], [b, c, a], [c, a, b]] {
                        for end in [next, other].into_iter().filter(|&end| here == v && end != v) {
                            match expected.iter_mut().find(|(known, _)| *known == end) {
                                Some((_, times)) => *times += 1,
                                None => expected.push((end, 1)),
                            }
                        }
                    }
                }
                let ends: Vec<u32> = expected.iter().map(|(end, _)| *end).collect();
                assert_eq!(found.around(v as usize), ends);
                assert_eq!(found.at_mesh_edge(v as usize), expected.iter().any(|(_, times)| *times == 1));
                edges += ends.len();
            }
        }
        assert!(edges > 10_000, "{edges}");
    }
}
