//! What lies at the edges of a mesh, band by band of vertices.

use super::bands::Bands;
use crate::tile::TileMesh;
use std::sync::atomic::{AtomicU32, Ordering};

/// Sorting pays above this many half-edges at one vertex: there is no limit to how many a broken mesh has.
const FEW: usize = 24;
/// Vertices of a band: its half-edges stay in the processor's cache.
const BAND: usize = if cfg!(test) { 4 } else { 1 << 15 };

/// What lies at the three sides of a triangle. Every band of vertices writes to sides of its own.
pub(super) type Sides = [AtomicU32; 3];

/// A side of a triangle, kept with the lower of its vertices: the higher vertex above, 4 triangle + side below.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Half(u64);

impl Half {
    fn new(high: u32, triangle: usize, side: usize) -> Half {
        Half(u64::from(high) << 32 | (triangle << 2 | side) as u64)
    }

    fn high(self) -> u32 {
        (self.0 >> 32) as u32
    }

    fn triangle(self) -> u32 {
        self.0 as u32 >> 2
    }

    fn side(self) -> usize {
        self.0 as usize & 3
    }
}

/// How many bands the vertices of a tile are joined in.
pub(super) fn band_count(mesh: &TileMesh) -> usize {
    mesh.positions.len().div_ceil(BAND)
}

/// Writes down what lies side by side at the edges that are kept with the vertices of a band, and returns the rest:
/// half-edges are put beside their vertices by counting, and compared within these short lists.
pub(super) fn join(bands: &Bands, band: usize, sides: &[Sides]) -> Ends {
    let mesh = bands.mesh;
    let vertices = BAND * band..(BAND * (band + 1)).min(mesh.positions.len());
    let (first, count) = (vertices.start as u32, vertices.len());
    // After the lists are filled, the one of the vertex in place v ends at `end[v]`. Half-edges of other bands are
    // counted behind the last.
    let place = |v: u32, w: u32| (v.min(w).wrapping_sub(first) as usize).min(count);
    let mut end = vec![0u32; count + 2];
    for &[a, b, c] in bands.near(&vertices).flat_map(|block| &mesh.triangles[block]) {
        end[place(a, b) + 1] += 1;
        end[place(b, c) + 1] += 1;
        end[place(c, a) + 1] += 1;
    }
    for v in 1..=count {
        end[v] += end[v - 1];
    }
    let mut halves = vec![Half::default(); end[count] as usize];
    for t in bands.near(&vertices).flatten() {
        let [a, b, c] = mesh.triangles[t];
        for (side, [v, w]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
            let place = place(v, w);
            if place < count {
                halves[end[place] as usize] = Half::new(v.max(w), t, side);
                end[place] += 1;
            }
        }
    }
    let mut around = Around { mesh, sides, ends: Ends::default() };
    let mut start = 0;
    for (low, &last) in (first..).zip(&end[..count]) {
        around.vertex(low, &mut halves[start..last as usize]);
        start = last as usize;
    }
    around.ends
}

/// What lies at edges where not just two triangles meet.
#[derive(Default)]
pub(super) struct Ends {
    /// Edges with more than two triangles: these, ascending.
    pub(super) forks: Vec<Vec<u32>>,
    /// Triangles at an edge of which a triangle beyond the halo may lie.
    pub(super) open: Vec<u32>,
    /// Triangles at an edge of which the mesh ends.
    pub(super) at_mesh_edge: Vec<u32>,
}

/// The edges at one vertex after the other.
struct Around<'m> {
    mesh: &'m TileMesh,
    sides: &'m [Sides],
    ends: Ends,
}

impl Around<'_> {
    /// Tells the edges at one vertex apart that lead to higher ones.
    fn vertex(&mut self, low: u32, mut list: &mut [Half]) {
        if list.len() > FEW {
            list.sort_unstable();
            for around in list.chunk_by(|a, b| a.high() == b.high()) {
                self.edge(low, around);
            }
            return;
        }
        let complete = self.mesh.complete[low as usize];
        while let Some(&first) = list.first() {
            // Without a branch for each: whether two lead to the same vertex is as good as random.
            let (mut others, mut place) = (0, 0);
            for (i, half) in list.iter().enumerate().skip(1) {
                let same = half.high() == first.high();
                others += usize::from(same);
                place = if same { i } else { place };
            }
            match others {
                0 => {}
                1 => list.swap(1, place),
                _ => list.sort_unstable_by_key(|h| (h.high() != first.high(), *h)),
            }
            let (around, rest) = list.split_at_mut(1 + others);
            match *around {
                [a, b] if complete && a.triangle() != b.triangle() => self.pair(a, b),
                _ => self.edge(low, around),
            }
            list = rest;
        }
    }

    fn put(&self, half: Half, other: u32) {
        self.sides[half.triangle() as usize][half.side()].store(other, Ordering::Relaxed);
    }

    fn pair(&self, a: Half, b: Half) {
        self.put(a, b.triangle());
        self.put(b, a.triangle());
    }

    /// Notes what lies at one edge.
    fn edge(&mut self, low: u32, around: &[Half]) {
        let high = around[0].high();
        let lone = match *around {
            [_] => true,
            [a, b] if a.triangle() != b.triangle() => {
                self.pair(a, b);
                // Unless one is a copy of the other, which is looked for at the end.
                false
            }
            _ => {
                self.join_many(around);
                lone(self.mesh, around)
            }
        };
        if may_lack(self.mesh, low, high) {
            self.ends.open.extend(around.iter().map(|h| h.triangle()));
        } else if lone && low != high {
            self.ends.at_mesh_edge.extend(around.iter().map(|h| h.triangle()));
        }
    }

    /// A face that names a vertex twice lies at an edge twice, and is no fork by that.
    fn join_many(&mut self, around: &[Half]) {
        let mut triangles: Vec<u32> = around.iter().map(|h| h.triangle()).collect();
        triangles.sort_unstable();
        triangles.dedup();
        match *triangles {
            [_] => {}
            [a, b] => around.iter().for_each(|&h| self.put(h, if h.triangle() == a { b } else { a })),
            _ => self.ends.forks.push(triangles),
        }
    }
}

/// Around a complete vertex everything is loaded, so an edge can only lack a triangle where both its ends are
/// incomplete.
pub(super) fn may_lack(mesh: &TileMesh, v: u32, w: u32) -> bool {
    !mesh.complete[v as usize] && !mesh.complete[w as usize]
}

/// The corners of a face, ascending; none if it names a vertex twice.
pub(super) fn real_corners(mesh: &TileMesh, triangle: u32) -> Option<[u32; 3]> {
    let mut corners = mesh.triangles[triangle as usize];
    corners.sort_unstable();
    (corners[0] < corners[1] && corners[1] < corners[2]).then_some(corners)
}

/// Whether only one triangle lies at an edge. Faces that name a vertex twice, and copies of a face, do not
/// count.
fn lone(mesh: &TileMesh, around: &[Half]) -> bool {
    let mut real = around.iter().filter_map(|h| real_corners(mesh, h.triangle()));
    real.next().is_some_and(|first| real.all(|other| other == first))
}
