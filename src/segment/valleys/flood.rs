//! A flood: how far each vertex lies from the nearest source, along edges, and by which way.
//!
//! Lengths are whole numbers, so that a distance is the same whichever way, by whichever thread and in whichever tile
//! it was found. Of two ways of the same length that comes by the lower last vertex counts. So what a vertex gets
//! depends on what lies within the reach, and on nothing else.

use super::neighbours::Neighbours;
use rayon::prelude::*;

/// Parts of the mean edge length in which distances are counted.
pub const PARTS: f64 = 256.0;
/// Further than any reach.
pub const FAR: u16 = u16::MAX;
/// Vertices that one thread floods at a time.
const BAND: usize = if cfg!(test) { 16 } else { 1 << 16 };

/// A length in parts of the mean edge length; at least one part, so that every way has an end.
#[inline]
pub fn parts(edges: f64) -> u32 {
    // Beyond the longest reach all are the same.
    (edges * PARTS).round().clamp(1.0, 65_000.0) as u32
}

/// What a flood reached.
pub struct Flood {
    /// Distance of each vertex from the nearest source, in parts; [`FAR`] beyond the reach.
    pub distance: Vec<u16>,
    /// The vertex before it on the way; itself for a source.
    by: Vec<u32>,
}

impl Flood {
    /// A flood that has no source yet, over so many vertices.
    pub fn dry(vertices: usize) -> Flood {
        Flood { distance: vec![FAR; vertices], by: vec![u32::MAX; vertices] }
    }

    /// Floods as far as `reach` parts. `start` gives the distance with which a source begins; none for other vertices.
    /// `cost` gives the length of the step from a vertex to its
    /// neighbour; none where there is no way.
    pub fn from(
        neighbours: &Neighbours,
        start: impl Fn(usize) -> Option<u16> + Sync,
        reach: u16,
        cost: impl Fn(usize, usize) -> Option<u32> + Sync,
    ) -> Flood {
        let mut flood = Flood::dry(neighbours.len());
        flood.rise(neighbours, start, reach, cost);
        flood
    }

    /// Goes on from sources that are added to those of before, which `start` may give again. With the same `reach` and
    /// `cost` it becomes what it would be if all had begun together: a distance is the least of all ways, and only what
    /// a new source leads to sooner changes.
    pub fn rise(
        &mut self,
        neighbours: &Neighbours,
        start: impl Fn(usize) -> Option<u16> + Sync,
        reach: u16,
        cost: impl Fn(usize, usize) -> Option<u32> + Sync,
    ) {
        let bands = neighbours.len().div_ceil(BAND);
        let mut waiting: Vec<Vec<Step>> = (0..bands).map(|_| Vec::new()).collect();
        let mut first = true;
        while first || waiting.iter().any(|steps| !steps.is_empty()) {
            let crossing: Vec<Vec<Step>> = self
                .distance
                .par_chunks_mut(BAND)
                .zip(self.by.par_chunks_mut(BAND))
                .zip(&waiting)
                .enumerate()
                .map(|(band, ((distance, by), steps))| {
                    let mut front = Front { first: BAND * band, distance, by, reach, levels: Vec::new() };
                    match first {
                        true => front.begin(&start),
                        false => steps.iter().for_each(|step| front.reach(*step)),
                    }
                    if front.levels.is_empty() { Vec::new() } else { front.spread(neighbours, &cost) }
                })
                .collect();
            waiting.iter_mut().for_each(Vec::clear);
            crossing.into_iter().flatten().for_each(|step| waiting[step.to as usize / BAND].push(step));
            first = false;
        }
    }

    /// Whether a vertex was reached.
    pub fn reached(&self, vertex: usize) -> bool {
        self.distance[vertex] != FAR
    }

    /// The source from which the way to a vertex begins; none where none leads there.
    pub fn source(&self, vertex: usize) -> Option<usize> {
        let mut at = vertex;
        if !self.reached(at) {
            return None;
        }
        while self.by[at] as usize != at {
            at = self.by[at] as usize;
        }
        Some(at)
    }
}

/// A step of a way.
#[derive(Clone, Copy)]
struct Step {
    to: u32,
    by: u32,
    distance: u16,
}

/// The vertices of a band while they are flooded.
struct Front<'f> {
    first: usize,
    distance: &'f mut [u16],
    by: &'f mut [u32],
    reach: u16,
    /// Vertices from which the flood goes on, by their distance.
    levels: Vec<Vec<u32>>,
}

impl Front<'_> {
    fn begin(&mut self, start: &impl Fn(usize) -> Option<u16>) {
        for to in self.first..self.first + self.distance.len() {
            if let Some(distance) = start(to).filter(|&distance| distance <= self.reach) {
                self.reach(Step { to: to as u32, by: to as u32, distance });
            }
        }
    }

    /// Takes a step to a vertex of the band, if it is shorter than what led there.
    #[inline]
    fn reach(&mut self, Step { to, by, distance }: Step) {
        let place = to as usize - self.first;
        let known = self.distance[place];
        if distance < known {
            self.distance[place] = distance;
            self.by[place] = by;
            if self.levels.is_empty() {
                self.levels.resize(1 + usize::from(self.reach), Vec::new());
            }
            self.levels[usize::from(distance)].push(to);
        } else if distance == known && self.by[place] != to && (by == to || by < self.by[place]) {
            self.by[place] = by;
        }
    }

    /// Spreads within the band, nearest vertices first, and gives the steps that lead out of it.
    fn spread(&mut self, neighbours: &Neighbours, cost: &impl Fn(usize, usize) -> Option<u32>) -> Vec<Step> {
        let mut crossing = Vec::new();
        for level in 0..self.levels.len() {
            for v in std::mem::take(&mut self.levels[level]) {
                let from = v as usize;
                // A shorter way was found since.
                if usize::from(self.distance[from - self.first]) != level {
                    continue;
                }
                for &to in neighbours.around(from) {
                    let inside = self.distance.get((to as usize).wrapping_sub(self.first));
                    if inside.is_some_and(|&known| usize::from(known) <= level) {
                        continue;
                    }
                    let Some(step) = cost(from, to as usize) else { continue };
                    let distance = level as u32 + step;
                    if distance > u32::from(self.reach) {
                        continue;
                    }
                    let step = Step { to, by: v, distance: distance as u16 };
                    if inside.is_some() { self.reach(step) } else { crossing.push(step) }
                }
            }
        }
        crossing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;
    use crate::segment::bands::Bands;
    use crate::tile::TileMesh;

    /// Ways over any heap of faces, held against a search that relaxes all edges until nothing changes.
    #[test]
    fn distances_and_ways_are_the_shortest_whatever_bands_they_cross() {
        let mut seed = 23u64;
        let mut below = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let (mut crossed, mut ties, mut sooner) = (0, 0, 0);
        for _ in 0..300 {
            let (vertices, faces) = (4 + below(120), below(200));
            let mesh = TileMesh {
                triangles: (0..faces).map(|_| [0; 3].map(|_| below(vertices) as u32)).collect(),
                positions: vec![DVec3::ZERO; vertices as usize],
                ..TileMesh::default()
            };
            let neighbours = Neighbours::of(&Bands::of(&mesh));
            let (first, closed, reach) = (below(5), below(7), 1 + below(20) as u16);
            let start = |v: usize| (v as u64 % 9 == first).then_some((v % 4) as u16);
            let cost = |a: usize, b: usize| (b as u64 % 7 != closed).then_some(1 + ((a + b) % 3) as u32);
            let flood = Flood::from(&neighbours, start, reach, cost);
            let n = vertices as usize;
            let mut later = Flood::from(&neighbours, |v| start(v).filter(|_| v as u64 % 5 < 3), reach, cost);
            let earlier = later.distance.clone();
            later.rise(&neighbours, start, reach, cost);
            assert!(later.distance == flood.distance && later.by == flood.by, "sources that came later");
            sooner += (0..n).filter(|&v| flood.distance[v] < earlier[v] && earlier[v] != FAR).count();
            let mut distance: Vec<u32> =
                (0..n).map(|v| start(v).filter(|&d| d <= reach).map_or(u32::MAX, u32::from)).collect();
            loop {
                let before = distance.clone();
                for v in (0..n).filter(|&v| before[v] != u32::MAX) {
                    for &u in neighbours.around(v) {
                        let Some(step) = cost(v, u as usize) else { continue };
                        let there = before[v] + step;
                        if there <= u32::from(reach) {
                            distance[u as usize] = distance[u as usize].min(there);
                        }
                    }
                }
                if distance == before {
                    break;
                }
            }
            for v in 0..n {
                if distance[v] == u32::MAX {
                    assert_eq!((flood.distance[v], flood.source(v)), (FAR, None));
                    continue;
                }
                assert_eq!(u32::from(flood.distance[v]), distance[v]);
                // A source keeps to itself what others reach no sooner.
                if start(v).is_some_and(|start| u32::from(start) == distance[v]) {
                    assert_eq!(flood.source(v), Some(v));
                    continue;
                }
                let leads = |u: u32| {
                    let from = distance[u as usize];
                    from != u32::MAX && cost(u as usize, v).is_some_and(|step| from + step == distance[v])
                };
                let last: Vec<u32> = neighbours.around(v).iter().copied().filter(|&u| leads(u)).collect();
                assert_eq!(Some(flood.by[v]), last.iter().copied().min());
                ties += usize::from(last.len() > 1);
                crossed += usize::from(flood.source(v).is_some_and(|s| s / BAND != v / BAND));
            }
        }
        assert!(crossed > 1000 && ties > 1000, "{crossed} ways crossed bands, {ties} were not the only ones");
        assert!(sooner > 1000, "only {sooner} were reached sooner from sources that came later");
    }
}
