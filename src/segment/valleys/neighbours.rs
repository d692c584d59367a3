//! Which vertices lie side by side, found once per tile.

use crate::segment::bands::Bands;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
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

/// Neighbours that find room at once; few vertices have more.
const SLOTS: usize = 12;

/// The first neighbours of a vertex, each once.
#[derive(Clone, Copy)]
struct Slots {
    of: [u32; SLOTS],
    count: u8,
    /// A bit for each neighbour that only one triangle has named.
    once: u16,
}

impl Slots {
    const EMPTY: Slots = Slots { of: [u32::MAX; SLOTS], count: 0, once: 0 };

    /// Adds a neighbour, and tells whether there was room.
    #[inline]
    fn add(&mut self, other: u32) -> bool {
        // All at once, which takes no branches.
        let known = self.of.iter().enumerate().fold(0u16, |known, (i, &slot)| known | u16::from(slot == other) << i);
        if known != 0 {
            self.once &= !known;
            return true;
        }
        let place = usize::from(self.count);
        if place < SLOTS {
            self.of[place] = other;
            self.count += 1;
            self.once |= 1 << place;
        }
        place < SLOTS
    }
}

impl InBand {
    fn of(bands: &Bands, vertices: Range<usize>) -> InBand {
        let place = |v: u32| (v as usize).wrapping_sub(vertices.start);
        let mut slots = vec![Slots::EMPTY; vertices.len()];
        let mut crowded = BTreeSet::new();
        for block in bands.near(&vertices) {
            for &[a, b, c] in &bands.mesh.triangles[block] {
                for [v, next, other] in [[a, b, c], [b, c, a], [c, a, b]] {
                    if let Some(slots) = slots.get_mut(place(v)) {
                        let room = (next == v || slots.add(next)) & (other == v || slots.add(other));
                        if !room {
                            crowded.insert(v);
                        }
                    }
                }
            }
        }
        let mut named: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        if !crowded.is_empty() {
            for &[a, b, c] in bands.near(&vertices).flat_map(|block| &bands.mesh.triangles[block]) {
                for [v, next, other] in [[a, b, c], [b, c, a], [c, a, b]] {
                    if crowded.contains(&v) {
                        named.entry(v).or_default().extend([next, other]);
                    }
                }
            }
        }
        let mut found = InBand {
            start: Vec::with_capacity(vertices.len()),
            of: Vec::with_capacity(7 * vertices.len()),
            at_mesh_edge: Vec::with_capacity(vertices.len()),
        };
        for (v, slots) in (vertices.start as u32..).zip(&slots) {
            found.start.push(found.of.len() as u32);
            let at_mesh_edge = match named.get(&v) {
                None => {
                    found.of.extend(&slots.of[..usize::from(slots.count)]);
                    slots.once != 0
                }
                Some(named) => found.each_once(v, named),
            };
            found.at_mesh_edge.push(at_mesh_edge);
        }
        found
    }

    /// Adds the neighbours of a vertex that has many, each once, and tells whether one of them is named once only.
    fn each_once(&mut self, vertex: u32, named: &[u32]) -> bool {
        let mut times: BTreeMap<u32, usize> = BTreeMap::new();
        for &other in named.iter().filter(|&&other| other != vertex) {
            let times = times.entry(other).or_default();
            *times += 1;
            if *times == 1 {
                self.of.push(other);
            }
        }
        times.values().any(|&times| times == 1)
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
