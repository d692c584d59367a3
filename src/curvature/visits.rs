//! Points in the order in which they are worked: column by column of the grid, many columns at a time.

use super::grid::Grid;
use crate::geometry::DVec3;
use rayon::prelude::*;

/// Columns that one thread works in a row.
const RUN: usize = 32;

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
    /// Sorts points by the column of the grid they are in.
    pub(super) fn new(grid: &Grid, points: &[DVec3]) -> Visits {
        let columns = grid.columns();
        let mut start = vec![0u32; columns + 2];
        let place: Vec<u32> = points
            .iter()
            .map(|&p| {
                let [ix, iy, _] = grid.slot(p);
                let column = (iy * grid.count[0] + ix) as u32;
                start[column as usize + 2] += 1;
                column
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

    /// Values of all points, in their own order, from work on runs of columns in parallel.
    pub(super) fn by_column<S>(
        &self,
        workspace: impl Fn() -> S + Sync + Send,
        work: impl Fn(&mut S, &[u32], &mut [Option<f64>]) + Sync + Send,
    ) -> Vec<Option<f64>> {
        let columns = self.start.len() - 1;
        let runs = columns.div_ceil(RUN);
        // In turns, so that values are not kept twice.
        let turn = TURN * rayon::current_num_threads();
        let mut values = vec![None; self.order.len()];
        for first in (0..runs).step_by(turn) {
            let found: Vec<Vec<Option<f64>>> = (first..(first + turn).min(runs))
                .into_par_iter()
                .map_init(&workspace, |state, run| {
                    let columns = run * RUN..((run + 1) * RUN).min(columns);
                    let first = self.start[columns.start] as usize;
                    let mut found = vec![None; self.start[columns.end] as usize - first];
                    for column in columns {
                        let (a, b) = (self.start[column] as usize, self.start[column + 1] as usize);
                        if a < b {
                            work(state, &self.order[a..b], &mut found[a - first..b - first]);
                        }
                    }
                    found
                })
                .collect();
            let points = &self.order[self.start[first * RUN] as usize..];
            for (&point, value) in points.iter().zip(found.iter().flatten()) {
                values[point as usize] = *value;
            }
        }
        values
    }
}
