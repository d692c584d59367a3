//! The nearest points of every point, in space: exact, ties by place.

use super::Site;
use crate::geometry::{DVec3, PlanBox};

/// Points of an average square, where the block is full.
const POINTS_PER_SQUARE: f64 = 4.0;

/// A point as a neighbour: squared distance (m²) and number.
pub(super) type Neighbour = (f64, u32);

/// Points by square in plan.
pub(super) struct Near<'a> {
    sites: &'a [Site],
    min: [f64; 2],
    side_m: f64,
    size: [usize; 2],
    start: Vec<u32>,
    order: Vec<u32>,
    /// Highest point of each square, metres.
    highest: Vec<f64>,
}

impl<'a> Near<'a> {
    /// Sorts points into squares.
    pub(super) fn new(sites: &'a [Site]) -> Near<'a> {
        let mut sides = PlanBox::EMPTY;
        sites.iter().for_each(|s| sides.include(s.at));
        let width = |axis: usize| (sides.max[axis] - sides.min[axis]).max(1e-9);
        let squares = (sites.len() as f64 / POINTS_PER_SQUARE).max(1.0);
        let side_m = (width(0) * width(1) / squares).sqrt().max(width(0).max(width(1)) / squares);
        let size = [0, 1].map(|axis| (width(axis) / side_m) as usize + 1);
        let mut near = Near {
            sites,
            min: sides.min,
            side_m,
            size,
            start: vec![0; size[0] * size[1] + 1],
            order: Vec::new(),
            highest: Vec::new(),
        };
        near.highest = vec![f64::NEG_INFINITY; size[0] * size[1]];
        let of: Vec<usize> = sites.iter().map(|s| near.step(s.at.y, 1) * size[0] + near.step(s.at.x, 0)).collect();
        of.iter().for_each(|&square| near.start[square + 1] += 1);
        for i in 1..near.start.len() {
            near.start[i] += near.start[i - 1];
        }
        let mut next = near.start.clone();
        near.order = vec![0; sites.len()];
        for (i, &square) in of.iter().enumerate() {
            near.highest[square] = near.highest[square].max(sites[i].at.z);
            near.order[next[square] as usize] = i as u32;
            next[square] += 1;
        }
        near
    }

    fn step(&self, x: f64, axis: usize) -> usize {
        (((x - self.min[axis]) / self.side_m).max(0.0) as usize).min(self.size[axis] - 1)
    }

    /// Puts up to `k` other points that are nearest to a point, and no further than `reach_m`, into `found`, nearest
    /// first.
    pub(super) fn nearest(&self, point: usize, k: usize, reach_m: f64, found: &mut Vec<Neighbour>) {
        let p = self.sites[point].at;
        let by_order = |a: &Neighbour, b: &Neighbour| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        let mut radius_m = (1.5 * self.side_m).min(reach_m);
        loop {
            found.clear();
            self.within(p, point as u32, radius_m, found);
            if found.len() >= k || radius_m >= reach_m {
                break;
            }
            radius_m = (radius_m * 1.6).min(reach_m);
        }
        if found.len() > k {
            found.select_nth_unstable_by(k - 1, by_order);
            found.truncate(k);
        }
        found.sort_unstable_by(by_order);
    }

    /// Whether another point, up to `reach_m` away in plan, is above a point and more steeply so than `steepness`, rise
    /// over distance: whether it is under an overhang, or on a wall below its rim.
    pub(super) fn is_covered(&self, point: usize, reach_m: f64, steepness: f64) -> bool {
        let p = self.sites[point].at;
        let (first, last) = (self.step(p.x - reach_m, 0), self.step(p.x + reach_m, 0));
        (self.step(p.y - reach_m, 1)..=self.step(p.y + reach_m, 1)).any(|row| {
            (first..=last).map(|column| row * self.size[0] + column).filter(|&square| self.highest[square] > p.z).any(
                |square| {
                    let of_square = self.start[square] as usize..self.start[square + 1] as usize;
                    self.order[of_square].iter().any(|&i| {
                        let d = self.sites[i as usize].at - p;
                        let away2 = d.x * d.x + d.y * d.y;
                        d.z > 0.0 && away2 <= reach_m * reach_m && d.z * d.z > steepness * steepness * away2
                    })
                },
            )
        })
    }

    fn within(&self, p: DVec3, but: u32, radius_m: f64, found: &mut Vec<Neighbour>) {
        let limit = radius_m * radius_m;
        for row in self.step(p.y - radius_m, 1)..=self.step(p.y + radius_m, 1) {
            let (first, last) = (self.step(p.x - radius_m, 0), self.step(p.x + radius_m, 0));
            let run =
                self.start[row * self.size[0] + first] as usize..self.start[row * self.size[0] + last + 1] as usize;
            for &i in &self.order[run] {
                let d = self.sites[i as usize].at - p;
                let d2 = d.x * d.x + d.y * d.y + d.z * d.z;
                if d2 <= limit && i != but {
                    found.push((d2, i));
                }
            }
        }
    }
}
