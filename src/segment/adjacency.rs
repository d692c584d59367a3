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
    flags: Vec<u8>,
}

/// A triangle beyond the halo may lie at one of its edges.
const OPEN: u8 = 1;
/// One of its edges is an edge of the mesh.
const AT_MESH_EDGE: u8 = 2;

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
            flags: vec![0; n],
        };
        let mut first = 0;
        for low in 0..mesh.positions.len() {
            let last = end[low] as usize;
            adjacency.pair_up(mesh, low as u32, &mut halves[first..last]);
            first = last;
        }
        adjacency
    }

    /// Tells the edges at one vertex apart that lead to higher ones.
    fn pair_up(&mut self, mesh: &TileMesh, low: u32, list: &mut [Half]) {
        let sorted = list.len() > FEW;
        if sorted {
            list.sort_unstable();
        }
        let mut from = 0;
        while from < list.len() {
            let high = list[from].high();
            let mut to = from + 1;
            for i in to..list.len() {
                if list[i].high() == high {
                    list.swap(i, to);
                    to += 1;
                } else if sorted {
                    break;
                }
            }
            self.join(mesh, [low, high], &list[from..to]);
            from = to;
        }
    }

    /// Notes what lies at one edge.
    fn join(&mut self, mesh: &TileMesh, ends: [u32; 2], around: &[Half]) {
        // Around a complete vertex everything is loaded, so an edge can only lack a triangle where both its
        // ends are incomplete.
        let open = ends.iter().all(|&v| !mesh.complete[v as usize]);
        let lone = match *around {
            [_] => true,
            [a, b] if a.triangle() != b.triangle() => {
                self.sides[a.triangle() as usize][a.side()] = b.triangle();
                self.sides[b.triangle() as usize][b.side()] = a.triangle();
                // They share two corners: are the third ones the same too?
                let mixed = |h: Half| mesh.triangles[h.triangle() as usize].into_iter().fold(0, |m, v| m ^ v);
                mixed(a) == mixed(b)
            }
            _ => {
                self.join_many(around);
                lone(mesh, around)
            }
        };
        let flag = match (open, lone && ends[0] != ends[1]) {
            (true, _) => OPEN,
            (false, true) => AT_MESH_EDGE,
            (false, false) => return,
        };
        around.iter().for_each(|h| self.flags[h.triangle() as usize] |= flag);
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

    /// Whether a triangle beyond the halo may lie at an edge of the triangle.
    pub fn is_open(&self, triangle: usize) -> bool {
        self.flags[triangle] & OPEN != 0
    }

    /// Whether the mesh ends at an edge of the triangle, as far as that is known.
    pub fn is_at_mesh_edge(&self, triangle: usize) -> bool {
        self.flags[triangle] & AT_MESH_EDGE != 0
    }
}

/// Whether only one triangle lies at an edge. Faces that name a vertex twice, and copies of a face, do not
/// count.
fn lone(mesh: &TileMesh, around: &[Half]) -> bool {
    let mut only = None;
    for h in around {
        let mut corners = mesh.triangles[h.triangle() as usize];
        corners.sort_unstable();
        if corners[0] == corners[1] || corners[1] == corners[2] {
            continue;
        }
        if *only.get_or_insert(corners) != corners {
            return false;
        }
    }
    only.is_some()
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
        assert_eq!((0..5).map(|t| adjacency.is_at_mesh_edge(t)).collect::<Vec<_>>(), [true, true, true, false, true]);
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
                assert_eq!([adjacency.is_open(t), adjacency.is_at_mesh_edge(t)], flags[t], "{triangles:?}, {t}");
                open += usize::from(flags[t][0]);
                edges += usize::from(flags[t][1]);
            }
            forks += adjacency.forks().count();
        }
        assert!(forks > 1000 && open > 1000 && edges > 1000, "{forks} forks, {open} open, {edges} at edges");
    }
}
