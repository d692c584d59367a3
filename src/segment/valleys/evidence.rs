//! Evidence: what speaks for a grain, for its confidence.

use super::cores::Ground;
use super::fates::Fates;
use super::judge::Judged;
use super::{NONE, UNKNOWN};
use crate::segment::settle::Evidence;

/// Sums for one grain.
#[derive(Clone, Copy, Default)]
struct Sums {
    rim: u64,
    bend: f64,
    free: u64,
    area_m2: f64,
    mean: f64,
    core_m2: f64,
    cores: u32,
}

/// The evidence for each grain, by its lowest core. `grown` is the core that each vertex grew from. Bending is that of the
/// surface as the first look smoothed it, also where the second look found the grain. Means are of no meaning for a grain
/// that is not known.
pub fn evidence(ground: &Ground, grown: &[u32], judged: &[Judged], fates: &Fates) -> Vec<Evidence> {
    let grain = |v: usize| match grown[v] {
        core if core >= UNKNOWN => core,
        core => fates.group[core as usize],
    };
    let mut sums = vec![Sums::default(); fates.group.len()];
    for v in 0..grown.len() {
        let own = grain(v);
        if own >= UNKNOWN {
            continue;
        }
        let sums = &mut sums[own as usize];
        let area = f64::from(ground.area_m2[v]);
        sums.area_m2 += area;
        sums.mean += area * f64::from(ground.bends[v].mean);
        let mut others = ground.neighbours.around(v).iter().filter(|u| grown[**u as usize] != grown[v]).peekable();
        if others.peek().is_some() {
            let (mut beyond, mut free) = (false, false);
            for &u in others {
                let other = grain(u as usize);
                beyond |= other != own;
                free |= other == NONE && grown[u as usize] == NONE;
            }
            sums.rim += u64::from(beyond);
            sums.free += u64::from(free);
            sums.bend += if beyond { f64::from(ground.bends[v].least) } else { 0.0 };
        }
    }
    for (core, judged) in judged.iter().enumerate().filter(|(core, _)| fates.group[*core] < UNKNOWN) {
        let sums = &mut sums[fates.group[core] as usize];
        sums.cores += 1;
        sums.core_m2 += judged.area_m2;
    }
    let over = |sum: f64, of: f64| if of > 0.0 { sum / of } else { 0.0 };
    let tell = |s: Sums| Evidence {
        rim_bend: over(s.bend, s.rim as f64),
        free_rim: over(s.free as f64, s.rim as f64),
        bulge: over(s.mean, s.area_m2) / ground.mean_edge_m * s.area_m2.sqrt(),
        core_share: over(s.core_m2, s.area_m2).min(1.0),
        patches: s.cores,
    };
    sums.into_iter().map(tell).collect()
}
