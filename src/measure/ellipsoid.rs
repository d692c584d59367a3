//! The least-squares ellipsoid of a grain's visible surface.
//!
//! The ellipsoid-specific linear fit of Li & Griffiths (2004, Geometric Modeling and Processing, 335-340,
//! doi:10.1109/GMAP.2004.1290055): the quadric x'Ax + 2 b'x + c = 0 of least algebraic distance under
//! 4 J - I² = 1, solved as a symmetric eigenproblem. The field uses it for grains (Steer et al. 2022);
//! from a cap it is less steady than the box along the principal axes, which stays the reported size.

use crate::geometry::DVec3;
use nalgebra::{Matrix3, Matrix4, Matrix6, Matrix6x4, SMatrix, SVector, SymmetricEigen, Vector3};

/// Full axes of the fitted ellipsoid, a >= b >= c, metres; none where the points determine none (too few,
/// flat, or a saddle).
pub fn ellipsoid_axes(points: &[DVec3]) -> Option<[f64; 3]> {
    if points.len() < 10 {
        return None;
    }
    // Centred and scaled to about 1, so that the normal matrix is well conditioned.
    let n = points.len() as f64;
    let first = points[0];
    let mean = points.iter().fold(DVec3::ZERO, |sum, &p| sum + (p - first)) / n + first;
    let spread = (points.iter().map(|&p| (p - mean).length_squared()).sum::<f64>() / n).sqrt();
    if spread <= 0.0 {
        return None;
    }
    let quadric = fit(points.iter().map(|&p| (p - mean) / spread))?;
    axes_of(&quadric).map(|axes| axes.map(|a| a * spread))
}

/// Coefficients of x², y², z², 2yz, 2xz, 2xy, 2x, 2y, 2z, 1.
fn fit(points: impl Iterator<Item = DVec3>) -> Option<SVector<f64, 10>> {
    let mut scatter = SMatrix::<f64, 10, 10>::zeros();
    for p in points {
        let d = SVector::<f64, 10>::from_column_slice(&[
            p.x * p.x,
            p.y * p.y,
            p.z * p.z,
            2.0 * p.y * p.z,
            2.0 * p.x * p.z,
            2.0 * p.x * p.y,
            2.0 * p.x,
            2.0 * p.y,
            2.0 * p.z,
            1.0,
        ]);
        scatter.ger(1.0, &d, &d, 1.0);
    }
    let s11: Matrix6<f64> = scatter.fixed_view::<6, 6>(0, 0).into_owned();
    let s12: Matrix6x4<f64> = scatter.fixed_view::<6, 4>(0, 6).into_owned();
    let s22: Matrix4<f64> = scatter.fixed_view::<4, 4>(6, 6).into_owned();
    let inverse = s22.try_inverse()?;
    let mut reduced = s11 - s12 * inverse * s12.transpose();
    // Points that lie exactly on an ellipsoid make this singular, and rounding then makes it indefinite.
    let ridge = 1e-13 * s11.trace();
    (0..6).for_each(|i| reduced[(i, i)] += ridge);
    // With reduced = L L', the constrained minimum is the greatest eigenvalue of L^-1 C L^-T.
    let lower = reduced.cholesky()?.l().try_inverse()?;
    let mut constraint = Matrix6::<f64>::zeros();
    for i in 0..3 {
        for j in 0..3 {
            constraint[(i, j)] = if i == j { -1.0 } else { 1.0 };
        }
        constraint[(i + 3, i + 3)] = -4.0;
    }
    let eigen = SymmetricEigen::new(lower * constraint * lower.transpose());
    let best = eigen.eigenvalues.imax();
    if eigen.eigenvalues[best] <= 0.0 {
        return None;
    }
    let shape = lower.transpose() * eigen.eigenvectors.column(best);
    let rest = -(inverse * s12.transpose() * shape);
    let mut all = SVector::<f64, 10>::zeros();
    all.fixed_rows_mut::<6>(0).copy_from(&shape);
    all.fixed_rows_mut::<4>(6).copy_from(&rest);
    Some(all)
}

fn axes_of(q: &SVector<f64, 10>) -> Option<[f64; 3]> {
    let a = Matrix3::new(q[0], q[5], q[4], q[5], q[1], q[3], q[4], q[3], q[2]);
    let b = Vector3::new(q[6], q[7], q[8]);
    let centre = -(a.try_inverse()? * b);
    let level = centre.dot(&(a * centre)) - q[9];
    let mut axes: Vec<f64> =
        SymmetricEigen::new(a).eigenvalues.iter().map(|&value| 2.0 * (level / value).sqrt()).collect();
    axes.sort_by(|x, y| y.total_cmp(x));
    axes.iter().all(|a| a.is_finite() && *a > 0.0).then(|| [axes[0], axes[1], axes[2]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_upper_half_of_an_ellipsoid_gives_all_three_axes() {
        let points: Vec<DVec3> = (0..400)
            .map(|i| {
                let (u, v) = (f64::from(i % 20) * 0.314, 0.05 + f64::from(i / 20) * 0.075);
                DVec3::new(0.04 * v.sin() * u.cos(), 0.03 * v.sin() * u.sin(), 0.02 * v.cos())
            })
            .map(|p| DVec3::new(0.6 * p.x - 0.8 * p.z, p.y, 0.8 * p.x + 0.6 * p.z) + DVec3::new(7.0, 8.0, 9.0))
            .collect();
        let axes = ellipsoid_axes(&points).expect("fits");
        for (found, true_m) in axes.iter().zip([0.08, 0.06, 0.04]) {
            assert!((found - true_m).abs() < 1e-7, "{axes:?}");
        }
    }

    #[test]
    fn a_plane_has_no_ellipsoid() {
        let points: Vec<DVec3> = (0..100).map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 1.0)).collect();
        assert_eq!(ellipsoid_axes(&points), None);
    }
}
