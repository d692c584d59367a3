//! The box along the principal axes of a grain's vertices, and how far it is turned from the true axes.
//!
//! By itself, not by `measure`: what is to be checked must not check itself. As in the paper, the axes go by the
//! variance along them, so that B can be longer than A.

use crate::geometry::DVec3;
use nalgebra::{Matrix3, SymmetricEigen};

/// A box along the principal axes of some points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrincipalBox {
    /// Unit vectors, the direction of the largest variance first; their signs mean nothing.
    pub directions: [DVec3; 3],
    /// Extents along them, metres.
    pub extents_m: [f64; 3],
}

/// Fewer points have no box.
const LEAST_POINTS: usize = 4;

impl PrincipalBox {
    /// The box of at least four points, metres.
    pub fn of(points: &[DVec3]) -> Option<PrincipalBox> {
        if points.len() < LEAST_POINTS {
            return None;
        }
        let mean = points.iter().sum::<DVec3>() / points.len() as f64;
        let mut covariance = Matrix3::<f64>::zeros();
        for point in points {
            let d = (*point - mean).to_array();
            for i in 0..3 {
                for j in 0..3 {
                    covariance[(i, j)] += d[i] * d[j];
                }
            }
        }
        let eigen = SymmetricEigen::new(covariance / (points.len() - 1) as f64);
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
        let directions = order.map(|k| {
            let v = eigen.eigenvectors.column(k);
            DVec3::new(v[0], v[1], v[2])
        });
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in points {
            let along = DVec3::from_array(directions.map(|v| v.dot(*point - mean)));
            (low, high) = (low.min(along), high.max(along));
        }
        Some(PrincipalBox { directions, extents_m: (high - low).to_array() })
    }
}

/// How far a grain's axes are turned from those of its stone, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turned {
    /// Angle between the lines along A, B and C, 0 to 90.
    pub axes_deg: [f64; 3],
    /// Sizes of yaw, pitch and roll of the rotation from one frame to the other, for that choice of the axes' signs that
    /// makes their sum the least.
    pub yaw_pitch_roll_deg: [f64; 3],
}

impl Turned {
    /// Compares the axes of a grain with those of its stone: unit vectors along A, B, C.
    pub fn between(grain: [DVec3; 3], stone: [DVec3; 3]) -> Turned {
        let axes_deg = [0, 1, 2].map(|i| grain[i].dot(stone[i]).abs().clamp(0.0, 1.0).acos().to_degrees());
        let stone = [stone[0], stone[1], stone[0].cross(stone[1])];
        let mut least: Option<[f64; 3]> = None;
        for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let (a, b) = (grain[0] * a, grain[1] * b);
            let angles = yaw_pitch_roll([a, b, a.cross(b)], stone).map(|angle| angle.abs().to_degrees());
            let sum = |angles: [f64; 3]| angles.iter().sum::<f64>();
            if least.is_none_or(|least| sum(angles) < sum(least)) {
                least = Some(angles);
            }
        }
        Turned { axes_deg, yaw_pitch_roll_deg: least.unwrap_or_default() }
    }

    /// Yaw, pitch and roll together, degrees.
    pub fn cumulative_deg(&self) -> f64 {
        self.yaw_pitch_roll_deg.iter().sum()
    }
}

/// Angles (radians, about z, y, x) of the rotation that turns the second frame into the first, in the second.
fn yaw_pitch_roll(to: [DVec3; 3], from: [DVec3; 3]) -> [f64; 3] {
    let r = |i: usize, j: usize| to[i].dot(from[j]);
    [r(1, 0).atan2(r(0, 0)), (-r(2, 0)).atan2(r(2, 1).hypot(r(2, 2))), r(2, 1).atan2(r(2, 2))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_box_has_its_own_edges_and_its_own_turn() {
        let turn = glam::DMat3::from_rotation_z(0.3);
        let corners: Vec<DVec3> = (0..8)
            .map(|i| turn * DVec3::new(f64::from(i & 1) * 5.0, f64::from(i >> 1 & 1) * 3.0, f64::from(i >> 2) * 2.0))
            .collect();
        let found = PrincipalBox::of(&corners).expect("eight points");
        for (extent, edge) in found.extents_m.iter().zip([5.0, 3.0, 2.0]) {
            assert!((extent - edge).abs() < 1e-12, "{found:?}");
        }
        let turned = Turned::between(found.directions, [DVec3::X, DVec3::Y, DVec3::Z]);
        let expected = 0.3f64.to_degrees();
        assert!((turned.cumulative_deg() - expected).abs() < 1e-9, "{turned:?}");
        assert!((turned.axes_deg[0] - expected).abs() < 1e-9 && turned.axes_deg[2] < 1e-5, "{turned:?}");
        assert!((turned.yaw_pitch_roll_deg[0] - expected).abs() < 1e-9, "{turned:?}");
    }

    #[test]
    fn three_points_have_no_box() {
        assert_eq!(PrincipalBox::of(&[DVec3::X, DVec3::Y, DVec3::Z]), None);
    }
}
