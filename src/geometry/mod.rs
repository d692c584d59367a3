//! Plain geometry that several stages share: boxes in plan and exact sums.
//!
//! All lengths are metres in the survey's local frame (see [`crate::open::Frame`]): x east, y north,
//! z up, relative to an origin near the survey, so that `f64` keeps nanometres.

mod extremes;
mod hull;
mod polytope;
mod quickhull;

pub use glam::DVec3;
pub use hull::{Hull, Supports, flatter_than, hull, mean_depth, sphericity};

use serde::{Deserialize, Serialize};

/// A rectangle in plan, metres in the local frame. A side may be infinite.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlanBox {
    /// West and south side.
    pub min: [f64; 2],
    /// East and north side.
    pub max: [f64; 2],
}

impl PlanBox {
    /// The box that holds nothing; growing it by a point makes it that point.
    pub const EMPTY: PlanBox = PlanBox { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2] };

    /// The box that holds everything.
    pub const EVERYWHERE: PlanBox = PlanBox { min: [f64::NEG_INFINITY; 2], max: [f64::INFINITY; 2] };

    /// Grows the box to hold the point (x, y of `p`).
    pub fn include(&mut self, p: DVec3) {
        self.min = [self.min[0].min(p.x), self.min[1].min(p.y)];
        self.max = [self.max[0].max(p.x), self.max[1].max(p.y)];
    }

    /// Grows the box to hold another one.
    pub fn merge(&mut self, other: &PlanBox) {
        self.min = [self.min[0].min(other.min[0]), self.min[1].min(other.min[1])];
        self.max = [self.max[0].max(other.max[0]), self.max[1].max(other.max[1])];
    }

    /// The longer side, metres; 0 for the empty box.
    pub fn width_m(&self) -> f64 {
        (self.max[0] - self.min[0]).max(self.max[1] - self.min[1]).max(0.0)
    }

    /// Shortest distance from the point to a side, metres; negative outside.
    pub fn margin_m(&self, p: DVec3) -> f64 {
        (p.x - self.min[0]).min(self.max[0] - p.x).min(p.y - self.min[1]).min(self.max[1] - p.y)
    }
}

/// Area of a triangle, m².
pub fn triangle_area(corners: [DVec3; 3]) -> f64 {
    0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length()
}

/// Centroid of a triangle. The order of the additions is fixed, so that every tile gets the same bits; it never
/// lies outside the corners' box, as rounding could put it.
pub fn triangle_centroid(corners: [DVec3; 3]) -> DVec3 {
    let [a, b, c] = corners;
    (((a + b) + c) / 3.0).max(a.min(b).min(c)).min(a.max(b).max(c))
}

/// Unit normal of a triangle by the right-hand rule; zero for a triangle of no area.
pub fn triangle_normal(corners: [DVec3; 3]) -> DVec3 {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let length = normal.length();
    if length > 0.0 { normal / length } else { DVec3::ZERO }
}

/// A sum that does not depend on the order of its terms.
///
/// Terms are truncated to multiples of 2^-64 and added as integers, so that survey-wide means are the
/// same bits whatever the tiling, the thread count or the order of the file. Terms must be finite;
/// their sum must stay below 2^62, far above the area of a survey that is at most 100 km wide.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExactSum(i128);

impl ExactSum {
    /// The sum of nothing.
    pub const ZERO: ExactSum = ExactSum(0);
    const SCALE: f64 = 18_446_744_073_709_551_616.0;

    /// Adds one term.
    #[inline]
    pub fn add(&mut self, term: f64) {
        self.0 += fixed(term);
    }

    /// Adds another sum.
    pub fn merge(&mut self, other: ExactSum) {
        self.0 += other.0;
    }

    /// The sum, rounded to the nearest `f64`.
    pub fn value(self) -> f64 {
        self.0 as f64 / Self::SCALE
    }
}

/// A finite number below 2^62 in size, times 2^64, cut off to a whole one. The conversion that the language has
/// goes through a slow library function.
#[inline]
fn fixed(term: f64) -> i128 {
    let bits = term.to_bits();
    // What is too small for an implicit leading bit is far below 2^-64.
    let exponent = (bits >> 52 & 0x7ff) as i32;
    let mantissa = bits & ((1 << 52) - 1) | 1 << 52;
    let up = exponent - 1075 + 64;
    let size = if up <= 11 {
        // Below 1, as lengths and areas of triangles are: 64 bits are enough, and nothing depends on the number.
        let down = (11 - up) as u32;
        i128::from((mantissa << 11).checked_shr(down).unwrap_or(0))
    } else if up <= 75 {
        i128::from(mantissa) << up
    } else {
        0
    };
    if bits >> 63 == 1 { -size } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_are_cut_off_as_the_language_converts_them() {
        let mut term = 4e18f64;
        while term > 1e-30 {
            for t in [term, -term, term.floor(), term * 1.000_000_1] {
                assert_eq!(fixed(t), (t * ExactSum::SCALE) as i128, "{t:e}");
            }
            term *= 0.7391;
        }
        assert_eq!([0.0, -0.0, f64::MIN_POSITIVE, 5e-324].map(fixed), [0; 4]);
    }

    #[test]
    fn an_exact_sum_does_not_depend_on_order() {
        let terms: Vec<f64> = (1..2000).map(|i| 1e-3 / f64::from(i) + f64::from(i % 7) * 1e5).collect();
        let (mut up, mut down) = (ExactSum::default(), ExactSum::default());
        terms.iter().for_each(|&t| up.add(t));
        terms.iter().rev().for_each(|&t| down.add(t));
        assert_eq!(up, down);
        let plain: f64 = terms.iter().sum();
        assert!((up.value() / plain - 1.0).abs() < 1e-12, "{} against {plain}", up.value());
    }
}
