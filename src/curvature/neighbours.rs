//! The nearest triangle centroids of a point: exact, ties by global triangle id.
//!
//! A river bed is a sheet: centroids are sorted into square columns in plan, and by height within each.
//! A search gathers a ball, grows it until it holds enough, and keeps the nearest.

use super::Stencil;
use super::kernel::stencil_point;
use super::weights::{Sums, Weighting, weight};
use crate::geometry::{DVec3, PlanBox};
use crate::tile::NormalField;
use std::sync::OnceLock;

/// Columns of the search are this many mean triangle sides wide: narrow enough to gather few candidates
/// in vain, wide enough to touch few columns (2 to 3 are alike; measured on synthetic beds).
const COLUMN_SIDES: f64 = 2.5;

/// Columns of triangle centroids, ready to be searched.
pub struct Neighbours<'a> {
    field: &'a NormalField,
    bounds: PlanBox,
    column_m: f64,
    columns: [usize; 2],
    start: Vec<u32>,
    /// Local triangle numbers, column by column, from the lowest up in each.
    sorted: Vec<u32>,
    height: [f64; 2],
}

/// A neighbour: squared distance (m²) and local triangle number. Ordered by both, in this order.
pub type Neighbour = (f64, u32);

/// Squared distance as the order of neighbours has it, m².
#[inline(always)]
pub(super) fn distance2(centroid: DVec3, p: DVec3) -> f64 {
    let d = centroid - p;
    d.x * d.x + d.y * d.y + d.z * d.z
}

/// The exact search, made when it is first needed: the kernel seldom does.
pub(super) struct Reserve<'a> {
    field: &'a NormalField,
    column_m: f64,
    search: OnceLock<Neighbours<'a>>,
}

impl<'a> Reserve<'a> {
    pub(super) fn new(field: &'a NormalField, side_m: f64) -> Self {
        Reserve { field, column_m: COLUMN_SIDES * side_m, search: OnceLock::new() }
    }

    fn search(&self) -> &Neighbours<'a> {
        self.search.get_or_init(|| Neighbours::new(self.field, self.column_m))
    }

    /// The divergence at a point, 1/m; none where uncertain.
    pub(super) fn divergence(&self, p: DVec3, stencil: &Stencil, weighting: &Weighting) -> Option<f64> {
        let mut found = Vec::new();
        let mut certain = true;
        let mut sums = Sums::default();
        for q in 0..6 {
            let place = stencil_point(p, q, stencil.offset_m);
            certain &= self.search().nearest(place, stencil.neighbours, stencil.first_radius_m(), &mut found);
            for &(_, t) in &found {
                let u = self.field.centroids[t as usize] - p;
                let d2 = weighting.distance2(weighting.middle(u), u[q / 2], q.is_multiple_of(2));
                sums.add(q, weight(d2), self.field.normals[t as usize][q / 2]);
            }
        }
        certain.then(|| sums.divergence(stencil.offset_m))
    }

    /// Distance to the nearest centroid, metres; none where uncertain.
    pub(super) fn nearest_m(&self, p: DVec3, guess_m: f64) -> Option<f64> {
        let mut found = Vec::new();
        let certain = self.search().nearest(p, 1, guess_m, &mut found);
        found.first().filter(|_| certain).map(|n| n.0.sqrt())
    }
}

impl<'a> Neighbours<'a> {
    /// Sorts a field into columns of `column_m` metres.
    pub fn new(field: &'a NormalField, column_m: f64) -> Neighbours<'a> {
        let mut bounds = PlanBox::EMPTY;
        let mut height = [f64::INFINITY, f64::NEG_INFINITY];
        for &c in &field.centroids {
            bounds.include(c);
            height = [height[0].min(c.z), height[1].max(c.z)];
        }
        let most = field.centroids.len().max(16) as f64;
        let mut column_m = column_m;
        let span = |i: usize, m: f64| ((bounds.max[i] - bounds.min[i]).max(0.0) / m).floor() + 1.0;
        while span(0, column_m) * span(1, column_m) > most {
            column_m *= 1.25;
        }
        let columns = [span(0, column_m) as usize, span(1, column_m) as usize];
        let mut grid = Neighbours { field, bounds, column_m, columns, start: Vec::new(), sorted: Vec::new(), height };
        grid.fill();
        grid
    }

    fn fill(&mut self) {
        let place: Vec<u32> = self
            .field
            .centroids
            .iter()
            .map(|c| (self.slot(1, c.y) * self.columns[0] + self.slot(0, c.x)) as u32)
            .collect();
        self.start = vec![0; self.columns[0] * self.columns[1] + 1];
        for &p in &place {
            self.start[p as usize + 1] += 1;
        }
        for i in 1..self.start.len() {
            self.start[i] += self.start[i - 1];
        }
        let mut next = self.start.clone();
        self.sorted = vec![0; place.len()];
        for (t, &p) in place.iter().enumerate() {
            self.sorted[next[p as usize] as usize] = t as u32;
            next[p as usize] += 1;
        }
        let height = |t: u32| self.field.centroids[t as usize].z;
        for w in self.start.windows(2) {
            self.sorted[w[0] as usize..w[1] as usize]
                .sort_unstable_by(|&a, &b| height(a).total_cmp(&height(b)).then(a.cmp(&b)));
        }
    }

    fn slot(&self, axis: usize, x: f64) -> usize {
        (((x - self.bounds.min[axis]) / self.column_m).floor().max(0.0) as usize).min(self.columns[axis] - 1)
    }

    /// Fills `found` with the `k` nearest centroids of `p`, nearest first, ties by triangle id, searching
    /// from the radius `guess_m` on. Returns whether they are certain: whether nothing beyond what was
    /// loaded could be as near. Fewer than `k` are found only where fewer exist.
    pub fn nearest(&self, p: DVec3, k: usize, guess_m: f64, found: &mut Vec<Neighbour>) -> bool {
        let n = self.field.centroids.len();
        found.clear();
        if n == 0 {
            return false;
        }
        let mut radius = guess_m;
        loop {
            self.gather(p, radius, found);
            if found.len() >= k.min(n) {
                break;
            }
            radius = if found.len() * 8 < k { radius * 2.0 } else { radius * 1.35 };
        }
        let order = |a: &Neighbour, b: &Neighbour| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if found.len() > k {
            found.select_nth_unstable_by(k - 1, order);
            found.truncate(k);
        }
        found.sort_unstable_by(order);
        let everything = self.field.loaded.margin_m(p) == f64::INFINITY;
        everything || (found.len() == k && found[k - 1].0.sqrt() < self.field.loaded.margin_m(p))
    }

    /// All centroids within the radius.
    fn gather(&self, p: DVec3, radius: f64, found: &mut Vec<Neighbour>) {
        found.clear();
        let (low, high) = (p.z - radius, p.z + radius);
        let whole_height = low <= self.height[0] && high >= self.height[1];
        let limit = radius * radius;
        for row in self.slot(1, p.y - radius)..=self.slot(1, p.y + radius) {
            for column in self.slot(0, p.x - radius)..=self.slot(0, p.x + radius) {
                let c = row * self.columns[0] + column;
                let mut run = &self.sorted[self.start[c] as usize..self.start[c + 1] as usize];
                if !whole_height && run.len() > 8 {
                    run = &run[run.partition_point(|&t| self.field.centroids[t as usize].z < low)..];
                }
                for &t in run {
                    let centroid = self.field.centroids[t as usize];
                    if centroid.z > high {
                        break;
                    }
                    let d2 = distance2(centroid, p);
                    if d2 <= limit {
                        found.push((d2, t));
                    }
                }
            }
        }
    }
}
