//! Connected components of selected triangles, by shared edges.

use super::Sizes;
use super::adjacency::Adjacency;
use super::state::NONE;
use crate::geometry::PlanBox;
use crate::tile::TileMesh;

/// A partition of the selected triangles into components, numbered by ascending lowest triangle.
pub struct Components {
    /// Component of each triangle; [`NONE`] for those not selected.
    pub of: Vec<u32>,
    /// Lowest local triangle of each component.
    pub lowest: Vec<u32>,
}

impl Components {
    /// Components of the triangles for which `selected` holds.
    pub fn of(adjacency: &Adjacency, selected: impl Fn(usize) -> bool) -> Components {
        // First the way to a lower triangle of the same component, or to itself; `NONE` if not selected.
        let mut of = vec![NONE; adjacency.len()];
        for t in (0..of.len()).filter(|&t| selected(t)) {
            let here = t as u32;
            let mut low = here;
            for side in adjacency.sides(t) {
                if side < here && of[side as usize] != NONE {
                    let other = root(&mut of, side);
                    if low != here && low != other {
                        of[low.max(other) as usize] = low.min(other);
                    }
                    low = low.min(other);
                }
            }
            of[t] = low;
        }
        for fork in adjacency.forks() {
            join_all(&mut of, fork.iter().copied().filter(|&t| selected(t as usize)));
        }
        let mut lowest = Vec::new();
        for t in 0..of.len() {
            if of[t] == t as u32 {
                of[t] = lowest.len() as u32;
                lowest.push(t as u32);
            } else if of[t] != NONE {
                // The way leads downward, where numbers of components stand already.
                of[t] = of[of[t] as usize];
            }
        }
        Components { of, lowest }
    }

    /// How many components there are.
    pub fn count(&self) -> usize {
        self.lowest.len()
    }

    /// Size of each component in the unit of [`Sizes`]: exact where it is below the smallest grain, and not
    /// below it elsewhere.
    pub fn sizes(&self, mesh: &TileMesh, sizes: &Sizes) -> Vec<u64> {
        let mut size = vec![0; self.count()];
        for (t, &part) in self.of.iter().enumerate() {
            if let Some(size) = size.get_mut(part as usize)
                && *size < sizes.smallest
            {
                *size += sizes.of(mesh, t as u32);
            }
        }
        size
    }

    /// Which components hold one of these triangles.
    pub fn holding(&self, triangles: &[u32]) -> Vec<bool> {
        let mut holding = vec![false; self.count()];
        for &t in triangles {
            self.mark(t, &mut holding);
        }
        holding
    }

    /// Which components lie side by side with one of these triangles, which are of none; ascending.
    pub fn beside(&self, adjacency: &Adjacency, triangles: &[u32]) -> Vec<bool> {
        let mut beside = vec![false; self.count()];
        for &t in triangles {
            adjacency.sides(t as usize).into_iter().for_each(|t| self.mark(t, &mut beside));
        }
        for fork in adjacency.forks().filter(|f| f.iter().any(|t| triangles.binary_search(t).is_ok())) {
            fork.iter().for_each(|&t| self.mark(t, &mut beside));
        }
        beside
    }

    fn mark(&self, triangle: u32, marks: &mut [bool]) {
        if let Some(mark) = marks.get_mut(self.of[triangle as usize] as usize) {
            *mark = true;
        }
    }

    /// Which components, of those asked for, are wider in plan than so many metres; none is for 0.
    pub fn wider_than(&self, mesh: &TileMesh, width_m: f64, asked: impl Fn(usize) -> bool) -> Vec<bool> {
        if width_m == 0.0 {
            return vec![false; self.count()];
        }
        let mut bounds = vec![PlanBox::EMPTY; self.count()];
        for (t, &part) in self.of.iter().enumerate() {
            if let Some(bounds) = bounds.get_mut(part as usize)
                && asked(part as usize)
            {
                mesh.corners(t as u32).into_iter().for_each(|p| bounds.include(p));
            }
        }
        bounds.iter().map(|b| b.width_m() > width_m).collect()
    }
}

/// The lowest triangle that the way of a triangle leads to. The way is shortened.
pub(super) fn root(parent: &mut [u32], mut t: u32) -> u32 {
    while parent[t as usize] != t {
        let up = parent[parent[t as usize] as usize];
        parent[t as usize] = up;
        t = up;
    }
    t
}

/// Joins all of these.
pub(super) fn join_all(parent: &mut [u32], members: impl Iterator<Item = u32>) {
    let mut last = None;
    for t in members {
        if let Some(other) = last.replace(t) {
            let (a, b) = (root(parent, other), root(parent, t));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
}
