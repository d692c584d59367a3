//! Triangle centroids by square column in plan, for the search for nearest centroids.
//!
//! Columns hold one or two centroids. Those of a row of columns are neighbours in memory, so that the candidates around
//! some columns next to one another are one run for each of a few rows: nothing has to be gathered. Coordinates are
//! `f32` relative to one place for the whole field: precise to 2^-24 of its width, which the search reckons with. The
//! exact `f64` centroids stay where they are.
//!
//! Columns are laid over the window of [`super::grid`]; points beyond it belong to the column at its edge.

use super::grid::window;
use crate::geometry::DVec3;
use crate::tile::NormalField;
use std::ops::Range;

/// Side of a column in mean triangle sides: one or two centroids (1.0 to 1.5 are alike, 2 is a fifth slower; measured on
/// a bed of 962,254 triangles).
const COLUMN_SIDES: f64 = 1.2;

/// A centroid: offset from the sheet's centre (metres) and local triangle number.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(16))]
pub(super) struct Entry {
    /// East, north, up.
    pub(super) at: [f32; 3],
    /// Local triangle number.
    pub(super) id: u32,
}

/// Centroids of a field by column.
pub(super) struct Sheet {
    /// South-west corner of the window, metres.
    base: [f64; 2],
    /// What coordinates are relative to, metres.
    pub(super) centre: DVec3,
    /// Side of a column, metres.
    pub(super) column_m: f64,
    per_m: f64,
    /// Columns from west to east and from south to north.
    count: [i32; 2],
    /// First centroid of each column, row by row.
    start: Vec<u32>,
    entries: Vec<Entry>,
}

impl Sheet {
    /// Sorts a field's centroids into columns of a size that suits triangles of `side_m`, larger where there would be
    /// more columns than centroids. None for a field without centroids or without sense.
    pub(super) fn new(field: &NormalField, side_m: f64) -> Option<Sheet> {
        if field.centroids.is_empty() || !side_m.is_normal() || side_m < 1e-12 {
            return None;
        }
        let [x, y, z] = window(field);
        let mut column_m = COLUMN_SIDES * side_m;
        let most = field.centroids.len() as f64 + 64.0;
        let along = |[low, high]: [f64; 2], column_m: f64| ((high - low) / column_m).floor() + 1.0;
        while along(x, column_m) * along(y, column_m) > most {
            column_m *= 1.25;
        }
        let count = [along(x, column_m), along(y, column_m)];
        let centre = DVec3::new(x[0] + x[1], y[0] + y[1], z[0] + z[1]) * 0.5;
        if !count.iter().all(|c| c.is_finite()) || !centre.is_finite() {
            return None;
        }
        let mut sheet = Sheet {
            base: [x[0], y[0]],
            centre,
            column_m,
            per_m: 1.0 / column_m,
            count: count.map(|c| c as i32),
            start: Vec::new(),
            entries: Vec::new(),
        };
        sheet.fill(field);
        Some(sheet)
    }

    fn fill(&mut self, field: &NormalField) {
        self.start = vec![0; self.columns() + 2];
        let place: Vec<u32> = field
            .centroids
            .iter()
            .map(|&c| {
                let column = self.column(c) as u32;
                self.start[column as usize + 2] += 1;
                column
            })
            .collect();
        for i in 2..self.start.len() {
            self.start[i] += self.start[i - 1];
        }
        self.entries = vec![Entry::default(); place.len()];
        for (t, (&column, &c)) in place.iter().zip(&field.centroids).enumerate() {
            let next = &mut self.start[column as usize + 1];
            self.entries[*next as usize] = Entry { at: (c - self.centre).as_vec3().to_array(), id: t as u32 };
            *next += 1;
        }
        self.start.pop();
    }

    /// How many columns there are.
    pub(super) fn columns(&self) -> usize {
        self.count[0] as usize * self.count[1] as usize
    }

    /// Number of the column that a place belongs to.
    #[inline(always)]
    pub(super) fn column(&self, p: DVec3) -> usize {
        let [ix, iy] = self.slot(p);
        iy as usize * self.count[0] as usize + ix as usize
    }

    /// Column, from the west, and row, from the south, that a place belongs to.
    #[inline(always)]
    pub(super) fn slot(&self, p: DVec3) -> [i32; 2] {
        let index = |axis: usize| (((p[axis] - self.base[axis]) * self.per_m) as i32).clamp(0, self.count[axis] - 1);
        [index(0), index(1)]
    }

    /// The block of columns up to `rings` around some columns of a row.
    #[inline(always)]
    pub(super) fn around(&self, columns: Range<i32>, row: i32, rings: i32) -> Near {
        Near {
            columns: (columns.start - rings).max(0)..(columns.end + rings).min(self.count[0]),
            rows: (row - rings).max(0)..(row + 1 + rings).min(self.count[1]),
        }
    }

    /// The centroids of a block, row by row.
    #[inline(always)]
    pub(super) fn rows(&self, near: &Near) -> impl Iterator<Item = &[Entry]> {
        let (first, end) = (near.columns.start as usize, near.columns.end as usize);
        near.rows.clone().map(move |row| {
            let row = row as usize * self.count[0] as usize;
            &self.entries[self.start[row + first] as usize..self.start[row + end] as usize]
        })
    }

    /// How far around a place no centroid is outside a block, metres: infinite where the block holds all.
    #[inline(always)]
    pub(super) fn reach_m(&self, near: &Near, p: DVec3) -> f64 {
        let mut reach = f64::INFINITY;
        for (axis, range) in [&near.columns, &near.rows].into_iter().enumerate() {
            let at = p[axis] - self.base[axis];
            if range.start > 0 {
                reach = reach.min(at - f64::from(range.start) * self.column_m);
            }
            if range.end < self.count[axis] {
                reach = reach.min(f64::from(range.end) * self.column_m - at);
            }
        }
        reach - 1e-6 * self.column_m - self.rounding_m(p)
    }

    /// What rounding in `f64` may do to coordinates, metres.
    #[inline(always)]
    pub(super) fn rounding_m(&self, p: DVec3) -> f64 {
        8.0 * f64::EPSILON * (self.centre.abs().max_element() + p.abs().max_element() + self.column_m)
    }
}

/// A block of columns.
#[derive(Debug, Clone)]
pub(super) struct Near {
    columns: Range<i32>,
    rows: Range<i32>,
}
