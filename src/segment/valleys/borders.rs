//! Borders: where what grew from one core meets what grew from another.

use super::UNKNOWN;
use super::cores::Ground;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Vertices that one thread looks at.
const BAND: usize = if cfg!(test) { 16 } else { 1 << 16 };

/// What is known of the border between two cores.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Border {
    /// Summed length of the edges that cross it, m: about twice its own length.
    pub crossing_m: f64,
    /// Mean of the least bending along it, weighted by these edges, in 1 over the mean edge length.
    pub bend: f64,
    /// The ends of these edges, in ascending order of the first core's.
    pub vertices: Vec<u32>,
}

/// All borders of a tile, by the numbers of the two cores, the lower first.
pub fn borders(ground: &Ground, grown: &[u32]) -> BTreeMap<[u32; 2], Border> {
    let bands: Vec<Vec<([u32; 2], u32, u32)>> = (0..grown.len().div_ceil(BAND))
        .into_par_iter()
        .map(|band| {
            let mut crossing = Vec::new();
            for v in BAND * band..(BAND * (band + 1)).min(grown.len()) {
                let own = grown[v];
                if own >= UNKNOWN {
                    continue;
                }
                let beyond = |u: &&u32| grown[**u as usize] > own && grown[**u as usize] < UNKNOWN;
                for &u in ground.neighbours.around(v).iter().filter(beyond) {
                    crossing.push(([own, grown[u as usize]], v as u32, u));
                }
            }
            crossing
        })
        .collect();
    let mut borders: BTreeMap<[u32; 2], Border> = BTreeMap::new();
    for (cores, v, u) in bands.into_iter().flatten() {
        let border = borders.entry(cores).or_default();
        let length_m = ground.edges(v as usize, u as usize) * ground.mean_edge_m;
        let bend = 0.5 * (ground.bends[v as usize].least + ground.bends[u as usize].least);
        border.crossing_m += length_m;
        border.bend += length_m * f64::from(bend);
        border.vertices.extend([v, u]);
    }
    borders.values_mut().for_each(|border| border.bend /= border.crossing_m.max(f64::MIN_POSITIVE));
    borders
}
