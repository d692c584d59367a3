//! Connected components of selected triangles, by shared edges.

use super::Sizes;
use super::adjacency::Adjacency;
use super::state::NONE;
use crate::geometry::PlanBox;
use crate::tile::TileMesh;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// Triangles that one thread joins at a time.
const BAND: usize = if cfg!(test) { 5 } else { 1 << 17 };

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
    pub fn of(adjacency: &Adjacency, selected: impl Fn(usize) -> bool + Sync) -> Components {
        Components::at_least(adjacency, selected, 0, |_| 0)
    }

    /// The same, and which of them are as large as the smallest grain.
    pub fn sized(
        mesh: &TileMesh,
        adjacency: &Adjacency,
        sizes: &Sizes,
        selected: impl Fn(usize) -> bool + Sync,
    ) -> Components {
        Components::at_least(adjacency, selected, sizes.smallest, |t| sizes.of(mesh, t))
    }

    /// Components, each measured until it is known to be so large.
    fn at_least(
        adjacency: &Adjacency,
        selected: impl Fn(usize) -> bool + Sync,
        enough: u64,
        size_of: impl Fn(u32) -> u64 + Sync,
    ) -> Components {
        // Bands of triangles by themselves, then what crosses their borders.
        let none = |n: usize| rayon::iter::repeat_n(NONE, n).collect::<Vec<u32>>();
        let mut parent = none(adjacency.len());
        let crossings: Vec<Vec<[u32; 2]>> = parent
            .par_chunks_mut(BAND)
            .enumerate()
            .map(|(band, parent)| Forest { first: band * BAND, parent }.grow(adjacency, &selected))
            .collect();
        let mut forest = Forest { first: 0, parent: &mut parent };
        crossings.into_iter().flatten().for_each(|[a, b]| forest.join(a, b));
        for fork in adjacency.forks() {
            forest.join_all(fork.iter().copied().filter(|&t| selected(t as usize)));
        }
        let lowest: Vec<u32> = (0..parent.len() as u32).into_par_iter().filter(|&t| parent[t as usize] == t).collect();
        let mut of = none(parent.len());
        let measured: Vec<InBand> = of
            .par_chunks_mut(BAND)
            .enumerate()
            .map(|(band, of)| number(&parent, &lowest, BAND * band, of, (enough, &size_of)))
            .collect();
        let mut size = vec![0; lowest.len()];
        for in_band in measured {
            let begun = size[in_band.first..].iter_mut().zip(in_band.begun);
            begun.for_each(|(size, in_band)| *size += in_band);
            in_band.earlier.into_iter().for_each(|(part, in_band)| size[part as usize] += in_band);
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

    /// Folds what belongs to each component of those asked for: `add` takes triangles that follow one another, band by
    /// band on all threads, and `merge` joins bands. Their order must not matter.
    pub fn fold<A: Copy + Send + Sync>(
        &self,
        nothing: A,
        asked: impl Fn(usize) -> bool + Sync,
        add: impl Fn(A, Range<usize>) -> A + Sync,
        merge: impl Fn(A, A) -> A,
    ) -> Vec<A> {
        let in_band = |(band, of): (usize, &[u32])| {
            let (mut parts, mut start) = (BTreeMap::new(), BAND * band);
            for run in of.chunk_by(|a, b| a == b) {
                let triangles = start..start + run.len();
                start = triangles.end;
                if run[0] != NONE && asked(run[0] as usize) {
                    let part = parts.entry(run[0]).or_insert(nothing);
                    *part = add(*part, triangles);
                }
            }
            parts
        };
        let bands: Vec<BTreeMap<u32, A>> = self.of.par_chunks(BAND).enumerate().map(in_band).collect();
        let mut all = vec![nothing; self.count()];
        for (part, value) in bands.into_iter().flatten() {
            all[part as usize] = merge(all[part as usize], value);
        }
        all
    }

    /// Which components, of those asked for, are wider in plan than so many metres; none is for 0.
    pub fn wider_than(&self, mesh: &TileMesh, width_m: f64, asked: impl Fn(usize) -> bool + Sync) -> Vec<bool> {
        if width_m == 0.0 {
            return vec![false; self.count()];
        }
        let add = |mut bounds: PlanBox, run: Range<usize>| {
            run.flat_map(|t| mesh.corners(t as u32)).for_each(|p| bounds.include(p));
            bounds
        };
        let merge = |mut bounds: PlanBox, other: PlanBox| {
            bounds.merge(&other);
            bounds
        };
        let bounds = self.fold(PlanBox::EMPTY, asked, add, merge);
        bounds.iter().map(|b| b.width_m() > width_m).collect()
    }
}

/// What of each component lies in a band of triangles.
struct InBand {
    /// Number of the first component that begins in the band.
    first: usize,
    /// Sizes of those that begin there.
    begun: Vec<u64>,
    /// Sizes of those that began before, by their numbers.
    earlier: BTreeMap<u32, u64>,
}

impl InBand {
    fn size(&mut self, part: u32) -> &mut u64 {
        match (part as usize).checked_sub(self.first) {
            Some(place) => &mut self.begun[place],
            None => self.earlier.entry(part).or_default(),
        }
    }
}

/// Numbers the components of a band of triangles, and measures what of each lies in it, until that is enough.
fn number(
    parent: &[u32],
    lowest: &[u32],
    first: usize,
    of: &mut [u32],
    (enough, size_of): (u64, &impl Fn(u32) -> u64),
) -> InBand {
    let begin = lowest.partition_point(|&t| (t as usize) < first);
    let mut sizes = InBand { first: begin, begun: Vec::new(), earlier: BTreeMap::new() };
    for (place, &up) in parent[first..first + of.len()].iter().enumerate() {
        if up == NONE {
            continue;
        }
        let t = (first + place) as u32;
        let part = if up == t {
            sizes.begun.push(0);
            (begin + sizes.begun.len() - 1) as u32
        } else if up as usize >= first {
            // The way leads downward, where numbers of components stand already.
            of[up as usize - first]
        } else {
            let mut low = up;
            while parent[low as usize] != low {
                low = parent[low as usize];
            }
            lowest.partition_point(|&t| t < low) as u32
        };
        of[place] = part;
        if enough > 0 {
            let size = sizes.size(part);
            if *size < enough {
                *size += size_of(t);
            }
        }
    }
    sizes
}

/// Ways from triangles to lower ones of the same component: from the lowest to itself, [`NONE`] for a triangle that is
/// not selected, or not yet looked at, which is above all of them.
pub(super) struct Forest<'p> {
    /// The triangle of the first way.
    pub(super) first: usize,
    /// The ways of the triangles from there on.
    pub(super) parent: &'p mut [u32],
}

impl Forest<'_> {
    /// Joins the selected triangles, as far as they are side by side within the forest. Those that lie beside lower ones
    /// outside are returned with these.
    fn grow(&mut self, adjacency: &Adjacency, selected: &impl Fn(usize) -> bool) -> Vec<[u32; 2]> {
        let mut crossings = Vec::new();
        for t in (self.first..self.first + self.parent.len()).filter(|&t| selected(t)) {
            let sides = adjacency.sides(t);
            let ways = sides.map(|side| self.way(side));
            if (sides[0].min(sides[1]).min(sides[2]) as usize) < self.first {
                let below = sides.into_iter().filter(|&s| (s as usize) < self.first && selected(s as usize));
                crossings.extend(below.map(|side| [t as u32, side]));
            }
            let low = ways[0].min(ways[1]).min(ways[2]);
            // Nearly always all lead to the lowest at once.
            let one = ways.iter().fold(true, |one, &way| one & ((way == low) | (way == NONE)));
            self.parent[t - self.first] = match low {
                NONE => t as u32,
                low if one && self.way(low) == low => low,
                _ => self.join_sides(sides),
            };
        }
        crossings
    }

    /// The way of a triangle; [`NONE`] also for those outside.
    fn way(&self, t: u32) -> u32 {
        self.parent.get((t as usize).wrapping_sub(self.first)).copied().unwrap_or(NONE)
    }

    /// Joins the components of the triangles at three sides, as far as these have one, and gives their lowest triangle.
    fn join_sides(&mut self, sides: [u32; 3]) -> u32 {
        let mut low = NONE;
        for side in sides {
            if self.way(side) == NONE {
                continue;
            }
            let other = self.root(side);
            if low != NONE && low != other {
                self.parent[low.max(other) as usize - self.first] = low.min(other);
            }
            low = low.min(other);
        }
        low
    }

    /// The lowest triangle that the way of a triangle leads to. The way is shortened.
    pub(super) fn root(&mut self, mut t: u32) -> u32 {
        while self.parent[t as usize - self.first] != t {
            let up = self.parent[self.parent[t as usize - self.first] as usize - self.first];
            self.parent[t as usize - self.first] = up;
            t = up;
        }
        t
    }

    /// Joins two triangles.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize - self.first] = a.min(b);
    }

    /// Joins all of these.
    pub(super) fn join_all(&mut self, members: impl Iterator<Item = u32>) {
        let mut last = None;
        for t in members {
            if let Some(other) = last.replace(t) {
                self.join(other, t);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bands::Bands;
    use super::*;
    use crate::geometry::DVec3;

    /// Components by spreading from each triangle that has none yet.
    fn plainly(adjacency: &Adjacency, selected: &[bool]) -> (Vec<u32>, Vec<u32>) {
        let (mut of, mut lowest) = (vec![NONE; selected.len()], Vec::new());
        for t in (0..selected.len()).filter(|&t| selected[t]) {
            if of[t] != NONE {
                continue;
            }
            let mut spread = vec![t as u32];
            while let Some(at) = spread.pop() {
                if !selected[at as usize] || of[at as usize] != NONE {
                    continue;
                }
                of[at as usize] = lowest.len() as u32;
                spread.extend(adjacency.sides(at as usize));
                adjacency.forks().filter(|f| f.contains(&at)).for_each(|f| spread.extend(f));
            }
            lowest.push(t as u32);
        }
        (of, lowest)
    }

    /// Heaps of faces, in which components wind through many bands and are joined by forks.
    #[test]
    fn components_are_those_of_a_flood_whatever_bands_they_cross() {
        let mut seed = 3u64;
        let mut below = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let (mut crossing, mut forks) = (0, 0);
        for _ in 0..2000 {
            let (vertices, faces) = (3 + below(40), below(60));
            let mesh = TileMesh {
                triangles: (0..faces).map(|_| [0; 3].map(|_| below(vertices) as u32)).collect(),
                complete: vec![true; vertices as usize],
                positions: vec![DVec3::ZERO; vertices as usize],
                ..TileMesh::default()
            };
            let adjacency = Adjacency::of(&Bands::of(&mesh));
            let selected: Vec<bool> = (0..faces).map(|_| below(5) > 0).collect();
            let enough = below(6);
            let found = Components::at_least(&adjacency, |t| selected[t], enough, |t| u64::from(t % 3));
            let (of, lowest) = plainly(&adjacency, &selected);
            assert_eq!((&found.of, &found.lowest), (&of, &lowest));
            for (part, &size) in found.size.iter().enumerate() {
                let members = (0..of.len()).filter(|&t| of[t] == part as u32);
                let whole: u64 = members.clone().map(|t| t as u64 % 3).sum();
                assert!(size == whole || (size >= enough && size <= whole), "{size} of {whole}, {enough} is enough");
                crossing += usize::from(members.max().is_some_and(|t| t / BAND > lowest[part] as usize / BAND));
            }
            forks += adjacency.forks().count();
        }
        assert!(crossing > 1000 && forks > 1000, "{crossing} crossing bands, {forks} forks");
    }
}
