//! Runs: which of the survey's elements a tile holds, and by which local numbers.

use std::ops::Range;

/// Ascending ranges of survey numbers, numbered on from 0 within the tile. Local numbers ascend with those of
/// the survey.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Runs {
    ranges: Vec<Range<u64>>,
    /// Local number of the first element of each range, and the count behind the last.
    before: Vec<u32>,
}

impl Runs {
    /// Of ranges that ascend and do not overlap, and hold at most 2^32 - 1 elements together.
    pub fn new(ranges: Vec<Range<u64>>) -> Runs {
        let mut before = Vec::with_capacity(ranges.len() + 1);
        let mut count = 0u64;
        for range in &ranges {
            before.push(count as u32);
            count += range.end - range.start;
        }
        assert!(count <= u64::from(u32::MAX), "a tile of {count} elements; at most 4294967295 can be numbered");
        before.push(count as u32);
        Runs { ranges, before }
    }

    /// The ranges.
    pub fn ranges(&self) -> &[Range<u64>] {
        &self.ranges
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.before.last().map_or(0, |&n| n as usize)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The survey's number of a local one.
    ///
    /// # Panics
    /// When there is no such element.
    pub fn number(&self, local: u32) -> u64 {
        let run = self.before.partition_point(|&b| b <= local) - 1;
        self.ranges[run].start + u64::from(local - self.before[run])
    }

    /// The local number of one of the survey's, if the tile holds it.
    pub fn local(&self, number: u64) -> Option<u32> {
        let run = self.ranges.partition_point(|r| r.end <= number);
        let range = self.ranges.get(run).filter(|r| r.contains(&number))?;
        Some(self.before[run] + (number - range.start) as u32)
    }

    /// The survey's numbers of a range of local ones, as ascending ranges.
    pub fn within(&self, local: Range<u32>) -> impl Iterator<Item = Range<u64>> + '_ {
        let first = self.before.partition_point(|&b| b <= local.start).saturating_sub(1);
        let runs = self.ranges.iter().zip(&self.before).skip(first);
        runs.take_while(move |(_, before)| **before < local.end).filter_map(move |(range, &before)| {
            let number = |l: u32| range.start + u64::from(l - before);
            let within = number(local.start.max(before))..number(local.end).min(range.end);
            (within.start < within.end).then_some(within)
        })
    }

    /// Local numbers of the elements that both hold, as ascending ranges.
    pub fn shared<'a>(&'a self, other: &'a [Range<u64>]) -> impl Iterator<Item = Range<u32>> + 'a {
        other.iter().filter_map(|range| {
            let first = self.local(range.start)?;
            Some(first..first + (range.end - range.start) as u32)
        })
    }
}

/// Looks local numbers up, quickly where neighbours follow one another.
pub(super) struct Lookup<'a> {
    runs: &'a Runs,
    /// Runs that were met last: triangles have corners in their own row of cells and the two beside it. First number,
    /// how many, and the local number of the first.
    recent: [(u64, u64, u32); 3],
}

impl<'a> Lookup<'a> {
    pub(super) fn new(runs: &'a Runs) -> Lookup<'a> {
        Lookup { runs, recent: [(0, 0, 0); 3] }
    }

    /// The local number, if the runs hold it.
    #[inline(always)]
    pub(super) fn local(&mut self, number: u64) -> Option<u32> {
        for (start, count, before) in self.recent {
            let within = number.wrapping_sub(start);
            if within < count {
                return Some(before + within as u32);
            }
        }
        self.searched(number)
    }

    #[inline(never)]
    fn searched(&mut self, number: u64) -> Option<u32> {
        let run = self.runs.ranges.partition_point(|r| r.end <= number);
        let range = self.runs.ranges.get(run).filter(|r| r.contains(&number))?;
        let before = self.runs.before[run];
        self.recent.rotate_right(1);
        self.recent[0] = (range.start, range.end - range.start, before);
        Some(before + (number - range.start) as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_numbers_and_survey_numbers_are_each_others_inverse() {
        let runs = Runs::new(vec![3..5, 9..10, 12..20]);
        assert_eq!(runs.len(), 11);
        let mut lookup = Lookup::new(&runs);
        for local in 0..11 {
            assert_eq!(runs.local(runs.number(local)), Some(local));
            assert_eq!(lookup.local(runs.number(local)), Some(local));
        }
        for absent in [0, 5, 8, 10, 11, 20, u64::MAX] {
            assert_eq!((runs.local(absent), lookup.local(absent)), (None, None));
        }
        for (start, end) in (0..=11).flat_map(|start| (start..=11).map(move |end| (start, end))) {
            let numbers: Vec<u64> = runs.within(start..end).flatten().collect();
            assert_eq!(numbers, (start..end).map(|l| runs.number(l)).collect::<Vec<_>>());
        }
        assert_eq!(runs.shared(&[9..10, 13..15]).collect::<Vec<_>>(), [2..3, 4..6]);
    }
}
