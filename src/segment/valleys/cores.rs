//! Cores: what of a stone lies well away from all valleys, grown back to their rims.

use super::bend::Bend;
use super::flood::{Flood, parts};
use super::look::Look;
use super::neighbours::Neighbours;
use super::spread::Spread;
use super::{NONE, UNKNOWN};
use crate::geometry::DVec3;
use crate::segment::components::Forest;
use glam::Vec3A;
use rayon::prelude::*;

/// Vertices that one thread joins at a time.
const BAND: usize = if cfg!(test) { 16 } else { 1 << 16 };

/// The surface of a tile, as cores and growth see it.
pub struct Ground<'g> {
    /// Local metres.
    pub positions: &'g [DVec3],
    /// Who lies beside whom.
    pub neighbours: &'g Neighbours,
    /// Bending of each vertex; of no meaning where it is unknown, as the normals.
    pub bends: &'g [Bend],
    /// Smoothed normals.
    pub normals: &'g [Vec3A],
    /// Vertices whose bending hangs on what is not loaded; none where everything is.
    pub unknown: Option<&'g [bool]>,
    /// A third of the triangles around each vertex, m².
    pub area_m2: &'g [f32],
    /// Mean edge length of the survey, m.
    pub mean_edge_m: f64,
}

impl Ground<'_> {
    /// Whether a vertex lies in a valley, or at an edge that spans a gap.
    fn divides(&self, v: usize, look: &Look) -> bool {
        f64::from(self.bends[v].least) < -look.valley_depth || self.bends[v].gap
    }

    /// Whether the bending of a vertex is not known.
    pub fn is_unknown(&self, v: usize) -> bool {
        self.unknown.is_some_and(|unknown| unknown[v])
    }

    /// Length of an edge in mean edge lengths.
    #[inline]
    pub fn edges(&self, a: usize, b: usize) -> f64 {
        (self.positions[a] - self.positions[b]).length() / self.mean_edge_m
    }
}

/// The cores of a tile.
pub struct Cores {
    /// Core of each vertex; [`NONE`], or [`UNKNOWN`].
    pub of: Vec<u32>,
    /// Whether something of a core may lie where nothing is known.
    pub open: Vec<bool>,
}

impl Cores {
    /// Finds the cores of a tile.
    ///
    /// Vertices further than `bridge_edges` from all valleys and edges of the mesh hang together in seeds, so that
    /// narrow bridges between stones are cut. A seed of at least `seed_area_m2` is a core, and takes what lies within
    /// `refill_edges` of it, on its side of the valleys.
    pub fn of(ground: &Ground, look: &Look) -> Cores {
        let neighbours = ground.neighbours;
        let vertices = neighbours.len();
        let divides: Vec<bool> =
            (0..vertices).into_par_iter().with_min_len(1 << 12).map(|v| ground.divides(v, look)).collect();
        let length = |a: usize, b: usize| Some(parts(ground.edges(a, b)));
        let bridge = parts(look.bridge_edges) as u16;
        let shore = Flood::from(
            neighbours,
            |v| (!ground.is_unknown(v) && (divides[v] || neighbours.at_mesh_edge(v))).then_some(0),
            bridge,
            length,
        );
        let doubt = ground.unknown.map(|unknown| Flood::from(neighbours, |v| unknown[v].then_some(0), bridge, length));
        let doubtful = |v: usize| !shore.reached(v) && doubt.as_ref().is_some_and(|doubt| doubt.reached(v));
        let mut of = seeds(neighbours, |v| !shore.reached(v) && !doubtful(v));
        let count = number(&mut of);
        let mut area_m2 = vec![0.0f64; count];
        for (v, &seed) in of.iter().enumerate().filter(|(_, seed)| **seed != NONE) {
            area_m2[seed as usize] += f64::from(ground.area_m2[v]);
        }
        if ground.unknown.is_some() {
            (0..vertices).filter(|&v| doubtful(v) || ground.is_unknown(v)).for_each(|v| of[v] = UNKNOWN);
        }
        let open = beside_unknown(neighbours, &of, count);
        let mut kept = 0;
        let fate: Vec<u32> = (0..count)
            .map(|seed| match (area_m2[seed] >= look.seed_area_m2.max(f64::MIN_POSITIVE), open[seed]) {
                (true, _) => {
                    kept += 1;
                    kept - 1
                }
                (false, true) => UNKNOWN,
                (false, false) => NONE,
            })
            .collect();
        of.par_iter_mut().filter(|seed| **seed < UNKNOWN).for_each(|seed| *seed = fate[*seed as usize]);
        drop((shore, doubt));
        let reach = parts(look.refill_edges) as u16;
        let start = |v: usize| (of[v] < UNKNOWN).then_some(0);
        let passable = |a: usize, b: usize| (!divides[b] || ground.is_unknown(b)).then(|| parts(ground.edges(a, b)));
        let mut spread = Spread::over(ground);
        spread.rise(ground.neighbours, (&start, &|v| of[v] == UNKNOWN), reach, passable);
        let of = spread.labels(|v| of[v]);
        let open = beside_unknown(neighbours, &of, kept as usize);
        Cores { of, open }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.open.len()
    }

    /// The vertices of each core, ascending.
    pub fn members(&self) -> Vec<Vec<u32>> {
        let mut size = vec![0; self.count()];
        self.of.iter().filter(|core| **core < UNKNOWN).for_each(|&core| size[core as usize] += 1);
        let mut members: Vec<Vec<u32>> = size.into_iter().map(Vec::with_capacity).collect();
        for (v, &core) in self.of.iter().enumerate().filter(|(_, core)| **core < UNKNOWN) {
            members[core as usize].push(v as u32);
        }
        members
    }
}

/// Which of so many labels lie beside an unknown vertex.
pub fn beside_unknown(neighbours: &Neighbours, labels: &[u32], count: usize) -> Vec<bool> {
    let mut beside = vec![false; count];
    for v in (0..labels.len()).filter(|&v| labels[v] == UNKNOWN) {
        for &u in neighbours.around(v) {
            if let Some(beside) = beside.get_mut(labels[u as usize] as usize) {
                *beside = true;
            }
        }
    }
    beside
}

/// The lowest vertex that hangs together with each of those selected; [`NONE`] for the others.
fn seeds(neighbours: &Neighbours, selected: impl Fn(usize) -> bool + Sync) -> Vec<u32> {
    let mut parent = vec![NONE; neighbours.len()];
    let join = |(band, parent): (usize, &mut [u32])| {
        let first = BAND * band;
        let mut forest = Forest { first, parent };
        let mut crossings = Vec::new();
        for v in (first..first + forest.parent.len()).filter(|&v| selected(v)) {
            forest.parent[v - first] = v as u32;
            for &u in neighbours.around(v).iter().filter(|u| (**u as usize) < v) {
                if (u as usize) < first {
                    if selected(u as usize) {
                        crossings.push([u, v as u32]);
                    }
                } else if forest.parent[u as usize - first] != NONE {
                    forest.join(u, v as u32);
                }
            }
        }
        crossings
    };
    let crossings: Vec<Vec<[u32; 2]>> = parent.par_chunks_mut(BAND).enumerate().map(join).collect();
    let mut forest = Forest { first: 0, parent: &mut parent };
    crossings.into_iter().flatten().for_each(|[a, b]| forest.join(a, b));
    parent
}

/// Puts ascending numbers in place of the lowest vertices, and gives how many there are. Every way leads downward.
fn number(of: &mut [u32]) -> usize {
    let mut count = 0;
    for v in 0..of.len() {
        of[v] = match of[v] {
            NONE => NONE,
            up if up as usize == v => {
                count += 1;
                count - 1
            }
            up => of[up as usize],
        };
    }
    count as usize
}
