//! Reads what a tile holds of a column, on all threads.

use super::runs::Runs;
use crate::store::{Column, Element, StoreError};
use rayon::prelude::*;
use std::ops::Range;

/// Elements that lie so near one another in the column are read at one go.
const READ_THROUGH: u64 = if cfg!(test) { 3 } else { 256 };
/// Elements that one thread reads at a time.
const PIECE: usize = if cfg!(test) { 7 } else { 1 << 14 };

/// Reads the elements of a column that belong to the runs.
///
/// # Errors
/// The column cannot be read.
pub fn read_of<T: Element + Default>(column: &Column<T>, runs: &Runs) -> Result<Vec<T>, StoreError> {
    // All threads touch the fresh memory.
    let mut found: Vec<T> = rayon::iter::repeat_n(T::default(), runs.len()).collect();
    found.par_chunks_mut(PIECE).enumerate().try_for_each(|(piece, to)| {
        let first = (PIECE * piece) as u32;
        let ranges: Vec<Range<u64>> = runs.within(first..first + to.len() as u32).collect();
        read_ranges(column, &ranges, to)
    })?;
    Ok(found)
}

/// Fills a slice from ranges that hold as many elements. Short gaps between them are read and left out.
fn read_ranges<T: Element>(column: &Column<T>, mut rest: &[Range<u64>], mut to: &mut [T]) -> Result<(), StoreError> {
    let mut through = Vec::new();
    while let Some(first) = rest.first() {
        let joins = |w: &&[Range<u64>]| w[1].start - w[0].end <= READ_THROUGH && w[1].end - first.start <= PIECE as u64;
        let (together, after) = rest.split_at(rest.windows(2).take_while(joins).count() + 1);
        rest = after;
        let count = |ranges: &[Range<u64>]| ranges.iter().map(|r| r.end - r.start).sum::<u64>() as usize;
        let (mut here, after) = to.split_at_mut(count(together));
        to = after;
        if together.len() == 1 {
            column.read_into(first.start, here)?;
            continue;
        }
        through.clear();
        column.read(first.start..together[together.len() - 1].end, &mut through)?;
        for range in together {
            let part = &through[(range.start - first.start) as usize..(range.end - first.start) as usize];
            let (now, next) = here.split_at_mut(part.len());
            now.copy_from_slice(part);
            here = next;
        }
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn elements_of_any_runs_come_in_their_order() {
        let folder = tempfile::tempdir().unwrap();
        let column = Column::<u64>::create(&folder.path().join("column"), 1000).unwrap();
        column.write(0, 0..1000).unwrap();
        for stride in 1..40 {
            // Gaps of 0 to 6, and one that is wide.
            let mut ranges: Vec<Range<u64>> = (0..12).map(|i| i * stride..i * stride + 1 + i % stride).collect();
            ranges.push(900..900 + 2 * stride);
            let runs = Runs::new(ranges.clone());
            assert_eq!(read_of(&column, &runs).unwrap(), ranges.into_iter().flatten().collect::<Vec<_>>());
        }
        assert_eq!(read_of(&column, &Runs::default()).unwrap(), Vec::<u64>::new());
    }

    #[test]
    fn a_column_that_ends_too_early_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let column = Column::<u64>::create(&folder.path().join("column"), 10).unwrap();
        assert!(read_of(&column, &Runs::new(vec![2..4, 8..11])).is_err());
    }
}
