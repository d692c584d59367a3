//! Which vertices lie side by side, found once per tile.

use crate::segment::bands::Bands;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Vertices whose neighbours one thread gathers at a time.
const BAND: usize = if cfg!(test) { 7 } else { 1 << 15 };
/// Neighbours that a vertex has room for; few have more.
const RING: usize = 8;
/// Stands for the number of neighbours of a vertex that has more than there is room for.
const CROWDED: u8 = u8::MAX;

/// The vertices of a mesh, side by side: joined by an edge of some triangle.
///
/// The neighbours of a vertex stand in an order that only its triangles give, lowest first: in every tile that has loaded
/// all of these triangles, in the same.
pub struct Neighbours {
    /// The neighbours of each vertex, filled up with the number of vertices, which is nobody's; of a crowded one, where
    /// in `lists` they begin and how many they are.
    rings: Vec<[u32; RING]>,
    around: Vec<Around>,
    lists: Vec<u32>,
}

/// What is known around a vertex.
#[derive(Clone, Copy, Default)]
struct Around {
    /// How many are in its ring, or [`CROWDED`] if it has a list.
    count: u8,
    /// Whether an edge from it has one triangle.
    at_mesh_edge: bool,
}

impl Neighbours {
    /// Gathers the neighbours of all vertices.
    pub fn of(bands: &Bands) -> Neighbours {
        let vertices = bands.mesh.positions.len();
        let mut rings = vec![[vertices as u32; RING]; vertices];
        let mut around = vec![Around::default(); vertices];
        let crowds: Vec<Vec<(u32, Vec<u32>)>> = rings
            .par_chunks_mut(BAND)
            .zip(around.par_chunks_mut(BAND))
            .enumerate()
            .map(|(band, (rings, around))| gather(bands, BAND * band, rings, around))
            .collect();
        let mut lists = Vec::new();
        for (v, list) in crowds.into_iter().flatten() {
            rings[v as usize][..2].copy_from_slice(&[lists.len() as u32, list.len() as u32]);
            lists.extend(list);
        }
        Neighbours { rings, around, lists }
    }

    /// The neighbours of a vertex.
    #[inline]
    pub fn around(&self, vertex: usize) -> &[u32] {
        let ring = &self.rings[vertex];
        match self.around[vertex].count {
            CROWDED => &self.lists[ring[0] as usize..][..ring[1] as usize],
            count => &ring[..usize::from(count)],
        }
    }

    /// Hands over the neighbours of a vertex, four at a time and filled up with the number of vertices.
    #[inline]
    pub fn each_four(&self, vertex: usize, mut take: impl FnMut([u32; 4])) {
        if self.around[vertex].count == CROWDED {
            for four in self.around(vertex).chunks(4) {
                take([0, 1, 2, 3].map(|i| four.get(i).copied().unwrap_or(self.len() as u32)));
            }
        } else {
            let [a, b, c, d, e, f, g, h] = self.rings[vertex];
            take([a, b, c, d]);
            take([e, f, g, h]);
        }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.rings.len()
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.rings.is_empty()
    }

    /// Whether the mesh ends at a vertex: an edge from it has one triangle, as far as triangles are loaded.
    #[inline]
    pub fn at_mesh_edge(&self, vertex: usize) -> bool {
        self.around[vertex].at_mesh_edge
    }
}

/// Gathers the neighbours of the vertices from `first` on. Gives the lists of the crowded ones.
fn gather(bands: &Bands, first: usize, rings: &mut [[u32; RING]], around: &mut [Around]) -> Vec<(u32, Vec<u32>)> {
    let vertices = first..first + rings.len();
    // Each triangle around a vertex names two others: its rings take the next ones, these the ones before.
    let mut before = vec![[NOBODY; RING]; rings.len()];
    let mut more: Vec<(u32, [u32; 2])> = Vec::new();
    for block in bands.near(&vertices) {
        for &[a, b, c] in &bands.mesh.triangles[block] {
            for [v, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
                let place = (v as usize).wrapping_sub(first);
                let Some(around) = around.get_mut(place) else { continue };
                let triangle = usize::from(around.count);
                if triangle < RING {
                    rings[place][triangle] = next;
                    before[place][triangle] = last;
                    around.count += 1;
                } else {
                    more.push((v, [next, last]));
                }
            }
        }
    }
    more.sort_by_key(|(v, _)| *v);
    let mut more = more.as_slice();
    let mut lists = Vec::new();
    for (((v, ring), before), around) in (first as u32..).zip(rings).zip(&before).zip(around) {
        let no_room: &[(u32, [u32; 2])];
        (no_room, more) = more.split_at(more.iter().take_while(|(of, _)| *of == v).count());
        if no_room.is_empty() && is_closed(v, ring, before) {
            continue;
        }
        let named = ring.iter().zip(before).take(usize::from(around.count)).flat_map(|(&next, &last)| [next, last]);
        let named = named.chain(no_room.iter().flat_map(|(_, others)| *others)).filter(|&other| other != v);
        let list;
        (list, around.at_mesh_edge) = each_once(named);
        if list.len() <= RING {
            let nobody = bands.mesh.positions.len() as u32;
            *ring = std::array::from_fn(|i| list.get(i).copied().unwrap_or(nobody));
            around.count = list.len() as u8;
        } else {
            around.count = CROWDED;
            lists.push((v, list));
        }
    }
    lists
}

/// Fills up what is named before. No vertex has this number, and it is not what fills up rings.
const NOBODY: u32 = u32::MAX;

/// Whether the triangles around a vertex close: each of those that come next comes before once, and the other way round.
/// Then the ring holds all neighbours, each once. Every place is held against every other, which takes no branches.
#[inline]
fn is_closed(vertex: u32, next: &[u32; RING], before: &[u32; RING]) -> bool {
    let (mut found_next, mut found_before, mut itself) = ([0u32; RING], [0u32; RING], 0);
    for i in 0..RING {
        for j in 0..RING {
            found_next[j] += u32::from(next[j] == before[i]);
            found_before[j] += u32::from(before[j] == next[i]);
        }
        itself |= u32::from(next[i] == vertex);
    }
    let mut differs = itself;
    for i in 0..RING {
        let there = u32::from(before[i] != NOBODY);
        differs |= (found_next[i] ^ there) | (found_before[i] ^ there);
    }
    differs == 0
}

/// Each number once, in the order of their first naming, and whether one of them is named once only.
fn each_once(named: impl Iterator<Item = u32>) -> (Vec<u32>, bool) {
    let mut times: BTreeMap<u32, usize> = BTreeMap::new();
    let mut list = Vec::new();
    for other in named {
        let times = times.entry(other).or_default();
        *times += 1;
        if *times == 1 {
            list.push(other);
        }
    }
    (list, times.values().any(|&times| times == 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;
    use crate::tile::TileMesh;

    #[test]
    fn every_vertex_has_the_ends_of_its_edges_each_once() {
        let mut seed = 11u64;
        let mut below = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let mut edges = 0;
        for round in 0..800 {
            let (vertices, faces) = if round == 0 { (200, 900) } else { (1 + below(40), below(90)) };
            let corner = |below: &mut dyn FnMut(u64) -> u64| below(vertices) as u32;
            let strewn: Vec<[u32; 3]> = (0..faces)
                .map(|_| {
                    let hub = if round == 0 { 0 } else { corner(&mut below) };
                    [hub, corner(&mut below), corner(&mut below)]
                })
                .collect();
            // Fans around a vertex, of which some close, turned somehow, and now and then with something wrong.
            let rim = 2 + below(10) as u32;
            let mut fan: Vec<[u32; 3]> = (0..rim).map(|i| [0, 1 + i, 1 + (i + 1) % rim]).collect();
            fan.iter_mut().for_each(|triangle| triangle.rotate_left(below(3) as usize));
            match below(6) {
                0 => fan[0].swap(0, 1),
                1 => fan.push(fan[0]),
                2 => fan.truncate(rim as usize - 1),
                3 => fan[0] = [0, 0, 1],
                _ => {}
            }
            let (vertices, triangles) = if round % 2 == 0 { (vertices, strewn) } else { (u64::from(rim) + 1, fan) };
            let mesh = TileMesh {
                triangles: triangles.clone(),
                positions: vec![DVec3::ZERO; vertices as usize],
                ..TileMesh::default()
            };
            let found = Neighbours::of(&Bands::of(&mesh));
            // Among others, with other numbers, in other bands: in the same order.
            let further = 1 + below(20) as u32;
            let others = [[0, further - 1, further / 2]; 4];
            let moved = triangles.iter().map(|triangle| triangle.map(|v| v + further));
            let elsewhere = TileMesh {
                triangles: others.into_iter().chain(moved).collect(),
                positions: vec![DVec3::ZERO; vertices as usize + further as usize],
                ..TileMesh::default()
            };
            let there = Neighbours::of(&Bands::of(&elsewhere));
            for v in 0..vertices as u32 {
                let moved: Vec<u32> = found.around(v as usize).iter().map(|u| u + further).collect();
                assert_eq!(there.around((v + further) as usize), moved);
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
                let ends = found.around(v as usize);
                let sorted = |mut ends: Vec<u32>| {
                    ends.sort_unstable();
                    ends
                };
                assert_eq!(sorted(ends.to_vec()), sorted(expected.iter().map(|(end, _)| *end).collect()));
                let mut fours = Vec::new();
                found.each_four(v as usize, |four| fours.extend(four));
                assert_eq!(&fours[..ends.len()], ends);
                assert!(fours[ends.len()..].iter().all(|&u| u as usize == found.len()));
                assert_eq!(found.at_mesh_edge(v as usize), expected.iter().any(|(_, times)| *times == 1));
                edges += ends.len();
            }
        }
        assert!(edges > 10_000, "{edges}");
    }

    #[test]
    fn a_ring_is_closed_where_every_neighbour_comes_next_once_and_before_once() {
        let ring = |numbers: &[u32], fill: u32| std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(fill));
        let closed = |next: &[u32], before: &[u32]| is_closed(9, &ring(next, 100), &ring(before, NOBODY));
        assert!(closed(&[1, 2, 3], &[2, 3, 1]) && closed(&[1, 2], &[2, 1]) && closed(&[], &[]));
        assert!(closed(&[1, 2, 3, 4, 5, 6, 7, 8], &[8, 7, 6, 5, 4, 3, 2, 1]), "eight in any order");
        assert!(!closed(&[1, 2, 3], &[2, 3, 4]), "an open fan");
        assert!(!closed(&[1, 1, 2], &[2, 1, 2]) && !closed(&[1, 2, 2], &[1, 1, 2]), "one is named three times");
        assert!(!closed(&[1, 9, 2], &[9, 2, 1]), "the vertex itself");
    }
}
