//! Whether 32-bit floats are fine enough for the surface that they hold.

use super::scalar::Scalar;

/// A float step above this share of the mean edge destroys the surface: normals of neighbouring triangles
/// would turn by some 0.05 rad from rounding alone, as much as grain boundaries do.
pub(super) const COARSEST_STEP_IN_EDGES: f64 = 0.05;

/// Distance between neighbouring 32-bit floats at this magnitude.
pub(super) fn float_step(value: f64) -> f64 {
    // Rounding up to the next power of two at worst doubles the step, which is what that power has.
    let value = (value.abs() as f32).min(f32::MAX);
    let next = f32::from_bits(value.to_bits() + 1);
    if next.is_finite() { f64::from(next) - f64::from(value) } else { f64::from(value) * f64::from(f32::EPSILON) }
}

/// The coarsest step between neighbouring coordinates of a file, input units, and the coordinate at which it
/// occurs; `None` if all are whole numbers.
pub(super) fn coarsest_step(types: [Scalar; 3], bounds: ([f64; 3], [f64; 3])) -> Option<(f64, f64)> {
    (0..3)
        .filter_map(|axis| {
            let largest = bounds.0[axis].abs().max(bounds.1[axis].abs());
            match types[axis] {
                Scalar::F32 => Some((float_step(largest), largest)),
                Scalar::F64 => Some((largest.next_up() - largest, largest)),
                _ => None,
            }
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_northing_in_32_bits_steps_by_half_a_metre() {
        assert_eq!(float_step(5_250_000.0), 0.5);
        assert_eq!(float_step(-500_000.0), 0.03125);
        assert_eq!(float_step(1.0), f64::from(f32::EPSILON));
        assert!(float_step(f64::MAX).is_finite());
    }

    #[test]
    fn the_coarsest_axis_decides() {
        let bounds = ([0.0, -5_250_000.0, 0.0], [500_000.0, 0.0, 700.0]);
        assert_eq!(coarsest_step([Scalar::F32; 3], bounds), Some((0.5, 5_250_000.0)));
        assert_eq!(coarsest_step([Scalar::I32; 3], bounds), None);
        let doubles = coarsest_step([Scalar::F64; 3], bounds).expect("doubles have a step");
        assert!(doubles.0 < 1e-9);
    }
}
