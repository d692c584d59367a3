//! The nearest points of every point, in space: exact, ties by place.

use super::Site;
use crate::geometry::DVec3;
use std::ops::Range;

/// A point as a neighbour: squared distance (m²) and number.
pub(super) type Neighbour = (f64, u32);

/// Points by square in plan. Only squares with points take room: one point far away must not stretch them.
pub(super) struct Near<'a> {
    sites: &'a [Site],
    side_m: f64,
    /// Row and column of each square, ascending.
    squares: Vec<(i32, i32)>,
    /// First point of each square in `order`, with the end behind the last.
    start: Vec<u32>,
    order: Vec<u32>,
    /// Highest point of each square, metres.
    highest: Vec<f64>,
}

impl<'a> Near<'a> {
    /// Sorts points into squares of this side.
    pub(super) fn new(sites: &'a [Site], side_m: f64) -> Near<'a> {
        let mut near =
            Near { sites, side_m, squares: Vec::new(), start: Vec::new(), order: Vec::new(), highest: Vec::new() };
        let square = |&i: &u32| (near.step(sites[i as usize].at.y), near.step(sites[i as usize].at.x));
        let mut order: Vec<((i32, i32), u32)> = (0..sites.len() as u32).map(|i| (square(&i), i)).collect();
        order.sort_unstable();
        for same in order.chunk_by(|a, b| a.0 == b.0) {
            near.squares.push(same[0].0);
            near.start.push(near.order.len() as u32);
            near.order.extend(same.iter().map(|&(_, i)| i));
            let heights = same.iter().map(|&(_, i)| sites[i as usize].at.z);
            near.highest.push(heights.fold(f64::NEG_INFINITY, f64::max));
        }
        near.start.push(near.order.len() as u32);
        near
    }

    fn step(&self, x: f64) -> i32 {
        (x / self.side_m).floor() as i32
    }

    /// The squares with points that reach into a square of twice this side around a place, row by row.
    fn around(&self, p: DVec3, radius_m: f64) -> impl Iterator<Item = Range<usize>> + '_ {
        let (first, last) = (self.step(p.x - radius_m), self.step(p.x + radius_m));
        let (south, north) = (self.step(p.y - radius_m), self.step(p.y + radius_m));
        let mut at = self.squares.partition_point(|&square| square < (south, first));
        std::iter::from_fn(move || {
            // Rows without points are not visited.
            loop {
                let &(row, column) = self.squares.get(at)?;
                if row > north {
                    return None;
                }
                if column < first {
                    at += self.squares[at..].partition_point(|&square| square < (row, first));
                    continue;
                }
                if column > last {
                    at += self.squares[at..].partition_point(|&square| square < (row + 1, first));
                    continue;
                }
                let end = at + self.squares[at..].partition_point(|&square| square <= (row, last));
                let run = at..end;
                at = end;
                return Some(run);
            }
        })
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
        self.around(p, reach_m).flatten().filter(|&square| self.highest[square] > p.z).any(|square| {
            self.order[self.start[square] as usize..self.start[square + 1] as usize].iter().any(|&i| {
                let d = self.sites[i as usize].at - p;
                let away2 = d.x * d.x + d.y * d.y;
                d.z > 0.0 && away2 <= reach_m * reach_m && d.z * d.z > steepness * steepness * away2
            })
        })
    }

    fn within(&self, p: DVec3, but: u32, radius_m: f64, found: &mut Vec<Neighbour>) {
        let limit = radius_m * radius_m;
        for run in self.around(p, radius_m) {
            for &i in &self.order[self.start[run.start] as usize..self.start[run.end] as usize] {
                let d = self.sites[i as usize].at - p;
                let d2 = d.x * d.x + d.y * d.y + d.z * d.z;
                if d2 <= limit && i != but {
                    found.push((d2, i));
                }
            }
        }
    }
}
