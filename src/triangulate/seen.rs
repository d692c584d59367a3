//! The points that are seen from above. A surface over the plan has one height at each place, so what lies under an
//! overhang, or on a wall below its rim, is left out rather than joined with what is above it.

use super::Site;
use crate::geometry::PlanBox;
use std::cmp::Ordering;

/// How far and how steeply a point hides what lies below it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cover {
    /// Points further away in plan than this hide nothing, metres.
    pub(super) reach_m: f64,
    /// A point hides what lies below it and more steeply than this: rise over distance.
    pub(super) steepness: f64,
}

/// Sorts points by place in plan, from the highest down where several are at one, and leaves the first of these. Returns
/// where each point went: what is left is the same, and in the same order, whatever the order of the points was.
pub(super) fn one_for_each_place(mut sites: Vec<Site>) -> (Vec<Site>, Vec<Site>) {
    let place = |s: &Site| (s.at.x, s.at.y);
    sites.sort_unstable_by(|a, b| {
        let order = place(a).partial_cmp(&place(b)).unwrap_or(Ordering::Equal);
        order.then(b.at.z.total_cmp(&a.at.z)).then(a.input.cmp(&b.input))
    });
    let mut left_out = Vec::new();
    sites.dedup_by(|b, a| {
        let same = place(a) == place(b);
        if same {
            left_out.push(*b);
        }
        same
    });
    (sites, left_out)
}

/// Leaves out what is hidden. Points hide others whether they are hidden themselves or not, so that what is left does
/// not depend on the order in which they are looked at. Returns what was left out.
pub(super) fn from_above(sites: &mut Vec<Site>, cover: Cover) -> Vec<Site> {
    let squares = Squares::new(sites, cover.reach_m);
    let hidden: Vec<bool> = sites.iter().map(|s| squares.hides(sites, s, cover)).collect();
    let mut hidden = hidden.into_iter();
    let mut left_out = Vec::new();
    sites.retain(|site| {
        let hidden = hidden.next().unwrap_or(false);
        if hidden {
            left_out.push(*site);
        }
        !hidden
    });
    left_out
}

/// Points by square in plan: those near a point are in few.
struct Squares {
    min: [f64; 2],
    side_m: f64,
    columns: usize,
    start: Vec<u32>,
    order: Vec<u32>,
    /// Highest point of each square, metres.
    highest: Vec<f64>,
}

impl Squares {
    fn new(sites: &[Site], side_m: f64) -> Squares {
        let mut sides = PlanBox::EMPTY;
        sites.iter().for_each(|s| sides.include(s.at));
        let width = |axis: usize| (sides.max[axis] - sides.min[axis]).max(0.0);
        let mut side_m = side_m;
        while (width(0) / side_m + 1.0) * (width(1) / side_m + 1.0) > 4.0 * sites.len() as f64 + 16.0 {
            side_m *= 1.5;
        }
        let columns = (width(0) / side_m) as usize + 1;
        let rows = (width(1) / side_m) as usize + 1;
        let mut squares = Squares {
            min: sides.min,
            side_m,
            columns,
            start: vec![0; columns * rows + 1],
            order: vec![0; sites.len()],
            highest: vec![f64::NEG_INFINITY; columns * rows],
        };
        let of: Vec<usize> = sites.iter().map(|s| squares.square(s.at.x, s.at.y)).collect();
        for (&square, site) in of.iter().zip(sites) {
            squares.start[square + 1] += 1;
            squares.highest[square] = squares.highest[square].max(site.at.z);
        }
        for i in 1..squares.start.len() {
            squares.start[i] += squares.start[i - 1];
        }
        let mut next = squares.start.clone();
        for (i, &square) in of.iter().enumerate() {
            squares.order[next[square] as usize] = i as u32;
            next[square] += 1;
        }
        squares
    }

    fn step(&self, x: f64, axis: usize, n: usize) -> usize {
        (((x - self.min[axis]) / self.side_m).max(0.0) as usize).min(n - 1)
    }

    fn square(&self, x: f64, y: f64) -> usize {
        let rows = (self.start.len() - 1) / self.columns;
        self.step(y, 1, rows) * self.columns + self.step(x, 0, self.columns)
    }

    fn hides(&self, sites: &[Site], low: &Site, cover: Cover) -> bool {
        let (x, y, r) = (low.at.x, low.at.y, cover.reach_m);
        let rows = (self.start.len() - 1) / self.columns;
        for row in self.step(y - r, 1, rows)..=self.step(y + r, 1, rows) {
            for column in self.step(x - r, 0, self.columns)..=self.step(x + r, 0, self.columns) {
                let square = row * self.columns + column;
                if self.highest[square] <= low.at.z {
                    continue;
                }
                let of_square = self.start[square] as usize..self.start[square + 1] as usize;
                for &i in &self.order[of_square] {
                    let high = sites[i as usize].at;
                    let (dx, dy, rise) = (high.x - x, high.y - y, high.z - low.at.z);
                    let away2 = dx * dx + dy * dy;
                    if rise > 0.0 && away2 <= r * r && rise * rise > cover.steepness * cover.steepness * away2 {
                        return true;
                    }
                }
            }
        }
        false
    }
}
