//! Which triangles lie side by side, found once per tile.

use crate::tile::TileMesh;

/// Sorting pays above this many half-edges at one vertex: there is no limit to how many a broken mesh has.
const FEW: usize = 24;

/// The triangles of a mesh, side by side. Winding is ignored, and an edge with three or more triangles joins
/// them all, as in the authors' program.
pub struct Adjacency {
    /// For each triangle and side (corners 0 1, 1 2, 2 0) the one other triangle that lies there; the triangle
    /// itself where none does, or where the edge is a fork.
    sides: Vec<[u32; 3]>,
    /// Where the triangles of each fork begin, and the end of the last.
    fork_starts: Vec<u32>,
    fork_triangles: Vec<u32>,
    open: Vec<u32>,
    at_mesh_edge: Vec<u32>,
}

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

impl Adjacency {
    /// Finds what lies side by side: half-edges are put beside the lower of their two vertices by counting, and
    /// compared within these short lists.
    pub fn of(mesh: &TileMesh) -> Adjacency {
        let n = mesh.triangles.len();
        // After the lists are filled, the one of vertex v ends at `end[v]`.
        let mut end = vec![0u32; mesh.positions.len() + 1];
        for &[a, b, c] in &mesh.triangles {
            end[a.min(b) as usize + 1] += 1;
            end[b.min(c) as usize + 1] += 1;
            end[c.min(a) as usize + 1] += 1;
        }
        for v in 1..end.len() {
            end[v] += end[v - 1];
        }
        let mut halves = vec![Half::default(); 3 * n];
        for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            for (side, [v, w]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
                let place = &mut end[v.min(w) as usize];
                halves[*place as usize] = Half::new(v.max(w), t, side);
                *place += 1;
            }
        }
        let mut adjacency = Adjacency {
            sides: (0..n as u32).map(|t| [t; 3]).collect(),
            fork_starts: vec![0],
            fork_triangles: Vec::new(),
            open: Vec::new(),
            at_mesh_edge: Vec::new(),
        };
        let mut first = 0;
        for (low, &last) in (0..mesh.positions.len() as u32).zip(&end) {
            adjacency.pair_up(mesh, low, &mut halves[first..last as usize]);
            first = last as usize;
        }
        drop(halves);
        adjacency.find_copies(mesh);
        for list in [&mut adjacency.open, &mut adjacency.at_mesh_edge] {
            list.sort_unstable();
            list.dedup();
        }
        adjacency
    }

    /// Tells the edges at one vertex apart that lead to higher ones.
    fn pair_up(&mut self, mesh: &TileMesh, low: u32, mut list: &mut [Half]) {
        if list.len() > FEW {
            list.sort_unstable();
            for around in list.chunk_by(|a, b| a.high() == b.high()) {
                self.join(mesh, low, around);
            }
            return;
        }
        let complete = mesh.complete[low as usize];
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
                _ => self.join(mesh, low, around),
            }
            list = rest;
        }
    }

    fn pair(&mut self, a: Half, b: Half) {
        self.sides[a.triangle() as usize][a.side()] = b.triangle();
        self.sides[b.triangle() as usize][b.side()] = a.triangle();
    }

    /// Notes what lies at one edge.
    fn join(&mut self, mesh: &TileMesh, low: u32, around: &[Half]) {
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
                lone(mesh, around)
            }
        };
        if may_lack(mesh, low, high) {
            self.open.extend(around.iter().map(|h| h.triangle()));
        } else if lone && low != high {
            self.at_mesh_edge.extend(around.iter().map(|h| h.triangle()));
        }
    }

    /// Two copies of a face do not continue each other: the mesh ends where only they lie. They have three
    /// edges in common, so two sides have the same neighbour, or two edges are forks.
    fn find_copies(&mut self, mesh: &TileMesh) {
        let mut suspects = self.fork_triangles.clone();
        for (t, &[a, b, c]) in self.sides.iter().enumerate() {
            let own = t as u32;
            if (a == b && b != own) || (b == c && c != own) || (c == a && a != own) {
                suspects.push(own);
            }
        }
        for t in suspects {
            let [a, b, c] = mesh.triangles[t as usize];
            for (side, [v, w]) in self.sides[t as usize].into_iter().zip([[a, b], [b, c], [c, a]]) {
                let both = [t, side].map(|t| real_corners(mesh, t));
                if side != t && both[0].is_some() && both[0] == both[1] && !may_lack(mesh, v, w) {
                    self.at_mesh_edge.push(t);
                }
            }
        }
    }

    /// A face that names a vertex twice lies at an edge twice, and is no fork by that.
    fn join_many(&mut self, around: &[Half]) {
        let mut triangles: Vec<u32> = around.iter().map(|h| h.triangle()).collect();
        triangles.sort_unstable();
        triangles.dedup();
        match *triangles {
            [_] => {}
            [a, b] => {
                for h in around {
                    self.sides[h.triangle() as usize][h.side()] = if h.triangle() == a { b } else { a };
                }
            }
            _ => {
                self.fork_triangles.extend(triangles);
                self.fork_starts.push(self.fork_triangles.len() as u32);
            }
        }
    }

    /// How many triangles there are.
    pub fn len(&self) -> usize {
        self.sides.len()
    }

    /// Whether there are no triangles.
    pub fn is_empty(&self) -> bool {
        self.sides.is_empty()
    }

    /// What lies at the three sides of a triangle where no fork is: another triangle, or the triangle itself.
    pub fn sides(&self, triangle: usize) -> [u32; 3] {
        self.sides[triangle]
    }

    /// Edges with more than two triangles: these, ascending, each once.
    pub fn forks(&self) -> impl Iterator<Item = &[u32]> {
        self.fork_starts.windows(2).map(|w| &self.fork_triangles[w[0] as usize..w[1] as usize])
    }

    /// Triangles, ascending, at an edge of which a triangle beyond the halo may lie.
    pub fn open(&self) -> &[u32] {
        &self.open
    }

    /// Triangles, ascending, at an edge of which the mesh ends, as far as that is known.
    pub fn at_mesh_edge(&self) -> &[u32] {
        &self.at_mesh_edge
    }
}

/// Around a complete vertex everything is loaded, so an edge can only lack a triangle where both its ends are
/// incomplete.
fn may_lack(mesh: &TileMesh, v: u32, w: u32) -> bool {
    !mesh.complete[v as usize] && !mesh.complete[w as usize]
}

/// The corners of a face, ascending; none if it names a vertex twice.
fn real_corners(mesh: &TileMesh, triangle: u32) -> Option<[u32; 3]> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;

    fn mesh(triangles: &[[u32; 3]], complete: &[bool]) -> TileMesh {
        TileMesh {
            triangles: triangles.to_vec(),
            complete: complete.to_vec(),
            positions: vec![DVec3::ZERO; complete.len()],
            ..TileMesh::default()
        }
    }

    #[test]
    fn an_edge_knows_all_its_triangles_whatever_their_winding() {
        let adjacency = Adjacency::of(&mesh(&[[0, 1, 2], [2, 1, 3], [1, 2, 4], [0, 0, 3], [3, 4, 1]], &[true; 5]));
        assert_eq!(adjacency.forks().collect::<Vec<_>>(), [[0, 1, 2]]);
        let sides: Vec<_> = (0..5).map(|t| adjacency.sides(t)).collect();
        assert_eq!(sides, [[0, 0, 0], [1, 4, 1], [2, 2, 4], [3, 3, 3], [4, 2, 1]]);
        assert_eq!((adjacency.open(), adjacency.at_mesh_edge()), (&[][..], &[0, 1, 2, 4][..]));
    }

    /// Edge by edge, in a map, as one would write it down.
    fn plainly(mesh: &TileMesh) -> (Vec<Vec<u32>>, Vec<[bool; 2]>) {
        let mut edges = std::collections::BTreeMap::<[u32; 2], Vec<u32>>::new();
        for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            for [v, w] in [[a, b], [b, c], [c, a]] {
                edges.entry([v.min(w), v.max(w)]).or_default().push(t as u32);
            }
        }
        let mut beside = vec![Vec::new(); mesh.triangles.len()];
        let mut flags = vec![[false; 2]; mesh.triangles.len()];
        for (ends, around) in edges {
            let open = ends.iter().all(|&v| !mesh.complete[v as usize]);
            let mut real: Vec<[u32; 3]> = around.iter().map(|&t| mesh.triangles[t as usize]).collect();
            real.iter_mut().for_each(|t| t.sort_unstable());
            real.retain(|t| t[0] < t[1] && t[1] < t[2]);
            real.sort_unstable();
            real.dedup();
            for &t in &around {
                flags[t as usize][0] |= open;
                flags[t as usize][1] |= !open && ends[0] != ends[1] && real.len() == 1;
                beside[t as usize].extend(around.iter().filter(|&&s| s != t));
            }
        }
        (beside, flags)
    }

    /// Few vertices and many faces: forks, copies and faces without area everywhere.
    #[test]
    fn any_heap_of_faces_is_joined_as_edges_say() {
        let mut seed = 1u64;
        let mut below = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let (mut forks, mut open, mut edges) = (0, 0, 0);
        for _ in 0..2000 {
            let (vertices, faces) = (1 + below(14), below(40));
            let complete: Vec<bool> = (0..vertices).map(|_| below(3) > 0).collect();
            let triangles: Vec<[u32; 3]> = (0..faces).map(|_| [0; 3].map(|_| below(vertices) as u32)).collect();
            let mesh = mesh(&triangles, &complete);
            let adjacency = Adjacency::of(&mesh);
            let (beside, flags) = plainly(&mesh);
            for t in 0..adjacency.len() {
                let alone = t as u32;
                let mut found: Vec<u32> = adjacency.sides(t).into_iter().filter(|&s| s != alone).collect();
                let mine = adjacency.forks().filter(|f| f.contains(&alone));
                found.extend(mine.flatten().filter(|&&s| s != alone));
                let each_once = |mut list: Vec<u32>| {
                    list.sort_unstable();
                    list.dedup();
                    list
                };
                assert_eq!(each_once(found), each_once(beside[t].clone()), "{triangles:?}, triangle {t}");
                let listed = [adjacency.open(), adjacency.at_mesh_edge()].map(|l| l.binary_search(&alone).is_ok());
                assert_eq!(listed, flags[t], "{triangles:?}, triangle {t}");
                open += usize::from(flags[t][0]);
                edges += usize::from(flags[t][1]);
            }
            forks += adjacency.forks().count();
        }
        assert!(forks > 1000 && open > 1000 && edges > 1000, "{forks} forks, {open} open, {edges} at edges");
    }
}
