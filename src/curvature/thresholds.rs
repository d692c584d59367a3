//! The `k` nearest candidates of many stencil points at once, without sorting.
//!
//! Candidates are ranked by squared distance cut to 15 bits. A row holds one candidate's ranks at 32 stencil points, so
//! that vectors run over the points: a count at all of them is two or three instructions for each candidate.
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

/// Counts this far from the one wanted are mended from rank to rank.
const NEAR: i16 = 2;

/// Adding it rounds a number below 2^22 to an integer in the low bits: vectors have no saturating conversion.
const INTEGER: f32 = 12_582_912.0;

/// Finds, from a first guess, the least ranks that at least `k` candidates do not exceed, or any thresholds that
/// exactly `k` do not exceed; with [`Lanes::members`] at them. None where there are too few within reach.
#[inline(always)]
pub(super) fn search<L: Lanes>(lanes: L, keys: &Keys, k: i16, at: &mut Row, of: &mut [u32]) -> Option<u32> {
    let mut between = Between {
        low: Row([-1; LANES]),
        high: Row([HIGHEST + 1; LANES]),
        low_count: Row([0; LANES]),
        high_count: Row([0; LANES]),
    };
    for t in &mut at.0 {
        *t = (*t).clamp(0, HIGHEST);
    }
    let mut round = 1;
    loop {
        // Counts stay the same down to the rank below and up to the rank above.
        let (counts, below, above) =
            if round <= COUNTING { (lanes.count(keys, at), *at, *at) } else { lanes.count_between(keys, at) };
        let off = between.note(&counts, &below, &above, k);
        if between.lacking() {
            return None;
        }
        if round > COUNTING && off <= NEAR {
            between.step(at, &counts, k);
        } else if off > 0 {
            between.interpolate(at, &counts, k, round);
        }
        // The last step is seldom wrong: members tell.
        if off == 0 || (round > COUNTING && off == 1) {
            let (equal, counts) = lanes.members(keys, at, of);
            if between.all_found(&counts, k) {
                return Some(equal);
            }
        }
        round += 1;
    }
}

/// All bits where the first is greater.
#[inline(always)]
fn greater(a: &Row, b: &Row) -> Row {
    let mut greater = Row([0; LANES]);
    for q in 0..LANES {
        greater.0[q] = -i16::from(a.0[q] > b.0[q]);
    }
    greater
}

/// One where all bits are set, the other where none is. A condition would be compiled to branches.
#[inline(always)]
fn select(set: &Row, one: &Row, other: &Row) -> Row {
    let mut chosen = Row([0; LANES]);
    for q in 0..LANES {
        chosen.0[q] = (one.0[q] & set.0[q]) | (other.0[q] & !set.0[q]);
    }
    chosen
}

/// What is known of the thresholds: below `low` are too few, at `high` too many.
struct Between {
    low: Row,
    high: Row,
    low_count: Row,
    high_count: Row,
}

impl Between {
    /// Takes note of counts, which are the same from `below` to `above`; tells how far the worst is off.
    #[inline(always)]
    fn note(&mut self, counts: &Row, below: &Row, above: &Row, k: i16) -> i16 {
        let (over, under) = (greater(counts, &Row([k; LANES])), greater(&Row([k; LANES]), counts));
        self.high = select(&over, below, &self.high);
        self.low = select(&under, above, &self.low);
        self.high_count = select(&over, counts, &self.high_count);
        self.low_count = select(&under, counts, &self.low_count);
        let mut worst = 0;
        for q in 0..LANES {
            let open = i16::from(self.high.0[q] - self.low.0[q] > 1);
            worst = worst.max((counts.0[q] - k).abs() * open);
        }
        worst
    }

    /// Whether some threshold is out of reach.
    #[inline(always)]
    fn lacking(&self) -> bool {
        self.low.0.iter().fold(0, |most, &low| most.max(low)) >= HIGHEST
    }

    /// Whether all thresholds are found, with these counts at them.
    #[inline(always)]
    fn all_found(&self, counts: &Row, k: i16) -> bool {
        let mut open = 0;
        for q in 0..LANES {
            open |= if self.high.0[q] - self.low.0[q] > 1 { counts.0[q] ^ k } else { 0 };
        }
        open == 0
    }

    /// Goes to the next rank.
    #[inline(always)]
    fn step(&self, at: &mut Row, counts: &Row, k: i16) {
        // To a row of its own, since a store on condition would keep the loop from becoming vectors.
        let mut next = Row([0; LANES]);
        for q in 0..LANES {
            let (low, high, count) = (self.low.0[q], self.high.0[q], counts.0[q]);
            let lower = high - 1;
            let to = if count > k { lower } else { lower.min(low + 2) };
            let to = if lower > low { to } else { high };
            next.0[q] = if count == k { at.0[q] } else { to };
        }
        *at = next;
    }

    /// Goes where the count should be right if it grows evenly.
    #[inline(always)]
    fn interpolate(&self, at: &mut Row, counts: &Row, k: i16, round: u32) {
        let bisect = u32::is_multiple_of(round, 5);
        let wanted = f32::from(k);
        for q in 0..LANES {
            let (low, high) = (f32::from(self.low.0[q]), f32::from(self.high.0[q]));
            let (low_count, high_count) = (f32::from(self.low_count.0[q]), f32::from(self.high_count.0[q]));
            let (t, count) = (f32::from(at.0[q]), f32::from(counts.0[q]));
            let between = low + (high - low) * (wanted - low_count) / (high_count - low_count);
            let beyond = t * (wanted + 0.5) / (count + 0.5) + 1.0;
            let next = if high_count > 0.0 { between } else { beyond };
            let next = if bisect { (low + high) * 0.5 } else { next };
            let next = if next < high - 1.0 { next } else { high - 1.0 };
            let next = if next > low + 1.0 { next } else { low + 1.0 };
            let next = ((next + INTEGER).to_bits() as i32 - INTEGER.to_bits() as i32) as i16;
            let next = if self.high.0[q] - self.low.0[q] > 1 { next } else { self.high.0[q] };
            at.0[q] = if counts.0[q] == k { at.0[q] } else { next };
        }
    }
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
