//! Triangle centroids by cubic cell, for the shared search.
//!
//! A river bed is a sheet, so that a box of cells around it would be nearly all air. Cells are therefore kept by
//! column: each column of cells in plan has only the levels between its lowest and its highest centroid. The
//! three levels around a cell are neighbours in memory. A cell's centroids are `f32` relative to its centre:
//! 16 bytes a triangle, and precise to 2^-25 of a cell; the exact `f64` centroids stay where they are.
//!
//! Cells are laid over a window that holds all but outliers; points beyond it belong to the cell at its edge.
//! That keeps stray points from blowing the grid up, and keeps neighbours neighbours.

use super::buffer::Points;
use crate::geometry::DVec3;
use crate::tile::NormalField;

/// Points looked at to find the window.
const SAMPLE: usize = 4096;

/// Centroids of a field by cell.
pub(super) struct Grid {
    /// Lowest corner of the window, metres.
    base: DVec3,
    /// Side of a cell, metres; few bits, so that multiples of it are exact in `f32`.
    pub(super) cell_m: f64,
    per_m: f64,
    /// Cells along x, y and z.
    pub(super) count: [i32; 3],
    /// First cell of each column.
    column: Vec<u32>,
    /// Lowest level of each column.
    lowest: Vec<i32>,
    /// First centroid of each cell.
    cell: Vec<u32>,
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    id: Vec<u32>,
}

/// The side, with no more than twelve significant bits.
fn few_bits(side_m: f64) -> f64 {
    f64::from_bits(side_m.to_bits() & !((1 << 41) - 1))
}

/// Where nearly all centroids are: along each axis, the middle 98 in 100 and as much again on both sides.
pub(super) fn window(field: &NormalField) -> [[f64; 2]; 3] {
    let all = &field.centroids;
    let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for c in all.iter().map(DVec3::to_array) {
        // `f64::min` does more than an instruction.
        for axis in 0..3 {
            least[axis] = if c[axis] < least[axis] { c[axis] } else { least[axis] };
            most[axis] = if c[axis] > most[axis] { c[axis] } else { most[axis] };
        }
    }
    let step = (all.len() / SAMPLE).max(1);
    let mut sample = Vec::with_capacity(2 * SAMPLE);
    [0, 1, 2].map(|axis| {
        sample.clear();
        sample.extend(all.iter().step_by(step).map(|c| c[axis]));
        sample.sort_unstable_by(f64::total_cmp);
        let (low, high) = (sample[sample.len() / 100], sample[sample.len() - 1 - sample.len() / 100]);
        let spare = high - low;
        [least[axis].max(low - spare), most[axis].min(high + spare)]
    })
}

impl Grid {
    /// Sorts a field's centroids into cells of about `side_m`, larger where there would be more cells than
    /// centroids. None for a field without centroids or without sense.
    pub(super) fn new(field: &NormalField, side_m: f64) -> Option<Grid> {
        if field.centroids.is_empty() || !side_m.is_normal() || side_m < 1e-12 {
            return None;
        }
        let windows = window(field);
        let mut side_m = side_m;
        let most = field.centroids.len() as f64 + 64.0;
        loop {
            let count = windows.map(|[low, high]| ((high - low) / side_m).floor() + 1.0);
            if count.iter().any(|c| !c.is_finite()) {
                return None;
            }
            if count[0] * count[1] <= most && count[2] < 1e6 {
                let cell_m = few_bits(side_m);
                let mut grid = Grid {
                    base: DVec3::new(windows[0][0], windows[1][0], windows[2][0]),
                    cell_m,
                    per_m: 1.0 / cell_m,
                    count: count.map(|c| c as i32 + 1),
                    column: Vec::new(),
                    lowest: Vec::new(),
                    cell: Vec::new(),
                    x: Vec::new(),
                    y: Vec::new(),
                    z: Vec::new(),
                    id: Vec::new(),
                };
                if grid.fill(field) {
                    return Some(grid);
                }
            }
            side_m *= 1.25;
        }
    }

    /// Sorts the centroids; false where the columns would have too many levels.
    fn fill(&mut self, field: &NormalField) -> bool {
        let n = field.centroids.len();
        let columns = self.columns();
        let mut highest = vec![i32::MIN; columns];
        self.lowest = vec![i32::MAX; columns];
        let mut place = vec![[0u32; 2]; n];
        for (p, &c) in place.iter_mut().zip(&field.centroids) {
            let [ix, iy, iz] = self.slot(c);
            let column = (iy * self.count[0] + ix) as usize;
            self.lowest[column] = self.lowest[column].min(iz);
            highest[column] = highest[column].max(iz);
            *p = [column as u32, iz as u32];
        }
        self.column = Vec::with_capacity(columns + 1);
        let mut cells = 0u64;
        for (low, high) in self.lowest.iter().zip(&highest) {
            self.column.push(cells as u32);
            if low <= high {
                cells += (high - low) as u64 + 1;
            }
            if cells > 2 * n as u64 + 1024 {
                return false;
            }
        }
        self.column.push(cells as u32);
        self.cell = vec![0; cells as usize + 2];
        for p in &mut place {
            p[0] = self.column[p[0] as usize] + (p[1] as i32 - self.lowest[p[0] as usize]) as u32;
            self.cell[p[0] as usize + 2] += 1;
        }
        for i in 2..self.cell.len() {
            self.cell[i] += self.cell[i - 1];
        }
        self.scatter(field, &place);
        self.cell.pop();
        true
    }

    /// Puts the centroids where their cells are; shifts the cells' starts to where they belong by doing so.
    fn scatter(&mut self, field: &NormalField, place: &[[u32; 2]]) {
        let n = place.len();
        let room = n + STEP;
        (self.x, self.y, self.z, self.id) = (vec![0.0; room], vec![0.0; room], vec![0.0; room], vec![0; room]);
        for (t, (&[cell, level], &c)) in place.iter().zip(&field.centroids).enumerate() {
            let next = &mut self.cell[cell as usize + 1];
            let i = *next as usize;
            *next += 1;
            let ix = self.index(0, c.x);
            let iy = self.index(1, c.y);
            self.x[i] = (c.x - self.middle(0, ix)) as f32;
            self.y[i] = (c.y - self.middle(1, iy)) as f32;
            self.z[i] = (c.z - self.middle(2, level as i32)) as f32;
            self.id[i] = t as u32;
        }
    }

    /// Columns in plan.
    pub(super) fn columns(&self) -> usize {
        self.count[0] as usize * self.count[1] as usize
    }

    /// Number of the column that a place belongs to.
    #[inline(always)]
    pub(super) fn column(&self, p: DVec3) -> usize {
        let [ix, iy, _] = self.slot(p);
        (iy * self.count[0] + ix) as usize
    }

    #[inline(always)]
    fn index(&self, axis: usize, x: f64) -> i32 {
        (((x - self.base[axis]) * self.per_m) as i32).clamp(0, self.count[axis] - 1)
    }

    /// Middle of the cells with this index along an axis, metres.
    fn middle(&self, axis: usize, index: i32) -> f64 {
        self.base[axis] + (f64::from(index) + 0.5) * self.cell_m
    }

    /// The cell that a place belongs to.
    #[inline(always)]
    pub(super) fn slot(&self, p: DVec3) -> [i32; 3] {
        [self.index(0, p.x), self.index(1, p.y), self.index(2, p.z)]
    }

    /// Centre of a cell, metres.
    pub(super) fn centre(&self, slot: [i32; 3]) -> DVec3 {
        DVec3::new(self.middle(0, slot[0]), self.middle(1, slot[1]), self.middle(2, slot[2]))
    }

    /// The indices of the cells along an axis that are no further than `rings` away.
    fn around(&self, axis: usize, index: i32, rings: i32) -> std::ops::RangeInclusive<i32> {
        (index - rings).max(0)..=(index + rings).min(self.count[axis] - 1)
    }

    /// Gathers all centroids of the cells up to `rings` away, relative to the middle cell's centre. False, and
    /// not all of them, where they are more than `most`.
    #[inline(always)]
    pub(super) fn gather(&self, slot: [i32; 3], rings: i32, most: usize, block: &mut Points) -> bool {
        let cell = self.cell_m as f32;
        block.reserve(most);
        let mut n = 0;
        let levels = self.around(2, slot[2], rings);
        for iy in self.around(1, slot[1], rings) {
            for ix in self.around(0, slot[0], rings) {
                let column = (iy * self.count[0] + ix) as usize;
                let (first, end) = (self.column[column], self.column[column + 1]);
                let lowest = self.lowest[column];
                let from = lowest.max(*levels.start());
                let to = levels.end().saturating_add(1).min(lowest.saturating_add((end - first) as i32));
                if from >= to {
                    continue;
                }
                // The levels of a column are neighbours in memory: only heights are shifted level by level.
                let at = first as usize + (from - lowest) as usize;
                let cells = &self.cell[at..=at + (to - from) as usize];
                let (a, m) = (cells[0] as usize, (cells[cells.len() - 1] - cells[0]) as usize);
                if n + m > most {
                    return false;
                }
                let shift = |axis: usize, index: i32| (index - slot[axis]) as f32 * cell;
                moved(&self.x[a..], shift(0, ix), m, &mut block.x[n..]);
                moved(&self.y[a..], shift(1, iy), m, &mut block.y[n..]);
                copied(&self.id[a..], m, &mut block.id[n..]);
                for (iz, level) in (from..to).zip(cells.windows(2)) {
                    let (a, m) = (level[0] as usize, (level[1] - level[0]) as usize);
                    moved(&self.z[a..], shift(2, iz), m, &mut block.z[n..]);
                    n += m;
                }
            }
        }
        block.len = n;
        block.pad(n + 64);
        true
    }

    /// How far around a place (relative to its cell's centre) nothing is missed in a gathered block, metres:
    /// infinite where the block holds all.
    #[inline(always)]
    pub(super) fn reach_m(&self, slot: [i32; 3], rings: i32, at: DVec3) -> f64 {
        let half = (f64::from(rings) + 0.499_999) * self.cell_m;
        let mut reach = f64::INFINITY;
        for axis in 0..3 {
            if slot[axis] > rings {
                reach = reach.min(half + at[axis]);
            }
            if slot[axis] + rings < self.count[axis] - 1 {
                reach = reach.min(half - at[axis]);
            }
        }
        reach
    }

    /// A bound on the coordinates that rounding errors are proportional to, metres.
    #[inline(always)]
    pub(super) fn magnitude_m(&self) -> f64 {
        let far = self.base
            + DVec3::new(f64::from(self.count[0]), f64::from(self.count[1]), f64::from(self.count[2])) * self.cell_m;
        self.base.abs().max(far.abs()).max_element()
    }
}

/// Numbers that are moved at a time: whole vectors, the last of which may take along what follows.
const STEP: usize = 16;

#[inline(always)]
fn moved(from: &[f32], by: f32, count: usize, to: &mut [f32]) {
    let padded = count.next_multiple_of(STEP);
    let (to, from) = (to[..padded].as_chunks_mut::<STEP>().0, from[..padded].as_chunks::<STEP>().0);
    for (to, from) in to.iter_mut().zip(from) {
        let mut step = *from;
        for x in &mut step {
            *x += by;
        }
        *to = step;
    }
}

#[inline(always)]
fn copied(from: &[u32], count: usize, to: &mut [u32]) {
    let padded = count.next_multiple_of(STEP);
    let (to, from) = (to[..padded].as_chunks_mut::<STEP>().0, from[..padded].as_chunks::<STEP>().0);
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}
