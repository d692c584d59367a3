//! Which vertices are the same place in different files.
//!
//! Vertices near other files are sorted by the cube of space that holds them; what lies within the tolerance of a
//! vertex is in its own cube, or in one that the tolerance reaches into.

use crate::geometry::DVec3;
use crate::open::{Bits, Surface};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashSet};

/// Twins looked at for each vertex, the nearest first: more are there only where a file has many vertices at one place.
const MOST_TWINS: usize = 16;
/// Vertices of a place that are compared with a vertex, at most, before it is given up as one of very many.
const MOST_COMPARED: usize = 4096;
/// Vertices that are worked at a time.
const PIECE: usize = 1 << 12;

/// A vertex near another file.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    cube: u64,
    number: u64,
    file: u32,
    position: DVec3,
}

/// Two vertices of different files that may be one: sorted as they are decided upon.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Twins {
    later_file: u32,
    squared_m2: f64,
    earlier: u64,
    later: u64,
}

/// Memory for each vertex near another file, bytes: it, where its cube starts, and a twin.
pub(super) const BYTES: u64 = (size_of::<Vertex>() + size_of::<u32>() + 2 * size_of::<Twins>()) as u64;

/// The cubes of space.
struct Cubes {
    side_m: f64,
    /// Sorted by cube, then number.
    vertices: Vec<Vertex>,
    /// First vertex of each bucket: the cubes whose numbers begin with the same bits.
    starts: Vec<u32>,
    shift: u32,
}

/// The vertices that become one of an earlier file, in order, with that one. A vertex that has such a one never is one.
///
/// Files are joined one after the other: of the vertices of a file, each becomes the nearest earlier one within
/// the tolerance, or what that one has become, unless another one of the same file is nearer to it.
pub(super) fn aliases(
    surface: &dyn Surface,
    (used, ends): (&Bits, &[u64]),
    tolerance_m: f64,
    edge_m: f64,
) -> Vec<(u64, u64)> {
    // Wider than the tolerance needs: the fewer cubes it reaches into, the fewer are searched.
    let cubes = Cubes::new(surface, (used, ends), (2.0 * tolerance_m).max(edge_m / 4.0));
    surface.release();
    let mut twins: Vec<Twins> = cubes
        .vertices
        .par_chunks(PIECE)
        .flat_map_iter(|piece| {
            let mut found = Vec::new();
            piece.iter().for_each(|vertex| cubes.twins(vertex, tolerance_m, &mut found));
            found
        })
        .collect();
    twins.par_sort_unstable_by(|a, b| {
        let order = (a.later_file.cmp(&b.later_file)).then(a.squared_m2.total_cmp(&b.squared_m2));
        order.then(a.earlier.cmp(&b.earlier)).then(a.later.cmp(&b.later))
    });
    let mut alias = BTreeMap::new();
    for file in twins.chunk_by(|a, b| a.later_file == b.later_file) {
        let mut taken = HashSet::new();
        let mut joined = BTreeMap::new();
        for twins in file {
            let first = alias.get(&twins.earlier).copied().unwrap_or(twins.earlier);
            if !joined.contains_key(&twins.later) && taken.insert(first) {
                joined.insert(twins.later, first);
            }
        }
        alias.append(&mut joined);
    }
    alias.into_iter().collect()
}

impl Cubes {
    fn new(surface: &dyn Surface, (used, ends): (&Bits, &[u64]), side_m: f64) -> Cubes {
        let numbers: Vec<u64> = used.ones().collect();
        let mut vertices: Vec<Vertex> = numbers
            .into_par_iter()
            .map(|number| {
                let position = surface.position(number);
                let cube = hash(position.to_array().map(|v| along(v, side_m)));
                Vertex { cube, number, file: ends.partition_point(|&end| end <= number) as u32, position }
            })
            .collect();
        vertices.par_sort_unstable_by_key(|v| (v.cube, v.number));
        let buckets = vertices.len().next_power_of_two().max(2);
        let shift = 64 - buckets.trailing_zeros();
        let mut starts = Vec::with_capacity(buckets + 1);
        let mut at = 0;
        for bucket in 0..=buckets as u64 {
            while vertices.get(at).is_some_and(|v| v.cube >> shift < bucket) {
                at += 1;
            }
            starts.push(at as u32);
        }
        Cubes { side_m, vertices, starts, shift }
    }

    fn in_cube(&self, cube: u64) -> impl Iterator<Item = &Vertex> {
        let bucket = (cube >> self.shift) as usize;
        let vertices = &self.vertices[self.starts[bucket] as usize..self.starts[bucket + 1] as usize];
        vertices.iter().filter(move |v| v.cube == cube)
    }

    /// Appends the nearest vertices of earlier files within the tolerance.
    fn twins(&self, vertex: &Vertex, tolerance_m: f64, found: &mut Vec<Twins>) {
        let p = vertex.position.to_array();
        // Subtraction, division and rounding down keep the order of coordinates: no cube is missed.
        let reach = p.map(|v| along(v - tolerance_m, self.side_m)..=along(v + tolerance_m, self.side_m));
        let first = found.len();
        for x in reach[0].clone() {
            for y in reach[1].clone() {
                for z in reach[2].clone() {
                    for other in self.in_cube(hash([x, y, z])).take(MOST_COMPARED).filter(|o| o.file < vertex.file) {
                        let squared_m2 = vertex.position.distance_squared(other.position);
                        if squared_m2 <= tolerance_m * tolerance_m {
                            let (earlier, later) = (other.number, vertex.number);
                            found.push(Twins { later_file: vertex.file, squared_m2, earlier, later });
                        }
                    }
                }
            }
        }
        let of_vertex = &mut found[first..];
        of_vertex.sort_unstable_by(|a, b| a.squared_m2.total_cmp(&b.squared_m2).then(a.earlier.cmp(&b.earlier)));
        // Cubes of one hash are searched once for each.
        let mut kept = first;
        for i in first..found.len() {
            if kept - first < MOST_TWINS && (kept == first || found[kept - 1] != found[i]) {
                found[kept] = found[i];
                kept += 1;
            }
        }
        found.truncate(kept);
    }
}

#[inline]
fn along(coordinate: f64, side_m: f64) -> i64 {
    (coordinate / side_m).floor() as i64
}

/// Scatters cubes evenly over all numbers (the finaliser of MurmurHash3, after each axis).
fn hash(cube: [i64; 3]) -> u64 {
    cube.iter().fold(0x9E37_79B9_7F4A_7C15, |hash: u64, &i| {
        let mut h = (hash ^ i as u64).wrapping_mul(0xff51_afd7_ed55_8ccd);
        h ^= h >> 33;
        h = h.wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        h ^ h >> 33
    })
}
