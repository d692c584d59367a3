//! Which triangles lie side by side, found once per tile.

use super::bands::Bands;
use super::edges::{self, Sides, may_lack, real_corners};
use crate::tile::TileMesh;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// The triangles of a mesh, side by side. Winding is ignored, and an edge with three or more triangles joins
/// them all, as in the authors' program.
pub struct Adjacency {
    /// For each triangle and side (corners 0 1, 1 2, 2 0) the one other triangle that lies there; the triangle
    /// itself where none does, or where the edge is a fork.
    sides: Vec<Sides>,
    /// Where the triangles of each fork begin, and the end of the last.
    fork_starts: Vec<u32>,
    fork_triangles: Vec<u32>,
    open: Vec<u32>,
    at_mesh_edge: Vec<u32>,
}

impl Adjacency {
    /// Finds what lies side by side.
    pub fn of(bands: &Bands) -> Adjacency {
        let mesh = bands.mesh;
        let alone = |t| [t; 3].map(AtomicU32::new);
        let sides: Vec<Sides> = (0..mesh.triangles.len() as u32).into_par_iter().map(alone).collect();
        let ends: Vec<_> =
            (0..edges::band_count(mesh)).into_par_iter().map(|band| edges::join(bands, band, &sides)).collect();
        let mut adjacency = Adjacency {
            sides,
            fork_starts: vec![0],
            fork_triangles: Vec::new(),
            open: Vec::new(),
            at_mesh_edge: Vec::new(),
        };
        for ends in ends {
            for fork in ends.forks {
                adjacency.fork_triangles.extend(fork);
                adjacency.fork_starts.push(adjacency.fork_triangles.len() as u32);
            }
            adjacency.open.extend(ends.open);
            adjacency.at_mesh_edge.extend(ends.at_mesh_edge);
        }
        adjacency.find_copies(mesh);
        for list in [&mut adjacency.open, &mut adjacency.at_mesh_edge] {
            list.sort_unstable();
            list.dedup();
        }
        adjacency
    }

    /// Two copies of a face do not continue each other: the mesh ends where only they lie. They have three
    /// edges in common, so two sides have the same neighbour, or two edges are forks.
    fn find_copies(&mut self, mesh: &TileMesh) {
        let suspect = |own: &u32| {
            let ([a, b, c], own) = (self.sides(*own as usize), *own);
            (a == b && b != own) || (b == c && c != own) || (c == a && a != own)
        };
        let mut suspects: Vec<u32> = (0..self.len() as u32).into_par_iter().filter(suspect).collect();
        suspects.extend(&self.fork_triangles);
        for t in suspects {
            let [a, b, c] = mesh.triangles[t as usize];
            for (side, [v, w]) in self.sides(t as usize).into_iter().zip([[a, b], [b, c], [c, a]]) {
                let both = [t, side].map(|t| real_corners(mesh, t));
                if side != t && both[0].is_some() && both[0] == both[1] && !may_lack(mesh, v, w) {
                    self.at_mesh_edge.push(t);
                }
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
        let [a, b, c] = &self.sides[triangle];
        [a, b, c].map(|side| side.load(Ordering::Relaxed))
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
        let adjacency =
            Adjacency::of(&Bands::of(&mesh(&[[0, 1, 2], [2, 1, 3], [1, 2, 4], [0, 0, 3], [3, 4, 1]], &[true; 5])));
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
            let adjacency = Adjacency::of(&Bands::of(&mesh));
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
