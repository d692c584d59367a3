//! Axes of a grain: the box along the principal axes of its vertices.
//!
//! As in the authors' program: principal component analysis of the vertices, unweighted, and the extent of
//! the visible part along each axis. Unlike there, the axes are then ordered by their extents, so that
//! a >= b >= c always, and turned by a fixed rule, so that attitudes can be compared.

use crate::geometry::DVec3;
use nalgebra::{Matrix3, SymmetricEigen};

/// Extents and directions of a grain's three axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    /// Extents along a, b, c, metres, a >= b >= c.
    pub extents_m: [f64; 3],
    /// Unit vectors along a, b, c: right-handed, c upward, a eastward.
    pub directions: [DVec3; 3],
}

/// Axes of some points, metres in any frame with x east, y north, z up.
///
/// # Panics
/// Never: without points all extents are 0.
pub fn axes(points: &[DVec3]) -> Axes {
    let Some(&first) = points.first() else {
        return Axes { extents_m: [0.0; 3], directions: [DVec3::X, DVec3::Y, DVec3::Z] };
    };
    let n = points.len() as f64;
    let mean = points.iter().fold(DVec3::ZERO, |sum, &p| sum + (p - first)) / n + first;
    let mut covariance = Matrix3::<f64>::zeros();
    for &p in points {
        let d = p - mean;
        for i in 0..3 {
            for j in 0..=i {
                covariance[(i, j)] += d[i] * d[j];
            }
        }
    }
    for i in 0..3 {
        for j in i + 1..3 {
            covariance[(i, j)] = covariance[(j, i)];
        }
    }
    let eigen = SymmetricEigen::new(covariance / n);
    let directions = [0, 1, 2].map(|k| {
        let v = eigen.eigenvectors.column(k);
        DVec3::new(v[0], v[1], v[2]).normalize_or(DVec3::AXES[k])
    });
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &p in points {
        let along = DVec3::from_array(directions.map(|v| v.dot(p - mean)));
        (low, high) = (low.min(along), high.max(along));
    }
    let mut sorted = [0, 1, 2].map(|k| ((high - low)[k], directions[k]));
    sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
    Axes { extents_m: [sorted[0].0, sorted[1].0, sorted[2].0], directions: turned(sorted[0].1, sorted[2].1) }
}

/// The sign rule: c points up, a points east (north where it has no east component), b completes a
/// right-handed frame.
fn turned(a: DVec3, c: DVec3) -> [DVec3; 3] {
    let c = if c.z < 0.0 || (c.z == 0.0 && (c.y < 0.0 || (c.y == 0.0 && c.x < 0.0))) { -c } else { c };
    let a = if a.x < 0.0 || (a.x == 0.0 && (a.y < 0.0 || (a.y == 0.0 && a.z < 0.0))) { -a } else { a };
    [a, c.cross(a).normalize_or(DVec3::Y), c]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_box_keeps_its_extents_and_gives_its_attitude() {
        let (sin, cos) = 0.5f64.sin_cos();
        let points: Vec<DVec3> = (0..8)
            .map(|i| DVec3::new(f64::from(i & 1) * 3.0, f64::from(i >> 1 & 1) * 2.0, f64::from(i >> 2)))
            .map(|p| DVec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z) + DVec3::new(1e3, -2e3, 5.0))
            .collect();
        let axes = axes(&points);
        for (found, true_m) in axes.extents_m.iter().zip([3.0, 2.0, 1.0]) {
            assert!((found - true_m).abs() < 1e-9, "{axes:?}");
        }
        assert!((axes.directions[0] - DVec3::new(cos, sin, 0.0)).length() < 1e-9, "{axes:?}");
        assert!((axes.directions[2] - DVec3::Z).length() < 1e-9, "{axes:?}");
    }

    #[test]
    fn the_frame_is_right_handed_with_c_up_and_a_east() {
        for (a, c) in [(DVec3::NEG_X, DVec3::NEG_Z), (DVec3::Y, DVec3::X), (DVec3::NEG_Y, DVec3::NEG_X)] {
            let [a, b, c] = turned(a, c);
            assert!(a.cross(b).dot(c) > 0.999 && c.z >= 0.0 && a.x >= 0.0);
        }
    }
}
