//! The least-squares ellipsoid of a grain's visible surface.
//!
//! The ellipsoid-specific linear fit of Li & Griffiths (2004, Geometric Modeling and Processing, 335-340,
//! doi:10.1109/GMAP.2004.1290055): the quadric x'Ax + 2 b'x + c = 0 of least algebraic distance under
//! k J - I² = 1 (I = trace of A, J = the sum of its principal 2x2 minors), solved as a symmetric
//! eigenproblem, with the largest k that gives an ellipsoid. The field uses it for grains (Steer et al. 2022);
//! from a cap it is less steady than the box along the principal axes, which stays the reported size.

use crate::geometry::DVec3;
use nalgebra::{Matrix3, Matrix4, Matrix6, Matrix6x4, SMatrix, SVector, SymmetricEigen, Vector3};

/// Full axes of the fitted ellipsoid, a >= b >= c, metres; none where the points determine none: too few, flat, a
/// saddle, or so nearly a bowl without end that the ellipsoid is far longer than they are.
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
    let axes = fit(points.iter().map(|&p| (p - mean) / spread))?.map(|a| a * spread);
    let farthest = points.iter().map(|&p| (p - mean).length_squared()).fold(0.0, f64::max).sqrt();
    (axes[0] <= MOST_BEYOND * 2.0 * farthest).then_some(axes)
}

/// How many times the distance of the farthest point from the mean the half length of an ellipsoid may be. Where it is nearly
/// a paraboloid its length is anything: of 464 stones three came out above 20,000 times as long as the box around them, and
/// of the others none above 3.8 times.
const MOST_BEYOND: f64 = 5.0;

/// Share of the normal matrix's trace that is added to its diagonal, far below any real noise: points that
/// lie exactly on an ellipsoid make it singular, and rounding then makes it indefinite.
const RIDGE: f64 = 1e-13;
/// With k = 4 every solution is an ellipsoid, but flat ones (c/a below about 0.45) are out of reach.
const SMALLEST_K: f64 = 4.0;
/// With this k discs of c/a = 0.02 are within reach, and solutions need not be ellipsoids.
const LARGEST_K: f64 = 1e4;
/// Halvings of the logarithm of k: the axes no longer change in their fourth digit.
const HALVINGS: u32 = 16;

/// Full axes of the ellipsoid under the largest k that gives one, in the points' unit.
fn fit(points: impl Iterator<Item = DVec3>) -> Option<[f64; 3]> {
    let normal = Normal::of(points)?;
    let axes = |k: f64| normal.solve(k).as_ref().and_then(axes_of);
    if let Some(flat_or_not) = axes(LARGEST_K) {
        return Some(flat_or_not);
    }
    let mut best = axes(SMALLEST_K)?;
    let (mut low, mut high) = (SMALLEST_K.ln(), LARGEST_K.ln());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match axes(middle.exp()) {
            Some(found) => (low, best) = (middle, found),
            None => high = middle,
        }
    }
    Some(best)
}

/// The normal equations of the quadric fit, with the linear part eliminated.
struct Normal {
    /// Inverse of the lower Cholesky factor of the reduced matrix of the quadratic coefficients.
    lower: Matrix6<f64>,
    /// What gives the linear coefficients from the quadratic ones.
    rest: SMatrix<f64, 4, 6>,
}

impl Normal {
    fn of(points: impl Iterator<Item = DVec3>) -> Option<Normal> {
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
            // The lower half; the matrix is symmetric.
            for j in 0..10 {
                for i in j..10 {
                    scatter[(i, j)] += d[i] * d[j];
                }
            }
        }
        scatter.fill_upper_triangle_with_lower_triangle();
        let s11: Matrix6<f64> = scatter.fixed_view::<6, 6>(0, 0).into_owned();
        let s12: Matrix6x4<f64> = scatter.fixed_view::<6, 4>(0, 6).into_owned();
        let s22: Matrix4<f64> = scatter.fixed_view::<4, 4>(6, 6).into_owned();
        let rest = -(s22.try_inverse()? * s12.transpose());
        let reduced = s11 + s12 * rest + Matrix6::identity() * (s11.trace() * RIDGE);
        Some(Normal { lower: reduced.cholesky()?.l().try_inverse()?, rest })
    }

    /// Coefficients of x², y², z², 2yz, 2xz, 2xy, 2x, 2y, 2z, 1 under k J - I² = 1. With the reduced matrix
    /// as L L', they come from the greatest eigenvalue of L^-1 C L^-T, where C is that constraint.
    fn solve(&self, k: f64) -> Option<SVector<f64, 10>> {
        let mut constraint = Matrix6::<f64>::zeros();
        for i in 0..3 {
            for j in 0..3 {
                constraint[(i, j)] = if i == j { -1.0 } else { k / 2.0 - 1.0 };
            }
            constraint[(i + 3, i + 3)] = -k;
        }
        let eigen = SymmetricEigen::new(self.lower * constraint * self.lower.transpose());
        let best = eigen.eigenvalues.imax();
        if eigen.eigenvalues[best] <= 0.0 {
            return None;
        }
        let shape = self.lower.transpose() * eigen.eigenvectors.column(best);
        let mut all = SVector::<f64, 10>::zeros();
        all.fixed_rows_mut::<6>(0).copy_from(&shape);
        all.fixed_rows_mut::<4>(6).copy_from(&(self.rest * shape));
        Some(all)
    }
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
    fn the_upper_half_of_a_flat_disc_is_not_thickened() {
        let points: Vec<DVec3> = (0..900)
            .map(|i| {
                let (u, v) = (f64::from(i % 30) * 0.2094, 0.05 + f64::from(i / 30) * 0.05);
                DVec3::new(0.15 * v.sin() * u.cos(), 0.14 * v.sin() * u.sin(), 0.02 * v.cos())
            })
            .collect();
        let axes = ellipsoid_axes(&points).expect("fits");
        for (found, true_m) in axes.iter().zip([0.30, 0.28, 0.04]) {
            assert!((found - true_m).abs() < 1e-5, "{axes:?}");
        }
    }

    #[test]
    fn a_bowl_without_end_has_no_ellipsoid_and_a_shallow_cap_has_one() {
        let over = |height: &dyn Fn(f64) -> f64| -> Vec<DVec3> {
            (0..900)
                .map(|i| {
                    let (r, u) = (f64::from(i / 30) / 30.0, f64::from(i % 30) * 0.2094);
                    DVec3::new(r * u.cos(), 0.8 * r * u.sin(), height(r))
                })
                .collect()
        };
        assert_eq!(ellipsoid_axes(&over(&|r| -0.3 * r * r)), None);
        assert_eq!(ellipsoid_axes(&over(&|r| -0.3 * r * r - 1e-7 * r.powi(4))), None);
        // The uppermost quarter of a ball's radius of 1.5, squeezed in y: 3 long, 2 as seen.
        let axes = ellipsoid_axes(&over(&|r| (2.25 - r * r).sqrt())).expect("fits");
        assert!((axes[0] - 3.0).abs() < 1e-6 && (axes[2] - 2.4).abs() < 1e-6, "{axes:?}");
    }

    #[test]
    fn a_plane_has_no_ellipsoid() {
        let points: Vec<DVec3> = (0..100).map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 1.0)).collect();
        assert_eq!(ellipsoid_axes(&points), None);
    }
}
