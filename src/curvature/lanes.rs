//! What the kernel asks of an instruction set, and how plain Rust does it.
//!
//! Everything but [`Lanes::sums`] is a filter whose errors the caller bounds: implementations may round as they
//! like. Sums must be the same bits in all.
#![allow(clippy::needless_range_loop, reason = "stencil points and axes run through several arrays at once")]

use super::buffer::{Aligned, Points};
use super::thresholds::Thresholds;
use super::weights::{Sum, Weighting};
use crate::geometry::DVec3;
use crate::tile::NormalField;

/// Most candidates that a vertex may have.
pub(super) const MOST: usize = 1024;
/// Words of a set of candidates.
pub(super) const WORDS: usize = MOST / 64;
/// A set of candidates: bit i for candidate i.
pub(super) type Set = [u64; WORDS];

/// Ranks of the candidates at the six stencil points: squared distances, scaled and cut to 16 bits.
#[derive(Debug)]
pub(super) struct Keys {
    /// `MOST` for each of +x, -x, +y, -y, +z, -z; from `padded` on, undefined.
    pub(super) rank: Aligned<u16>,
    /// Candidates with padding, a multiple of 32 and at least 96; padding has the highest rank.
    pub(super) padded: usize,
}

impl Keys {
    /// Room for `MOST` candidates.
    pub(super) fn new() -> Keys {
        Keys { rank: Aligned::of(6 * MOST), padded: 0 }
    }

    /// How many candidates are ranked, with padding.
    pub(super) fn padding(len: usize) -> usize {
        len.next_multiple_of(32).max(96)
    }

    /// How many are ranked, all of which are there.
    #[inline(always)]
    pub(super) fn checked_padded(&self) -> usize {
        assert!(
            (96..=MOST).contains(&self.padded) && self.padded.is_multiple_of(32) && self.rank.len() >= 6 * MOST,
            "whole vectors"
        );
        self.padded
    }

    /// Ranks at a stencil point.
    #[inline(always)]
    pub(super) fn at(&self, q: usize) -> &[u16] {
        &self.rank[q * MOST..q * MOST + self.padded]
    }
}

/// Neighbours of at least one stencil point, exactly: offsets from the vertex and normals.
#[derive(Debug)]
pub(super) struct Near {
    /// Local triangle numbers.
    pub(super) id: Aligned<u32>,
    /// x, y, z of the offset (metres) and of the normal, `MOST` each.
    pub(super) value: Aligned<f64>,
    /// Which of them belong to each stencil point.
    pub(super) of: [Set; 6],
    /// How many.
    pub(super) len: usize,
}

impl Near {
    /// Room for `MOST` neighbours.
    pub(super) fn new() -> Near {
        Near { id: Aligned::of(MOST + 64), value: Aligned::of(6 * MOST), of: [[0; WORDS]; 6], len: 0 }
    }
}

/// A vector instruction set, known to be there.
pub(super) trait Lanes: Copy + Send + Sync {
    /// Works one column of vertices compiled for this instruction set.
    fn column(self, column: &mut super::kernel::Column<'_, '_>);

    /// Works one column of the search for nearest centroids.
    fn nearest_column(self, column: &mut super::nearest::Column<'_, '_>);

    /// Keeps the candidates no further than sqrt(`limit`) from a box, given by its centre and half sides.
    fn keep_near_box(self, all: &Points, centre: [f32; 3], half: [f32; 3], limit: f32, kept: &mut Points);

    /// Keeps the candidates no further than sqrt(`limit`) from a point; their coordinates become relative to it.
    fn keep_ball(self, all: &Points, point: [f32; 3], limit: f32, kept: &mut Points);

    /// Least squared distance from the point.
    fn least(self, all: &Points, point: [f32; 3]) -> f32;

    /// Ranks padded candidates at the six points `offset` away: floor of `scale` times squared distance, 65535 at most.
    fn rank(self, points: &Points, offset: f32, scale: f32, keys: &mut Keys);

    /// How many candidates rank no higher than the thresholds (0 to 65535); the two idle lanes count nothing.
    fn count(self, keys: &Keys, thresholds: &Thresholds) -> Thresholds;

    /// Which candidates at stencil point `q` rank no higher than the threshold.
    fn members(self, keys: &Keys, q: usize, threshold: u16, set: &mut Set);

    /// The bits of `word` at the places that `places` has, moved together.
    fn pack(self, word: u64, places: u64) -> u64;

    /// Puts the numbers (64 of them) at these places together; returns how many.
    fn choose(self, from: &[u32], places: u64, to: &mut [u32]) -> usize;

    /// Fetches offsets from a vertex and normals of the numbered triangles.
    fn fetch(self, field: &NormalField, vertex: DVec3, near: &mut Near);

    /// Sums at the six stencil points.
    fn sums(self, near: &Near, weighting: &Weighting) -> [Sum; 6];
}

/// Plain Rust, for any processor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plain;

#[inline(always)]
fn square(x: f32) -> f32 {
    x * x
}

#[inline(always)]
fn keep(all: &Points, kept: &mut Points, limit: f32, relative: [f32; 3], distance2: impl Fn(f32, f32, f32) -> f32) {
    kept.reserve(all.len);
    let mut n = 0;
    for i in 0..all.len {
        let (x, y, z) = (all.x[i], all.y[i], all.z[i]);
        kept.x[n] = x - relative[0];
        kept.y[n] = y - relative[1];
        kept.z[n] = z - relative[2];
        kept.id[n] = all.id[i];
        n += usize::from(distance2(x, y, z) <= limit);
    }
    kept.len = n;
}

/// [`Lanes::choose`], one by one.
#[inline(always)]
pub(super) fn choose(from: &[u32], mut places: u64, to: &mut [u32]) -> usize {
    let mut n = 0;
    while places != 0 {
        to[n] = from[places.trailing_zeros() as usize];
        n += 1;
        places &= places - 1;
    }
    n
}

/// [`Lanes::fetch`], one by one.
#[inline(always)]
pub(super) fn fetch(field: &NormalField, vertex: DVec3, near: &mut Near) {
    let value: &mut [f64] = &mut near.value;
    let (x, value) = value.split_at_mut(MOST);
    let (y, value) = value.split_at_mut(MOST);
    let (z, value) = value.split_at_mut(MOST);
    let (nx, value) = value.split_at_mut(MOST);
    let (ny, nz) = value.split_at_mut(MOST);
    for (i, &t) in near.id[..near.len].iter().enumerate() {
        let (u, normal) = (field.centroids[t as usize] - vertex, field.normals[t as usize]);
        (x[i], y[i], z[i]) = (u.x, u.y, u.z);
        (nx[i], ny[i], nz[i]) = (normal.x, normal.y, normal.z);
    }
}

impl Lanes for Plain {
    fn column(self, column: &mut super::kernel::Column<'_, '_>) {
        super::kernel::work(self, column);
    }

    fn nearest_column(self, column: &mut super::nearest::Column<'_, '_>) {
        super::nearest::work(self, column);
    }

    #[inline(always)]
    fn keep_near_box(self, all: &Points, centre: [f32; 3], half: [f32; 3], limit: f32, kept: &mut Points) {
        let beyond = |x: f32, axis: usize| square(((x - centre[axis]).abs() - half[axis]).max(0.0));
        keep(all, kept, limit, [0.0; 3], |x, y, z| beyond(x, 0) + beyond(y, 1) + beyond(z, 2));
    }

    #[inline(always)]
    fn keep_ball(self, all: &Points, p: [f32; 3], limit: f32, kept: &mut Points) {
        keep(all, kept, limit, p, |x, y, z| square(x - p[0]) + square(y - p[1]) + square(z - p[2]));
    }

    #[inline(always)]
    fn least(self, all: &Points, p: [f32; 3]) -> f32 {
        let mut least = f32::INFINITY;
        for ((x, y), z) in all.x[..all.len].iter().zip(&all.y[..all.len]).zip(&all.z[..all.len]) {
            let d2 = square(x - p[0]) + square(y - p[1]) + square(z - p[2]);
            least = if d2 < least { d2 } else { least };
        }
        least
    }

    #[inline(always)]
    fn rank(self, points: &Points, offset: f32, scale: f32, keys: &mut Keys) {
        let n = Keys::padding(points.len);
        keys.padded = n;
        for q in 0..6 {
            let ranks = &mut keys.rank[q * MOST..q * MOST + n];
            let shift = if q.is_multiple_of(2) { offset } else { -offset };
            let [a, b, c] = match q / 2 {
                0 => [&points.x, &points.y, &points.z],
                1 => [&points.y, &points.z, &points.x],
                _ => [&points.z, &points.x, &points.y],
            };
            for (((rank, a), b), c) in ranks.iter_mut().zip(&a[..n]).zip(&b[..n]).zip(&c[..n]) {
                let d2 = (square(a - shift) + square(*b) + square(*c)) * scale;
                *rank = (if d2 < 65535.0 { d2 } else { 65535.0 }) as i32 as u16;
            }
        }
    }

    #[inline(always)]
    fn count(self, keys: &Keys, thresholds: &Thresholds) -> Thresholds {
        let mut counts = [0; 8];
        for q in 0..6 {
            let (mut count, threshold) = (0u16, thresholds[q] as u16);
            for &rank in keys.at(q) {
                count += u16::from(rank <= threshold);
            }
            counts[q] = i32::from(count);
        }
        counts
    }

    #[inline(always)]
    fn members(self, keys: &Keys, q: usize, threshold: u16, set: &mut Set) {
        for (word, ranks) in set.iter_mut().zip(keys.at(q).chunks(64)) {
            *word = ranks.iter().enumerate().fold(0, |w, (i, &rank)| w | u64::from(rank <= threshold) << i);
        }
    }

    #[inline(always)]
    fn pack(self, word: u64, mut places: u64) -> u64 {
        let (mut packed, mut to) = (0, 0);
        while places != 0 {
            packed |= (word >> places.trailing_zeros() & 1) << to;
            to += 1;
            places &= places - 1;
        }
        packed
    }

    #[inline(always)]
    fn choose(self, from: &[u32], places: u64, to: &mut [u32]) -> usize {
        choose(from, places, to)
    }

    #[inline(always)]
    fn fetch(self, field: &NormalField, vertex: DVec3, near: &mut Near) {
        fetch(field, vertex, near);
    }

    #[inline(always)]
    fn sums(self, near: &Near, weighting: &Weighting) -> [Sum; 6] {
        let mut sums = [Sum::default(); 6];
        let value = |k: usize| &near.value[k * MOST..k * MOST + near.len];
        for q in 0..6usize {
            let side = if q.is_multiple_of(2) { weighting.offset_m } else { -weighting.offset_m };
            let axis = q / 2;
            let (a, b, c, n) = (value(axis), value((axis + 1) % 3), value((axis + 2) % 3), value(3 + axis));
            let (mut weighted, mut weights) = (0i64, 0i64);
            for i in 0..near.len {
                let shifted = a[i] - side;
                let weight = weighting.weight(shifted * shifted + (b[i] * b[i] + c[i] * c[i]));
                let belongs = ((near.of[q][i / 64] >> (i % 64) & 1) as i64).wrapping_neg();
                weights = weights.wrapping_add(super::weights::rounded(weight) & belongs);
                weighted = weighted.wrapping_add(super::weights::rounded(weight * n[i]) & belongs);
            }
            sums[q] = Sum { weighted, weights };
        }
        sums
    }
}
