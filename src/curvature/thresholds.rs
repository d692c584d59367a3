//! The `k` nearest candidates of six stencil points at once, without sorting.
//!
//! Candidates are ranked by squared distance cut to 16 bits, so that a vector compares 32 of them. A threshold that
//! exactly `k` ranks do not exceed gives the set. On a surface the count grows in proportion to the squared distance,
//! so interpolation between counts finds it in a few rounds, and the six searches share their rounds.
//!
//! Ranks are true to half a unit (the caller sees to it). So if no rank equals the threshold, everything below is
//! nearer than everything above and the set is exact. Otherwise the threshold is the k-th lowest rank: lower ranks
//! than its neighbours' are surely among the nearest, higher ones surely not, and [`undecided`] are the few between.
#![allow(clippy::needless_range_loop, reason = "stencil points and axes run through several arrays at once")]

use super::lanes::{Keys, Lanes, Set};

/// Rank that stands for the distance up to which candidates are complete.
pub(super) const COMPLETE: f64 = 65_500.0;

/// Highest threshold: those undecided at it are still complete.
const HIGHEST: i32 = 65_498;

/// Adding it rounds a number below 2^22 to an integer in the low bits: vectors have no saturating conversion.
const INTEGER: f32 = 12_582_912.0;

/// Thresholds at the six stencil points; and two idle lanes, which make a vector full.
pub(super) type Thresholds = [i32; 8];

/// Finds, from a first guess, the least ranks that at least `k` candidates do not exceed, or any thresholds that
/// exactly `k` do not exceed. False where there are too few within reach.
#[inline(always)]
pub(super) fn search<L: Lanes>(lanes: L, keys: &Keys, k: i32, at: &mut Thresholds) -> bool {
    let wanted = k as f32;
    let mut low = [-1i32; 8];
    let mut high = [HIGHEST + 1; 8];
    let mut low_count = [0f32; 8];
    let mut high_count = [0f32; 8];
    for t in at.iter_mut() {
        *t = (*t).clamp(0, HIGHEST);
    }
    for round in 1.. {
        let mut counts = lanes.count(keys, at);
        (counts[6], counts[7]) = (k, k);
        let bisect = u32::is_multiple_of(round, 4);
        let mut open = 0;
        let mut lacking = 0;
        for q in 0..8 {
            let count = counts[q] as f32;
            let (over, under) = (counts[q] > k, counts[q] < k);
            high[q] = if over { at[q] } else { high[q] };
            high_count[q] = if over { count } else { high_count[q] };
            low[q] = if under { at[q] } else { low[q] };
            low_count[q] = if under { count } else { low_count[q] };
            let (l, h, t) = (low[q] as f32, high[q] as f32, at[q] as f32);
            let between = l + (h - l) * (wanted - low_count[q]) / (high_count[q] - low_count[q]);
            let beyond = t * (wanted + 0.5) / (count + 0.5) + 1.0;
            let next = if high_count[q] > 0.0 { between } else { beyond };
            let next = if bisect { (l + h) * 0.5 } else { next };
            let next = if next < h - 1.0 { next } else { h - 1.0 };
            let next = if next > l + 1.0 { next } else { l + 1.0 };
            let stuck = high[q] - low[q] <= 1;
            let next = if stuck { high[q] } else { (next + INTEGER).to_bits() as i32 - INTEGER.to_bits() as i32 };
            at[q] = if over | under { next } else { at[q] };
            open |= i32::from((over | under) & !stuck);
            lacking |= i32::from(stuck & (high[q] > HIGHEST));
        }
        if lacking != 0 {
            return false;
        }
        if open == 0 {
            break;
        }
    }
    true
}

/// Candidates whose place at the threshold (the k-th lowest rank) ranks cannot tell; those surely nearer are put into
/// `set`.
#[cold]
pub(super) fn undecided(keys: &Keys, q: usize, threshold: i32, set: &mut Set) -> Vec<usize> {
    let mut between = Vec::new();
    set.fill(0);
    for (i, &rank) in keys.at(q).iter().enumerate() {
        let above = i32::from(rank) - threshold;
        if above < -1 {
            set[i / 64] |= 1 << (i % 64);
        } else if above <= 1 {
            between.push(i);
        }
    }
    between
}
