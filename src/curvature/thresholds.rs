//! The `k` nearest candidates of many stencil points at once, without sorting.
//!
//! Candidates are ranked by squared distance cut to 15 bits. A row holds one candidate's ranks at 32 stencil points, so
//! that vectors run over the points: a count at all of them is one comparison and one subtraction for each candidate.
//! A threshold that exactly `k` ranks do not exceed gives the set. On a surface the count grows in proportion to the
//! squared distance, so interpolation between counts comes close in a few rounds, and all searches share their rounds.
//! The last steps go from rank to rank.
//!
//! Ranks are true to half a unit (the caller sees to it). So if no rank equals the threshold, everything below is
//! nearer than everything above and the set is exact. Otherwise the threshold is the k-th lowest rank: lower ranks
//! than its neighbours' are surely among the nearest, higher ones surely not, and [`undecided`] are the few between.

use super::lanes::{Keys, LANES, Lanes, Row};

/// Rank that stands for the distance up to which candidates are complete.
pub(super) const COMPLETE: f64 = 32_700.0;

/// Highest threshold: those undecided at it are still complete.
pub(super) const HIGHEST: i16 = 32_698;

/// Rounds that count only; later ones also find the ranks on both sides of the threshold.
const COUNTING: u32 = 2;

/// Adding it rounds a number below 2^22 to an integer in the low bits: vectors have no saturating conversion.
const INTEGER: f32 = 12_582_912.0;

/// Finds, from a first guess, the least ranks that at least `k` candidates do not exceed, or any thresholds that
/// exactly `k` do not exceed. False where there are too few within reach.
#[inline(always)]
pub(super) fn search<L: Lanes>(lanes: L, keys: &Keys, k: i32, at: &mut Row) -> bool {
    let wanted = k as f32;
    let mut low = [-1i32; LANES];
    let mut high = [i32::from(HIGHEST) + 1; LANES];
    let mut low_count = [0f32; LANES];
    let mut high_count = [0f32; LANES];
    for t in &mut at.0 {
        *t = (*t).clamp(0, HIGHEST);
    }
    for round in 1.. {
        let bisect = u32::is_multiple_of(round, 5);
        // Counts stay the same down to the rank below and up to the rank above.
        let (counts, below, above) =
            if round <= COUNTING { (lanes.count(keys, at), *at, *at) } else { lanes.count_between(keys, at) };
        let one_by_one = if round <= COUNTING { 0 } else { 2 };
        let (mut open, mut lacking) = (0, 0);
        for q in 0..LANES {
            let count = i32::from(counts.0[q]);
            let (over, under) = (count > k, count < k);
            let count = count as f32;
            let from = i32::from(at.0[q]);
            high[q] = if over { i32::from(below.0[q]) } else { high[q] };
            high_count[q] = if over { count } else { high_count[q] };
            low[q] = if under { i32::from(above.0[q]) } else { low[q] };
            low_count[q] = if under { count } else { low_count[q] };
            let (l, h, t) = (low[q] as f32, high[q] as f32, from as f32);
            let between = l + (h - l) * (wanted - low_count[q]) / (high_count[q] - low_count[q]);
            let beyond = t * (wanted + 0.5) / (count + 0.5) + 1.0;
            let next = if high_count[q] > 0.0 { between } else { beyond };
            let next = if bisect { (l + h) * 0.5 } else { next };
            let step = if over { h - 1.0 } else { l + 2.0 };
            let next = if (count - wanted).abs() <= one_by_one as f32 { step } else { next };
            let next = if next < h - 1.0 { next } else { h - 1.0 };
            let next = if next > l + 1.0 { next } else { l + 1.0 };
            let stuck = high[q] - low[q] <= 1;
            let next = if stuck { high[q] } else { (next + INTEGER).to_bits() as i32 - INTEGER.to_bits() as i32 };
            at.0[q] = if over | under { next } else { from } as i16;
            open |= i32::from((over | under) & !stuck);
            lacking |= i32::from(stuck & (high[q] > i32::from(HIGHEST)));
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

/// Candidates whose place at the threshold (the k-th lowest rank) ranks cannot tell; the others' `of` says whether they
/// are surely nearer.
#[cold]
pub(super) fn undecided(keys: &Keys, lane: usize, threshold: i16, of: &mut [u32]) -> Vec<usize> {
    let mut between = Vec::new();
    for (i, (row, of)) in keys.rows().iter().zip(of).enumerate() {
        let above = i32::from(row.0[lane]) - i32::from(threshold);
        *of = *of & !(1 << lane) | u32::from(above < -1) << lane;
        if (-1..=1).contains(&above) {
            between.push(i);
        }
    }
    between
}
