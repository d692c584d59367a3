//! Points in the order in which they are worked: column by column, many columns at a time.

use super::certain::Certain;
use crate::geometry::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Columns that one thread works in a row, where it works them one by one.
const COLUMNS: usize = 32;

/// Runs of each thread, before their values are put in place.
const TURN: usize = 64;

/// Points in the order of their columns, to be worked together.
pub(super) struct Visits {
    /// Points, column by column.
    order: Vec<u32>,
    /// First point of each column.
    start: Vec<u32>,
}

impl Visits {
    /// Sorts points by the column (of so many) that they are in.
    pub(super) fn new(columns: usize, points: &[DVec3], column: impl Fn(DVec3) -> usize) -> Visits {
        let mut start = vec![0u32; columns + 2];
        let place: Vec<u32> = points
            .iter()
            .map(|&p| {
                let column = column(p);
                start[column + 2] += 1;
                column as u32
            })
            .collect();
        for i in 2..start.len() {
            start[i] += start[i - 1];
        }
        let mut order = vec![0; points.len()];
        for (i, &column) in place.iter().enumerate() {
            let next = &mut start[column as usize + 1];
            order[*next as usize] = i as u32;
            *next += 1;
        }
        start.pop();
        Visits { order, start }
    }

    /// Values of all points, in their own order, from work on single columns in parallel.
    pub(super) fn by_column<S>(
        &self,
        workspace: impl Fn() -> S + Sync + Send,
        work: impl Fn(&mut S, &[u32], &mut [Certain]) + Sync + Send,
    ) -> Vec<Certain> {
        self.by_run(COLUMNS, workspace, |state, columns, found| {
            let first = self.start[columns.start] as usize;
            for column in columns {
                let (a, b) = (self.start[column] as usize, self.start[column + 1] as usize);
                if a < b {
                    work(state, &self.order[a..b], &mut found[a - first..b - first]);
                }
            }
        })
    }

    /// Points of a run of columns, column by column.
    pub(super) fn of(&self, columns: Range<usize>) -> &[u32] {
        &self.order[self.start[columns.start] as usize..self.start[columns.end] as usize]
    }

    /// Values of all points, in their own order, from work on runs of so many columns in parallel.
    pub(super) fn by_run<S>(
        &self,
        run_columns: usize,
        workspace: impl Fn() -> S + Sync + Send,
        work: impl Fn(&mut S, Range<usize>, &mut [Certain]) + Sync + Send,
    ) -> Vec<Certain> {
        let columns = self.start.len() - 1;
        let runs = columns.div_ceil(run_columns);
        let of_run = |run: usize| run * run_columns..((run + 1) * run_columns).min(columns);
        // In turns, so that values are not kept twice.
        let turn = TURN * rayon::current_num_threads();
        let mut values = vec![Certain::NONE; self.order.len()];
        for first in (0..runs).step_by(turn) {
            let end = (first + turn).min(runs);
            let found: Vec<Vec<Certain>> = (first..end)
                .into_par_iter()
                .map_init(&workspace, |state, run| {
                    let mut found = vec![Certain::NONE; self.of(of_run(run)).len()];
                    work(state, of_run(run), &mut found);
                    found
                })
                .collect();
            let points = self.of(of_run(first).start..of_run(end - 1).end);
            for (&point, value) in points.iter().zip(found.iter().flatten()) {
                values[point as usize] = *value;
            }
        }
        values
    }
}
