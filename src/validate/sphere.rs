//! The sphere that fits a calibration ball's grain best.

use crate::geometry::DVec3;
use nalgebra::{DMatrix, DVector};

/// Rounds of Gauss-Newton; the algebraic fit before them is near already.
const ROUNDS: usize = 10;

/// A sphere, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub centre: DVec3,
    /// Its radius.
    pub radius_m: f64,
}

impl Sphere {
    /// The sphere with the least squared distances to the points; none where they lie in a plane or are fewer than four.
    pub fn fit(points: &[DVec3]) -> Option<Sphere> {
        if points.len() < 4 {
            return None;
        }
        // About their mean, in units of their spread, so that squares lose no digits.
        let mean = points.iter().sum::<DVec3>() / points.len() as f64;
        let spread = points.iter().map(|p| p.distance(mean)).fold(0.0, f64::max);
        if spread <= 0.0 {
            return None;
        }
        let scaled: Vec<DVec3> = points.iter().map(|p| (*p - mean) / spread).collect();
        let row = |p: &DVec3| ([2.0 * p.x, 2.0 * p.y, 2.0 * p.z, 1.0], p.length_squared());
        let x = least_squares(scaled.iter().map(row))?;
        let mut centre = DVec3::new(x[0], x[1], x[2]);
        let mut radius = (x[3] + centre.length_squared()).sqrt();
        for _ in 0..ROUNDS {
            let row = |p: &DVec3| {
                let away = *p - centre;
                let distance = away.length();
                let [a, b, c] = (-away / distance).to_array();
                ([a, b, c, -1.0], radius - distance)
            };
            let step = least_squares(scaled.iter().map(row))?;
            centre += DVec3::new(step[0], step[1], step[2]);
            radius += step[3];
        }
        let sphere = Sphere { centre: mean + centre * spread, radius_m: radius * spread };
        (sphere.centre.is_finite() && sphere.radius_m.is_finite()).then_some(sphere)
    }

    /// Root of the mean squared distance of points from the sphere about the same centre with another radius, metres.
    pub fn rmse_m(&self, points: &[DVec3], radius_m: f64) -> f64 {
        let squares: f64 = points.iter().map(|p| (p.distance(self.centre) - radius_m).powi(2)).sum();
        (squares / points.len() as f64).sqrt()
    }
}

/// Solves rows of four coefficients and a right-hand side.
fn least_squares(rows: impl ExactSizeIterator<Item = ([f64; 4], f64)>) -> Option<[f64; 4]> {
    let count = rows.len();
    let (mut matrix, mut right) = (DMatrix::<f64>::zeros(count, 4), DVector::<f64>::zeros(count));
    for (i, (coefficients, value)) in rows.enumerate() {
        for (j, coefficient) in coefficients.into_iter().enumerate() {
            matrix[(i, j)] = coefficient;
        }
        right[i] = value;
    }
    let qr = matrix.qr();
    qr.q_tr_mul(&mut right);
    let triangle = qr.unpack_r();
    let size = (0..4).map(|i| triangle[(i, i)].abs()).fold(0.0, f64::max);
    // Points in a plane lie on every large sphere.
    if (0..4).any(|i| triangle[(i, i)].abs() <= 1e-12 * size || !triangle[(i, i)].is_finite()) {
        return None;
    }
    let solved = triangle.solve_upper_triangular(&right.rows(0, 4).into_owned())?;
    Some([solved[0], solved[1], solved[2], solved[3]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cap_gives_the_sphere_that_it_was_cut_from() {
        let centre = DVec3::new(0.3, -0.2, 0.05);
        let points: Vec<DVec3> = (0..400)
            .map(|i| {
                let (lean, turn) = (0.8 * f64::from(i % 20) / 19.0, f64::from(i / 20) * 0.31);
                centre + 0.02 * DVec3::new(lean.sin() * turn.cos(), lean.sin() * turn.sin(), lean.cos())
            })
            .collect();
        let sphere = Sphere::fit(&points).expect("a cap");
        assert!((sphere.radius_m - 0.02).abs() < 1e-12 && sphere.centre.distance(centre) < 1e-12, "{sphere:?}");
        assert!(sphere.rmse_m(&points, sphere.radius_m) < 1e-14);
        assert!((sphere.rmse_m(&points, 0.021) - 0.001).abs() < 1e-12);
    }

    #[test]
    fn points_in_a_plane_have_no_sphere() {
        let flat: Vec<DVec3> = (0..30).map(|i| DVec3::new(f64::from(i % 6), f64::from(i / 6), 0.0)).collect();
        assert_eq!(Sphere::fit(&flat), None);
        assert_eq!(Sphere::fit(&flat[..3]), None);
        assert_eq!(Sphere::fit(&[DVec3::X; 9]), None);
    }
}
