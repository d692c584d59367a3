//! The distance to the nearest centroid at all vertices of a run of columns.
//!
//! Vertices next to one another in a row of columns share their candidates, and run in the lanes of vectors: the two
//! least distances in `f32` of each. Where rounding cannot have confused the two, one exact distance is left to
//! compute. Otherwise the columns around the vertex are looked at again, for all candidates that are as near within
//! rounding. A distance is accepted if nothing outside the columns looked at can be nearer.
#![allow(clippy::needless_range_loop, reason = "vertices run through several arrays at once")]

use super::certain::Certain;
use super::lanes::Lanes;
use super::neighbours::{Reserve, distance2};
use super::sheet::{Entry, Sheet};
use crate::geometry::DVec3;
use crate::tile::NormalField;

/// Columns that one thread works in a row.
pub(super) const COLUMNS: usize = 512;
/// Vertices that are worked together.
const TOGETHER: usize = 16;
/// Columns that vertices worked together are from, at most: sparse places are better worked one by one.
const WIDEST: i32 = 40;
/// Columns around its own in which a vertex is looked at again, in turn.
const RINGS: [i32; 3] = [1, 3, 8];
/// More candidates of a vertex are left to the exact search, which knows heights.
const MOST: usize = 1 << 14;

/// Everything that all runs share.
pub(super) struct Job<'a> {
    /// The centroids.
    pub(super) sheet: &'a Sheet,
    /// The field they come from.
    pub(super) field: &'a NormalField,
    /// Where the distance is wanted.
    pub(super) points: &'a [DVec3],
    /// Mean side of a triangle, metres.
    pub(super) side_m: f64,
    /// The exact search, if needed.
    pub(super) reserve: &'a Reserve<'a>,
}

/// Vertices of a run of columns.
pub(super) struct Run<'a, 'j> {
    /// What all runs share.
    pub(super) job: &'a Job<'j>,
    /// Numbers of the vertices, by column.
    pub(super) vertices: &'a [u32],
    /// Their distances, metres.
    pub(super) found: &'a mut [Certain],
    /// Buffer: for each vertex the candidate that seems to be nearest.
    pub(super) nearest: &'a mut Vec<u32>,
}

/// Stands for a vertex whose nearest centroid is not known.
const UNKNOWN: u32 = u32::MAX;

/// Works a run.
#[inline(always)]
pub(super) fn work<L: Lanes>(_: L, run: &mut Run<'_, '_>) {
    let Run { job, vertices, found, nearest } = run;
    nearest.clear();
    let mut rest = *vertices;
    while let Some(&first) = rest.first() {
        let [west, row] = job.sheet.slot(job.points[first as usize]);
        let mut at = [job.points[first as usize]; TOGETHER];
        let (mut east, mut n) = (west, 1);
        for &v in rest.iter().take(TOGETHER).skip(1) {
            let p = job.points[v as usize];
            let slot = job.sheet.slot(p);
            if slot[1] != row || slot[0] - west >= WIDEST {
                break;
            }
            (at[n], east, n) = (p, slot[0], n + 1);
        }
        let near = job.sheet.around(west..east + 1, row, 1);
        let few = job.sheet.rows(&near).map(<[Entry]>::len).sum::<usize>() <= MOST;
        let two = Two::of(job, job.sheet.rows(&near).filter(|_| few), &at);
        for v in 0..n {
            let limit_m = limit_m(job, f64::from(two.least[v]).sqrt(), at[v]);
            let sure = limit_m < f64::from(two.second[v]).sqrt() && limit_m < job.sheet.reach_m(&near, at[v]);
            nearest.push(if sure { two.nearest[v] } else { UNKNOWN });
        }
        rest = &rest[n..];
    }
    settle(job, vertices, nearest, found);
}

/// The two least squared distances of vertices, m², and the triangle with the least.
struct Two {
    least: [f32; TOGETHER],
    second: [f32; TOGETHER],
    nearest: [u32; TOGETHER],
}

impl Two {
    /// Those of the candidates.
    #[inline(always)]
    fn of<'e>(job: &Job<'_>, rows: impl Iterator<Item = &'e [Entry]>, at: &[DVec3; TOGETHER]) -> Two {
        let [mut px, mut py, mut pz] = [[0f32; TOGETHER]; 3];
        for v in 0..TOGETHER {
            [px[v], py[v], pz[v]] = (at[v] - job.sheet.centre).as_vec3().to_array();
        }
        let (mut least, mut second) = ([f32::INFINITY; TOGETHER], [f32::INFINITY; TOGETHER]);
        let mut nearest = [UNKNOWN; TOGETHER];
        for row in rows {
            for &Entry { at: [x, y, z], id } in row {
                for v in 0..TOGETHER {
                    let (dx, dy, dz) = (x - px[v], y - py[v], z - pz[v]);
                    let d2 = dx * dx + dy * dy + dz * dz;
                    let before = least[v];
                    let other = if d2 < before { before } else { d2 };
                    second[v] = if other < second[v] { other } else { second[v] };
                    nearest[v] = if d2 < before { id } else { nearest[v] };
                    least[v] = if d2 < before { d2 } else { before };
                }
            }
        }
        Two { least, second, nearest }
    }
}

/// How far a candidate may seem to be that is as near as the one that seems to be nearest.
#[inline(always)]
fn limit_m(job: &Job<'_>, least_m: f64, p: DVec3) -> f64 {
    let size = (p - job.sheet.centre).abs().max_element() + least_m + job.sheet.column_m;
    let each = f64::from(f32::EPSILON) * 2.0 * size + job.sheet.rounding_m(p);
    least_m * (1.0 + 1e-6) + 8.0 * each
}

/// Exact distances of the nearest candidates. Apart from the search for them, so that the processor waits for many of
/// them at once.
#[inline(always)]
fn settle(job: &Job<'_>, vertices: &[u32], nearest: &[u32], found: &mut [Certain]) {
    for ((&v, &t), found) in vertices.iter().zip(nearest).zip(found) {
        let p = job.points[v as usize];
        *found = match job.field.centroids.get(t as usize) {
            Some(&c) => Some(distance2(c, p).sqrt()).filter(|&d| d < job.field.loaded.margin_m(p)),
            None => again(job, p),
        }
        .into();
    }
}

/// Looks for the nearest centroid among all that seem to be as near.
#[inline(never)]
fn again(job: &Job<'_>, p: DVec3) -> Option<f64> {
    let [column, row] = job.sheet.slot(p);
    let [px, py, pz] = (p - job.sheet.centre).as_vec3().to_array();
    let square = |e: &Entry| {
        let (dx, dy, dz) = (e.at[0] - px, e.at[1] - py, e.at[2] - pz);
        dx * dx + dy * dy + dz * dz
    };
    for rings in RINGS {
        let near = job.sheet.around(column..column + 1, row, rings);
        if job.sheet.rows(&near).map(<[Entry]>::len).sum::<usize>() > MOST {
            break;
        }
        let least = job.sheet.rows(&near).flatten().fold(f32::INFINITY, |least, e| least.min(square(e)));
        let limit_m = limit_m(job, f64::from(least).sqrt(), p);
        if limit_m >= job.sheet.reach_m(&near, p) || !least.is_finite() {
            continue;
        }
        let limit = (limit_m * limit_m) as f32;
        let as_near = job.sheet.rows(&near).flatten().filter(|e| square(e) <= limit);
        let d2 = as_near.fold(f64::INFINITY, |d2, e| d2.min(distance2(job.field.centroids[e.id as usize], p)));
        return Some(d2.sqrt()).filter(|&d| d < job.field.loaded.margin_m(p));
    }
    job.reserve.nearest_m(p, job.side_m)
}
