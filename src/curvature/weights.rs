//! Inverse-distance weights that every instruction set computes alike, and sums that no order changes.
//!
//! A weight is 1 / max(distance, spacing). The reciprocal root is an integer guess whose error spans as little as it
//! can (x y² within 9/8), a step of third order whose error is even (1.6e-5), and another one: 3e-15 relative.
//!
//! All six squared distances come from one, |u|² + offset² -+ 2 offset u_i, which is off by at most a few times
//! (1 + s)² + s² roundings for an offset of s spacings: 13 for the usual two.
//!
//! Everything is made of products, sums, differences and fused products, which IEEE 754 fixes to the bit: fused where
//! it is written so, and nowhere else. Plain Rust calls a function for them where the processor is not known to fuse.
//!
//! Distances are in units of 2^50 times the spacing. So weights are 2^50 at the spacing, the largest they can be. They
//! are rounded to integers by adding 1.5 * 2^52 (whose lowest bit is 1) and summed as integers: exact, so any order
//! gives the same bits. 256 of them stay below 2^58.

use crate::geometry::DVec3;

/// Adding it rounds a number below 2^51 to an integer, which is then in the low bits.
pub(super) const ROUND: f64 = 6_755_399_441_055_744.0;

/// First guess y at a reciprocal square root: this less half the bits.
pub(super) const GUESS: u64 = 0x5FE3_F488_137B_DF99;

/// Coefficients of the first step, y (A + B t + C t²) with t = x y² from 0.7472 to 0.8407: the minimax polynomial.
pub(super) const FIRST: [f64; 3] = [2.106_247_710_098_045, -1.770_729_842_481_61, 0.669_317_201_101_195_5];

/// Coefficients of the second, y (1 + A e + B e²) with e = 1 - x y² up to 3.2e-5: those of the series, the first with
/// 15/64 of the largest e² more, which makes the error even.
pub(super) const SECOND: [f64; 2] = [0.500_000_000_237_5, 0.375];

/// Square of the smallest distance that weighs: 2^-100.
pub(super) const LEAST: f64 = 1.0 / (LARGEST * LARGEST);

/// The largest weight: 2^50.
const LARGEST: f64 = 1_125_899_906_842_624.0;

/// What weights depend on in a survey.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weighting {
    /// Distance of the stencil points, metres.
    pub(super) offset_m: f64,
    /// Square of that, m².
    pub(super) offset_m2: f64,
    /// What a square metre is in the units of squared distances.
    pub(super) per_m2: f64,
    /// Twice the offset, for a product with metres.
    pub(super) twice_per_m: f64,
}

impl Weighting {
    /// Weights for stencil points `offset_m` away, none for less than `spacing_m`.
    pub(super) fn new(offset_m: f64, spacing_m: f64) -> Weighting {
        let per_m2 = LEAST / (spacing_m * spacing_m);
        Weighting { offset_m, offset_m2: offset_m * offset_m, per_m2, twice_per_m: 2.0 * offset_m * per_m2 }
    }

    /// |u|² + offset² of a centroid, which is `u` metres from the vertex: what its six squared distances have in common.
    #[inline(always)]
    pub(super) fn middle(&self, u: DVec3) -> f64 {
        u.x.mul_add(u.x, u.y.mul_add(u.y, u.z.mul_add(u.z, self.offset_m2))) * self.per_m2
    }

    /// Squared distance from the stencil point on the positive or negative side of an axis, of a centroid that is
    /// `along_m` from the vertex along it.
    #[inline(always)]
    pub(super) fn distance2(&self, middle: f64, along_m: f64, positive: bool) -> f64 {
        (if positive { -self.twice_per_m } else { self.twice_per_m }).mul_add(along_m, middle)
    }
}

/// The weight of a squared distance.
#[inline(always)]
pub(super) fn weight(d2: f64) -> f64 {
    let x = if d2 > LEAST { d2 } else { LEAST };
    let guess = f64::from_bits(GUESS.wrapping_sub(x.to_bits() >> 1));
    let t = x * guess * guess;
    let y = guess * FIRST[2].mul_add(t, FIRST[1]).mul_add(t, FIRST[0]);
    let e = (-(x * y)).mul_add(y, 1.0);
    (y * e).mul_add(SECOND[1].mul_add(e, SECOND[0]), y)
}

/// Weighted normals' components and weights of the stencil points +x, -x, +y, -y, +z, -z, as integers. Eight of each, so
/// that they are vectors: the last two mean nothing.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub(super) struct Sums {
    /// Of weights times normals.
    pub(super) weighted: [i64; 8],
    /// Of weights.
    pub(super) weights: [i64; 8],
}

impl Sums {
    /// Adds a neighbour of one stencil point.
    #[inline(always)]
    pub(super) fn add(&mut self, q: usize, weight: f64, normal: f64) {
        self.weights[q] = self.weights[q].wrapping_add(integer(weight + ROUND));
        self.weighted[q] = self.weighted[q].wrapping_add(integer(weight.mul_add(normal, ROUND)));
    }

    /// The divergence, 1/m.
    #[inline(always)]
    pub(super) fn divergence(&self, offset_m: f64) -> f64 {
        let mut mean = [0.0; 8];
        for (mean, (&weighted, &weights)) in mean.iter_mut().zip(self.weighted.iter().zip(&self.weights)) {
            *mean = weighted as f64 / weights as f64;
        }
        ((mean[0] - mean[1]) + (mean[2] - mean[3]) + (mean[4] - mean[5])) / (2.0 * offset_m)
    }
}

/// The integer that a number below 2^51 was rounded to by adding [`ROUND`].
#[inline(always)]
fn integer(sum: f64) -> i64 {
    (sum.to_bits() as i64).wrapping_sub(ROUND.to_bits() as i64)
}

/// What is too much in the sum of the bits of as many numbers that were rounded by adding [`ROUND`].
#[inline(always)]
pub(super) fn surplus(count: usize) -> i64 {
    (ROUND.to_bits() as i64).wrapping_mul(count as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_reciprocal_distances_to_1e_14() {
        let mut worst = 0.0f64;
        for i in 0..200_000 {
            let d2 = LEAST * 1.000_05f64.powi(i);
            worst = worst.max((weight(d2) * d2.sqrt() - 1.0).abs());
        }
        assert!(worst < 1e-14, "{worst:e}");
    }

    #[test]
    fn numbers_are_rounded_to_the_nearest_integer() {
        for (x, i) in [(0.4, 0), (-0.6, -1), (1e15, 1_000_000_000_000_000), (-3.0, -3)] {
            assert_eq!(integer(x + ROUND), i);
        }
    }
}
