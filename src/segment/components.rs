//! Connected components of selected triangles, by shared edges.

use super::Sizes;
use super::adjacency::Adjacency;
use super::state::NONE;
use crate::geometry::PlanBox;
use crate::tile::TileMesh;
use std::ops::Range;

/// A partition of the selected triangles into components, numbered by ascending lowest triangle.
pub struct Components {
    /// Component of each triangle; [`NONE`] for those not selected.
    pub of: Vec<u32>,
    /// Lowest local triangle of each component.
    pub lowest: Vec<u32>,
    /// Size of each component: exact where it is below what was asked for, and not below that elsewhere.
    pub size: Vec<u64>,
}

impl Components {
    /// Components of the triangles for which `selected` holds.
    pub fn of(adjacency: &Adjacency, selected: impl Fn(usize) -> bool) -> Components {
        Components::at_least(adjacency, selected, 0, |_| 0)
    }

    /// The same, and which of them are as large as the smallest grain.
    pub fn sized(
        mesh: &TileMesh,
        adjacency: &Adjacency,
        sizes: &Sizes,
        selected: impl Fn(usize) -> bool,
    ) -> Components {
        Components::at_least(adjacency, selected, sizes.smallest, |t| sizes.of(mesh, t))
    }

    /// Components, each measured until it is known to be so large.
    fn at_least(
        adjacency: &Adjacency,
        selected: impl Fn(usize) -> bool,
        enough: u64,
        size_of: impl Fn(u32) -> u64,
    ) -> Components {
        // First the way to a lower triangle of the same component, or to itself; `NONE` if not selected, or not
        // yet looked at. `NONE` is above all of them.
        let mut of = vec![NONE; adjacency.len()];
        for t in (0..of.len()).filter(|&t| selected(t)) {
            let sides = adjacency.sides(t);
            let ways = sides.map(|side| of[side as usize]);
            let low = ways[0].min(ways[1]).min(ways[2]);
            if low == NONE {
                of[t] = t as u32;
                continue;
            }
            // Nearly always all lead to the lowest at once.
            let one = ways.iter().fold(true, |one, &way| one & ((way == low) | (way == NONE)));
            of[t] = if one && of[low as usize] == low { low } else { join_sides(&mut of, sides) };
        }
        for fork in adjacency.forks() {
            join_all(&mut of, fork.iter().copied().filter(|&t| selected(t as usize)));
        }
        let (mut lowest, mut size) = (Vec::new(), Vec::new());
        for t in 0..of.len() {
            if of[t] == NONE {
                continue;
            }
            if of[t] == t as u32 {
                of[t] = lowest.len() as u32;
                lowest.push(t as u32);
                size.push(0);
            } else {
                // The way leads downward, where numbers of components stand already.
                of[t] = of[of[t] as usize];
            }
            let size = &mut size[of[t] as usize];
            if *size < enough {
                *size += size_of(t as u32);
            }
        }
        Components { of, lowest, size }
    }

    /// How many components there are.
    pub fn count(&self) -> usize {
        self.lowest.len()
    }

    /// Triangles of one component that follow one another, with the number of the first; all of them, and all that
    /// are in none, by ascending number.
    pub fn runs(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        self.of.chunk_by(|a, b| a == b).scan(0, |end, run| {
            let start = *end;
            *end += run.len();
            Some((run[0], start..*end))
        })
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
        for (part, run) in self.runs() {
            if let Some(bounds) = bounds.get_mut(part as usize)
                && asked(part as usize)
            {
                run.flat_map(|t| mesh.corners(t as u32)).for_each(|p| bounds.include(p));
            }
        }
        bounds.iter().map(|b| b.width_m() > width_m).collect()
    }
}

/// Joins the components of the triangles at three sides, as far as these have one, and gives their lowest triangle.
fn join_sides(of: &mut [u32], sides: [u32; 3]) -> u32 {
    let mut low = NONE;
    for side in sides {
        if of[side as usize] == NONE {
            continue;
        }
        let other = root(of, side);
        if low != NONE && low != other {
            of[low.max(other) as usize] = low.min(other);
        }
        low = low.min(other);
    }
    low
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
