//! Inverse-distance weights that every instruction set computes alike, and sums that no order changes.
//!
//! A weight is 1 / max(distance, spacing). The reciprocal root is an integer guess, one Newton step centred so
//! that its error is even (9e-4) and one step of fifth order: 4e-15 relative, from products, sums and differences
//! only, which IEEE 754 fixes to the bit. No contraction: a fused product would round differently.
//!
//! Weights are scaled to 2^50 at the spacing, the largest they can be, rounded to integers by adding 1.5 * 2^52 (whose
//! lowest bit is 1) and summed as integers: exact, so any order gives the same bits. 256 of them stay below 2^58.

use crate::geometry::DVec3;

/// Adding it rounds a number below 2^51 to an integer, which is then in the low bits.
pub(super) const ROUND: f64 = 6_755_399_441_055_744.0;

/// First guess at a reciprocal square root: this less half the bits.
pub(super) const GUESS: u64 = 0x5FE6_EB50_C7B5_37A9;

/// Centres the error of the first step, which is up to 1.75e-3 too small otherwise.
const CENTRE: f64 = 1.000_876;

/// Constants of the first step: y (A - B x y²).
pub(super) const FIRST: [f64; 2] = [1.5 * CENTRE, 0.5 * CENTRE];

/// Coefficients of the second: y (1 + e/2 + 3 e²/8 + 5 e³/16 + 35 e⁴/128), e = 1 - x y².
pub(super) const SECOND: [f64; 4] = [0.5, 0.375, 0.3125, 0.273_437_5];

/// What weights depend on in a survey.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weighting {
    /// Distance of the stencil points, metres.
    pub(super) offset_m: f64,
    /// Square of the smallest distance that weighs, m².
    pub least_m2: f64,
    /// 2^50 times that distance: makes weights at most 2^50.
    pub(super) scale: f64,
}

impl Weighting {
    /// Weights for stencil points `offset_m` away, none for less than `spacing_m`.
    pub(super) fn new(offset_m: f64, spacing_m: f64) -> Weighting {
        Weighting { offset_m, least_m2: spacing_m * spacing_m, scale: spacing_m * 1_125_899_906_842_624.0 }
    }

    /// The scaled weight of a squared distance.
    #[inline(always)]
    pub(super) fn weight(&self, d2: f64) -> f64 {
        let x = if d2 > self.least_m2 { d2 } else { self.least_m2 };
        let guess = f64::from_bits(GUESS.wrapping_sub(x.to_bits() >> 1));
        let y = guess * (FIRST[0] - FIRST[1] * x * guess * guess);
        let e = 1.0 - x * y * y;
        let tail = SECOND[0] + e * (SECOND[1] + e * (SECOND[2] + e * SECOND[3]));
        let y = y * self.scale;
        y + y * e * tail
    }

    /// Squared distance from the stencil point on this side of the axis, of a centroid at `u` from the vertex.
    #[inline(always)]
    pub(super) fn distance2(&self, u: DVec3, axis: usize, side: f64) -> f64 {
        let a = u[axis] - side * self.offset_m;
        let (b, c) = (u[(axis + 1) % 3], u[(axis + 2) % 3]);
        a * a + (b * b + c * c)
    }
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
        self.weights[q] = self.weights[q].wrapping_add(rounded(weight));
        self.weighted[q] = self.weighted[q].wrapping_add(rounded(weight * normal));
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

/// The nearest integer of a number below 2^51.
#[inline(always)]
pub(super) fn rounded(x: f64) -> i64 {
    ((x + ROUND).to_bits() as i64).wrapping_sub(ROUND.to_bits() as i64)
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
        let w = Weighting::new(1.0, 1e-9);
        let mut worst = 0.0f64;
        for i in 0..200_000 {
            let d2 = 1e-6 * 1.000_05f64.powi(i);
            worst = worst.max((w.weight(d2) / (w.scale / d2.sqrt()) - 1.0).abs());
        }
        assert!(worst < 1e-14, "{worst:e}");
    }

    #[test]
    fn numbers_are_rounded_to_the_nearest_integer() {
        for (x, i) in [(0.4, 0), (-0.6, -1), (1e15, 1_000_000_000_000_000), (-3.0, -3)] {
            assert_eq!(rounded(x), i);
        }
    }
}
