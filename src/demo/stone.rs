//! The shape of one stone: a superellipsoid with low-order bumps.

use super::random::{Random, noise};
use crate::geometry::DVec3;
use glam::DMat3;

/// How many waves roughen a stone.
const BUMPS: usize = 4;
/// Wavelength and height of pits and knobs, metres: fresh breaks and percussion marks.
const TEXTURE_WAVELENGTH_M: f64 = 0.0055;
const TEXTURE_M: f64 = 0.00035;
/// Directions in which the full axes are sampled; their spacing costs the axes less than 0.1 %.
const AXIS_SAMPLES: u32 = 4000;

/// A stone as an implicit body, metres.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    pub(super) centre: DVec3,
    /// Columns are the stone's own axes in the scene.
    pub(super) rotation: DMat3,
    /// Half axes without bumps.
    pub(super) half: DVec3,
    /// Exponents of the superellipsoid: round the a-b plane, and against c.
    exponents: [f64; 2],
    bumps: [Bump; BUMPS],
    texture: u64,
}

#[derive(Debug, Clone, Copy)]
struct Bump {
    wave: DVec3,
    phase: f64,
    amplitude: f64,
}

impl Shape {
    /// A random stone of the given b axis (metres) at the origin, lying flat more often than not.
    pub(super) fn random(random: &mut Random, b_m: f64) -> Shape {
        let b_over_a = random.range(0.6, 0.95);
        let c_over_b = random.range(0.45, 0.95);
        let exponents = [random.range(1.6, 2.8), random.range(1.6, 2.8)];
        let bumps = [(); BUMPS].map(|()| Bump {
            wave: random.direction() * random.range(1.5, 3.5),
            phase: random.range(0.0, std::f64::consts::TAU),
            amplitude: random.range(0.004, 0.02),
        });
        let tilt = if random.chance(0.15) { random.range(0.0, 1.4) } else { 0.22 * random.normal() };
        let axis = random.range(0.0, std::f64::consts::TAU);
        let yaw = random.range(0.0, std::f64::consts::TAU);
        let lean = DMat3::from_axis_angle(DVec3::new(axis.cos(), axis.sin(), 0.0), tilt);
        Shape {
            centre: DVec3::ZERO,
            rotation: lean * DMat3::from_rotation_z(yaw),
            half: 0.5 * b_m * DVec3::new(1.0 / b_over_a, 1.0, c_over_b),
            exponents,
            bumps,
            texture: random.bits(),
        }
    }

    /// Roughly the signed distance to the surface, metres, negative inside; exact in sign where it is
    /// less than `near_m`, cheaper and only roughly so beyond.
    pub(super) fn distance_m(&self, point: DVec3, near_m: f64) -> f64 {
        let local = self.rotation.transpose() * (point - self.centre);
        let scaled = local / self.half;
        let radius = scaled.length();
        if radius < 1e-6 {
            return -self.half.min_element();
        }
        // The gradient of the ellipsoid turns the dimensionless excess into metres.
        let metres = radius / (scaled / self.half).length();
        let rough = (radius - 1.0) * metres;
        // Exponents and bumps move the surface by less than that.
        if !(0.75..=1.3).contains(&radius) && rough.abs() > near_m {
            return rough;
        }
        (self.level(scaled, radius) - 1.0) * metres - self.texture_m(local)
    }

    fn texture_m(&self, local: DVec3) -> f64 {
        TEXTURE_M * noise(self.texture, local / TEXTURE_WAVELENGTH_M)
    }

    /// 1 on the surface, proportional to the distance from the centre.
    fn level(&self, scaled: DVec3, radius: f64) -> f64 {
        let [p, q] = self.exponents;
        let s = scaled.abs();
        let plan = (s.x.powf(p) + s.y.powf(p)).powf(q / p);
        let direction = scaled / radius;
        let bump: f64 = self.bumps.iter().map(|b| b.amplitude * (b.wave.dot(direction) + b.phase).sin()).sum();
        (plan + s.z.powf(q)).powf(1.0 / q) / (1.0 + bump)
    }

    /// Half the size of the box that surely holds the stone, metres.
    pub(super) fn reach(&self) -> DVec3 {
        let squares = self.half * self.half * 1.3 * 1.3;
        let r = self.rotation;
        let row = |a: f64, b: f64, c: f64| DVec3::new(a * a, b * b, c * c).dot(squares).sqrt();
        DVec3::new(
            row(r.x_axis.x, r.y_axis.x, r.z_axis.x),
            row(r.x_axis.y, r.y_axis.y, r.z_axis.y),
            row(r.x_axis.z, r.y_axis.z, r.z_axis.z),
        )
    }

    /// Full axes with bumps and texture, longest first, and their right-handed directions (columns).
    pub(super) fn axes(&self) -> ([f64; 3], DMat3) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for direction in sphere(AXIS_SAMPLES) {
            let smooth = direction * self.half / self.level(direction, 1.0);
            let outward = (smooth / (self.half * self.half)).normalize();
            let surface = smooth + outward * self.texture_m(smooth);
            low = low.min(surface);
            high = high.max(surface);
        }
        let extent = (high - low).to_array();
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| extent[j].total_cmp(&extent[i]));
        let a = self.rotation.col(order[0]);
        let b = self.rotation.col(order[1]);
        (order.map(|i| extent[i]), DMat3::from_cols(a, b, a.cross(b)))
    }
}

/// Evenly spread directions (Fibonacci spiral).
fn sphere(count: u32) -> impl Iterator<Item = DVec3> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (sin, cos) = (golden_angle * f64::from(i)).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipsoid_has_its_own_axes_and_a_surface_within_its_texture() {
        let mut shape = Shape::random(&mut Random::new(1, 2), 0.02);
        shape.exponents = [2.0, 2.0];
        shape.bumps.iter_mut().for_each(|b| b.amplitude = 0.0);
        let (axes, directions) = shape.axes();
        for (axis, half) in axes.iter().zip(shape.half.to_array()) {
            assert!((axis - 2.0 * half).abs() < 2.0 * TEXTURE_M + 1e-5, "{axis} against {}", 2.0 * half);
        }
        assert!((directions.determinant() - 1.0).abs() < 1e-12);
        for direction in sphere(50) {
            let on = shape.centre + shape.rotation * (direction * shape.half);
            assert!(shape.distance_m(on, 1e-3).abs() <= TEXTURE_M);
        }
    }
}
