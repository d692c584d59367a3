//! Confidence: how likely a grain and one stone have half in common.
//!
//! A logistic regression on four figures that have no scale, fitted to 495 grains of five made-up scenes with known stones
//! (sandboxes, packed and coarse beds, sharp and blurred). A grain was right if it and a stone overlap by half of their
//! joint surface. Fitted to four of the scenes, it says of the fifth what is so: see `benches/accuracy.md`.

use super::grain::Grain;
use super::shape::hull_sphericity;

/// Log odds where all figures are 0.
const NONE: f64 = -11.85;
/// Of the natural logarithm of the number of triangles: size against resolution. Held here: 1.12 would fit no better to speak of, and
/// trust hardly any grain of a coarse mesh, where all are of few triangles.
const TRIANGLES: f64 = 0.70;
/// Of the sphericity of the hull: defects of shape.
const SPHERICITY: f64 = 7.84;
/// Of the share that lies away from valleys: exposure.
const CORE: f64 = 8.70;
/// Of the share of the border where nothing bounds it: its sharpness.
const FREE: f64 = -4.01;

/// Chance that a grain and one stone overlap by half or more of their joint visible surface, 0 to 1; none where the
/// method gives no evidence, or the grain has no hull.
pub fn confidence(grain: &Grain) -> Option<f64> {
    let evidence = grain.evidence?;
    let sphericity = hull_sphericity(grain.hull_volume_m3, grain.hull_area_m2).filter(|s| s.is_finite())?;
    let log_odds = NONE
        + TRIANGLES * (grain.triangles.max(1) as f64).ln()
        + SPHERICITY * sphericity
        + CORE * evidence.core_share.clamp(0.0, 1.0)
        + FREE * evidence.free_rim.clamp(0.0, 1.0);
    Some(1.0 / (1.0 + (-log_odds).exp()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;
    use crate::segment::Evidence;

    fn grain(triangles: u64, hull: [f64; 2], core_share: f64, free_rim: f64) -> Grain {
        Grain {
            anchor: 0,
            triangles,
            vertices: triangles / 2,
            centroid: DVec3::ZERO,
            top_z: 0.0,
            axes_m: [0.1; 3],
            directions: DVec3::AXES,
            ellipsoid_axes_m: None,
            completed: None,
            surface_area_m2: 0.01,
            hull_area_m2: hull[0],
            hull_volume_m3: hull[1],
            footprint_area_m2: 0.01,
            color_mean: None,
            color_std: None,
            touches_edge: false,
            evidence: Some(Evidence { core_share, free_rim, ..Evidence::default() }),
            outline: Vec::new(),
            triangle_ids: Vec::new(),
        }
    }

    /// Area and volume of a ball and of a flat cylinder.
    const BALL: [f64; 2] = [std::f64::consts::PI, std::f64::consts::PI / 6.0];
    const SLAB: [f64; 2] = [2.2 * std::f64::consts::PI, 0.1 * std::f64::consts::PI];

    #[test]
    fn whatever_speaks_against_a_grain_lowers_its_confidence() {
        let sure = confidence(&grain(5000, BALL, 0.9, 0.05)).unwrap();
        assert!(sure > 0.99 && sure < 1.0, "{sure}");
        for worse in [
            grain(100, BALL, 0.9, 0.05),
            grain(5000, SLAB, 0.9, 0.05),
            grain(5000, BALL, 0.2, 0.05),
            grain(5000, BALL, 0.9, 0.9),
        ] {
            assert!(confidence(&worse).unwrap() < sure);
        }
        assert!(confidence(&grain(60, SLAB, 0.1, 0.9)).unwrap() < 0.05);
    }

    #[test]
    fn without_evidence_or_hull_there_is_no_confidence() {
        let mut without = grain(5000, BALL, 0.9, 0.0);
        without.evidence = None;
        assert_eq!(confidence(&without), None);
        assert_eq!(confidence(&grain(5000, [f64::NAN; 2], 0.9, 0.0)), None);
        let odd = confidence(&grain(0, BALL, -3.0, 7.0)).unwrap();
        assert!((0.0..=1.0).contains(&odd));
    }
}
