//! Shape of a stone from its three axes, its hull and its visible surface.
//!
//! Axes are full lengths, `a >= b >= c`, metres (long, intermediate and short: L, I, S). `c` is the least
//! certain of them on a bed seen from above, and everything that uses it inherits that.

use crate::geometry::sphericity;
use std::f64::consts::PI;

/// Exponent of Knud Thomsen's approximation of an ellipsoid's area (within 1.1 % for any axes).
const THOMSEN_P: f64 = 1.6075;
/// Zingg's split of both axis ratios.
const ZINGG_SPLIT: f64 = 2.0 / 3.0;

/// Zingg (1935): which of b/a and c/b exceed 2/3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zingg {
    /// b/a > 2/3, c/b > 2/3.
    Spheroid,
    /// b/a > 2/3, c/b <= 2/3.
    Disc,
    /// b/a <= 2/3, c/b > 2/3.
    Rod,
    /// b/a <= 2/3, c/b <= 2/3.
    Blade,
}

impl Zingg {
    /// The class of three axes; none unless they are finite and a, b are above zero.
    pub fn of(axes_m: [f64; 3]) -> Option<Zingg> {
        let (b_over_a, c_over_b) = (b_over_a(axes_m)?, c_over_b(axes_m)?);
        Some(match (b_over_a > ZINGG_SPLIT, c_over_b > ZINGG_SPLIT) {
            (true, true) => Zingg::Spheroid,
            (true, false) => Zingg::Disc,
            (false, true) => Zingg::Rod,
            (false, false) => Zingg::Blade,
        })
    }

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Zingg::Spheroid => "spheroid",
            Zingg::Disc => "disc",
            Zingg::Rod => "rod",
            Zingg::Blade => "blade",
        }
    }
}

/// Sneed & Folk (1958): ten classes by c/a (rows split at 0.3, 0.5, 0.7) and (a-b)/(a-c) (columns split at
/// 0.33, 0.67). A value on a split belongs to the class above it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SneedFolk {
    /// C: c/a >= 0.7.
    Compact,
    /// CP: c/a in 0.5 to 0.7, platy.
    CompactPlaty,
    /// CB: c/a in 0.5 to 0.7, bladed.
    CompactBladed,
    /// CE: c/a in 0.5 to 0.7, elongate.
    CompactElongate,
    /// P: c/a in 0.3 to 0.5, platy.
    Platy,
    /// B: c/a in 0.3 to 0.5, bladed.
    Bladed,
    /// E: c/a in 0.3 to 0.5, elongate.
    Elongate,
    /// VP: c/a < 0.3, platy.
    VeryPlaty,
    /// VB: c/a < 0.3, bladed.
    VeryBladed,
    /// VE: c/a < 0.3, elongate.
    VeryElongate,
}

impl SneedFolk {
    /// The class of three axes; none unless they are finite and a, b are above zero. Equal a and c are
    /// compact, so that (a-b)/(a-c) is never 0/0.
    pub fn of(axes_m: [f64; 3]) -> Option<SneedFolk> {
        b_over_a(axes_m)?;
        c_over_b(axes_m)?;
        let [a, b, c] = axes_m;
        let c_over_a = c / a;
        if c_over_a >= 0.7 {
            return Some(SneedFolk::Compact);
        }
        let column = usize::from((a - b) / (a - c) >= 0.33) + usize::from((a - b) / (a - c) >= 0.67);
        let row = if c_over_a >= 0.5 {
            [SneedFolk::CompactPlaty, SneedFolk::CompactBladed, SneedFolk::CompactElongate]
        } else if c_over_a >= 0.3 {
            [SneedFolk::Platy, SneedFolk::Bladed, SneedFolk::Elongate]
        } else {
            [SneedFolk::VeryPlaty, SneedFolk::VeryBladed, SneedFolk::VeryElongate]
        };
        Some(row[column])
    }

    /// The code of the class in Sneed & Folk's triangle: C, CP, CB, CE, P, B, E, VP, VB, VE.
    pub fn code(self) -> &'static str {
        match self {
            SneedFolk::Compact => "C",
            SneedFolk::CompactPlaty => "CP",
            SneedFolk::CompactBladed => "CB",
            SneedFolk::CompactElongate => "CE",
            SneedFolk::Platy => "P",
            SneedFolk::Bladed => "B",
            SneedFolk::Elongate => "E",
            SneedFolk::VeryPlaty => "VP",
            SneedFolk::VeryBladed => "VB",
            SneedFolk::VeryElongate => "VE",
        }
    }
}

fn ratio(over: f64, under: f64) -> Option<f64> {
    let ratio = over / under;
    (under > 0.0 && ratio.is_finite()).then_some(ratio)
}

/// b/a; none where a is zero.
pub fn b_over_a([a, b, _]: [f64; 3]) -> Option<f64> {
    ratio(b, a)
}

/// c/b; none where b is zero.
pub fn c_over_b([_, b, c]: [f64; 3]) -> Option<f64> {
    ratio(c, b)
}

/// Corey's shape factor c/sqrt(ab), 0 to 1.
pub fn corey([a, b, c]: [f64; 3]) -> Option<f64> {
    ratio(c, (a * b).sqrt())
}

/// Krumbein's (1941) intercept sphericity (bc/a²)^(1/3), 0 to 1.
pub fn krumbein([a, b, c]: [f64; 3]) -> Option<f64> {
    ratio(b * c, a * a).map(f64::cbrt)
}

/// Sneed & Folk's (1958) maximum-projection sphericity (c²/(ab))^(1/3), 0 to 1.
pub fn max_projection([a, b, c]: [f64; 3]) -> Option<f64> {
    ratio(c * c, a * b).map(f64::cbrt)
}

/// Side of the square sieve hole that the stone just passes, metres: b sqrt((1 + (c/b)²)/2)
/// (Church, McLean & Wolcott 1987).
pub fn sieve_diameter_m(axes_m: [f64; 3]) -> Option<f64> {
    let flatness = c_over_b(axes_m)?;
    Some(axes_m[1] * (0.5 * (1.0 + flatness * flatness)).sqrt())
}

/// Sphericity of a convex hull after Wadell: area of the sphere of its volume over its area,
/// pi^(1/3) (6V)^(2/3) / A, 0 to 1. None for a hull without area.
pub fn hull_sphericity(volume_m3: f64, area_m2: f64) -> Option<f64> {
    (area_m2 > 0.0).then(|| sphericity(volume_m3, area_m2))
}

/// Surface of the ellipsoid with full axes a, b, c, m² (Knud Thomsen's formula, p = 1.6075).
pub fn ellipsoid_area_m2([a, b, c]: [f64; 3]) -> f64 {
    let mean = ((a * b).powf(THOMSEN_P) + (a * c).powf(THOMSEN_P) + (b * c).powf(THOMSEN_P)) / 3.0;
    PI * mean.powf(1.0 / THOMSEN_P)
}

/// Visible surface over the surface of the ellipsoid with the same axes: about 0.5 for a stone whose upper
/// half shows, above 1 only for rough or hollow surfaces.
pub fn exposed_share(surface_area_m2: f64, axes_m: [f64; 3]) -> Option<f64> {
    ratio(surface_area_m2, ellipsoid_area_m2(axes_m))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(value: Option<f64>, expected: f64, tolerance: f64) {
        let value = value.expect("defined");
        assert!((value - expected).abs() <= tolerance, "{value} is not {expected}");
    }

    #[test]
    fn a_sphere_scores_one_everywhere() {
        let axes = [0.2; 3];
        for value in [b_over_a(axes), c_over_b(axes), corey(axes), krumbein(axes), max_projection(axes)] {
            near(value, 1.0, 1e-15);
        }
        near(sieve_diameter_m(axes), 0.2, 1e-15);
        near(hull_sphericity(PI * 0.008 / 6.0, PI * 0.04), 1.0, 1e-12);
        near(exposed_share(PI * 0.04 / 2.0, axes), 0.5, 1e-12);
        assert_eq!(Zingg::of(axes), Some(Zingg::Spheroid));
        assert_eq!(SneedFolk::of(axes), Some(SneedFolk::Compact));
    }

    #[test]
    fn textbook_ratios_are_met() {
        near(sieve_diameter_m([0.2, 0.1, 0.05]), 0.079_056_941_504, 1e-12);
        near(corey([4.0, 1.0, 1.0]), 0.5, 1e-15);
        near(krumbein([2.0, 1.0, 0.5]), 0.5, 1e-15);
        near(max_projection([2.0, 1.0, 0.5]), 0.5, 1e-15);
        near(hull_sphericity(1.0, 6.0), 0.805_995_977, 1e-9);
        let oblate: f64 = 2.0 * PI * (1.0 + (0.25 / 0.75_f64.sqrt()) * (0.75_f64.sqrt()).atanh());
        near(Some(ellipsoid_area_m2([2.0, 2.0, 1.0])), oblate, oblate * 0.0107);
    }

    #[test]
    fn every_class_has_its_stone() {
        use {SneedFolk as F, Zingg as Z};
        let classes = [
            ([1.0, 0.9, 0.8], Z::Spheroid, F::Compact),
            ([1.0, 0.95, 0.6], Z::Disc, F::CompactPlaty),
            ([1.0, 0.8, 0.6], Z::Spheroid, F::CompactBladed),
            ([1.0, 0.65, 0.6], Z::Rod, F::CompactElongate),
            ([1.0, 0.95, 0.4], Z::Disc, F::Platy),
            ([1.0, 0.65, 0.4], Z::Blade, F::Bladed),
            ([1.0, 0.45, 0.4], Z::Rod, F::Elongate),
            ([1.0, 0.95, 0.1], Z::Disc, F::VeryPlaty),
            ([1.0, 0.5, 0.1], Z::Blade, F::VeryBladed),
            ([1.0, 0.2, 0.1], Z::Blade, F::VeryElongate),
        ];
        for (axes, zingg, folk) in classes {
            assert_eq!((Zingg::of(axes), SneedFolk::of(axes)), (Some(zingg), Some(folk)), "{axes:?}");
        }
    }

    #[test]
    fn a_stone_without_extent_has_no_shape() {
        assert_eq!(Zingg::of([0.0; 3]), None);
        assert_eq!(SneedFolk::of([1.0, 0.0, 0.0]), None);
        assert_eq!(corey([0.0; 3]), None);
        assert_eq!(hull_sphericity(0.0, 0.0), None);
        assert_eq!(exposed_share(1.0, [0.0; 3]), None);
    }
}
