//! Connected components of selected triangles, by shared edges.

use super::edges::Edges;
use super::state::NONE;
use crate::geometry::PlanBox;
use crate::tile::TileMesh;

/// A partition of the selected triangles into components, numbered by ascending lowest triangle.
pub struct Components {
    /// Component of each triangle; [`NONE`] for those not selected.
    pub of: Vec<u32>,
    /// What is known of each component.
    pub parts: Vec<Part>,
}

/// What the steps of the recipe ask of a component.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Lowest local triangle.
    pub lowest: u32,
    /// Size in the unit of the area rule (see [`super::Sizes`]).
    pub size: u64,
    /// Box in plan of its vertices, local metres.
    pub bounds: PlanBox,
    /// Whether a triangle beyond the halo may be joined to it.
    pub open: bool,
    /// Whether a triangle of unknown state is joined to it.
    pub doubtful: bool,
    /// Whether an edge of the mesh bounds it.
    pub at_mesh_edge: bool,
}

impl Part {
    /// Whether the component is whole: exactly what it would be if everything had been loaded.
    pub fn closed(&self) -> bool {
        !self.open && !self.doubtful
    }
}

impl Components {
    /// Components of the triangles for which `selected` holds; `unknown` tells which others might turn
    /// out to be selected too. `sizes` gives the size of each triangle.
    pub fn of(
        mesh: &TileMesh,
        edges: &Edges,
        sizes: &[u64],
        selected: impl Fn(usize) -> bool,
        unknown: impl Fn(usize) -> bool,
    ) -> Components {
        let n = mesh.triangles.len();
        let mut parent: Vec<u32> = (0..n as u32).collect();
        for (_, around) in edges.iter() {
            let mut last = None;
            for &t in around.iter().filter(|&&t| selected(t as usize)) {
                if let Some(other) = last.replace(t) {
                    join(&mut parent, other, t);
                }
            }
        }
        let mut of = vec![NONE; n];
        let mut parts: Vec<Part> = Vec::new();
        for t in (0..n).filter(|&t| selected(t)) {
            let root = find(&mut parent, t as u32) as usize;
            if root == t {
                of[t] = parts.len() as u32;
                parts.push(Part::starting_at(t as u32));
            } else {
                of[t] = of[root];
            }
            let part = &mut parts[of[t] as usize];
            part.size += sizes[t];
            mesh.triangles[t].iter().for_each(|&v| part.bounds.include(mesh.positions[v as usize]));
        }
        let mut components = Components { of, parts };
        components.look_around(mesh, edges, unknown);
        components
    }

    fn look_around(&mut self, mesh: &TileMesh, edges: &Edges, unknown: impl Fn(usize) -> bool) {
        for (ends, around) in edges.iter() {
            // Around a complete vertex everything is loaded, so an edge can only lack a triangle where
            // both its ends are incomplete.
            let open = ends.iter().all(|&v| !mesh.complete[v as usize]);
            let doubtful = around.iter().any(|&t| unknown(t as usize));
            let mesh_edge = !open && ends[0] != ends[1] && lone(mesh, around);
            if open || doubtful || mesh_edge {
                for &t in around {
                    if let Some(part) = self.parts.get_mut(self.of[t as usize] as usize) {
                        part.open |= open;
                        part.doubtful |= doubtful;
                        part.at_mesh_edge |= mesh_edge;
                    }
                }
            }
        }
    }

    /// The component of a triangle, if it is in one.
    pub fn part(&self, triangle: usize) -> Option<&Part> {
        self.parts.get(self.of[triangle] as usize)
    }
}

impl Part {
    fn starting_at(lowest: u32) -> Part {
        Part { lowest, size: 0, bounds: PlanBox::EMPTY, open: false, doubtful: false, at_mesh_edge: false }
    }
}

/// Whether only one triangle lies at an edge. Faces that name a vertex twice, and copies of a face, do not
/// count.
fn lone(mesh: &TileMesh, around: &[u32]) -> bool {
    let mut only = None;
    for &t in around {
        let mut corners = mesh.triangles[t as usize];
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

/// The root is the lowest member, always.
fn find(parent: &mut [u32], mut t: u32) -> u32 {
    while parent[t as usize] != t {
        let up = parent[parent[t as usize] as usize];
        parent[t as usize] = up;
        t = up;
    }
    t
}

fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parent, a), find(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}
