//! Whether coordinates are fine enough for the surface that they hold, and whether they are lengths at all.

use super::error::OpenError;
use super::frame::Frame;
use super::printed::PrintedDigits;
use super::sample::EdgeSample;
use super::scalar::Scalar;
use super::survey_file::SurveyFile;
use super::warning::Warning;

/// A float step above this share of the mean edge destroys the surface: normals of neighbouring triangles
/// would turn by some 0.05 rad from rounding alone, as much as grain boundaries do.
const COARSEST_STEP_IN_EDGES: f64 = 0.05;

/// Distance between neighbouring 32-bit floats at this magnitude.
pub(super) fn float_step(value: f64) -> f64 {
    // Rounding up to the next power of two at worst doubles the step, which is what that power has.
    let value = (value.abs() as f32).min(f32::MAX);
    let next = f32::from_bits(value.to_bits() + 1);
    if next.is_finite() { f64::from(next) - f64::from(value) } else { f64::from(value) * f64::from(f32::EPSILON) }
}

/// The coarsest step between neighbouring coordinates of a file, input units, and the coordinate at which it
/// occurs; `None` if all are whole numbers. In a text file the digits decide; `printed` has them.
pub(super) fn coarsest_step(
    types: [Scalar; 3],
    bounds: ([f64; 3], [f64; 3]),
    printed: Option<&PrintedDigits>,
) -> Option<(f64, f64)> {
    (0..3)
        .filter_map(|axis| {
            let largest = bounds.0[axis].abs().max(bounds.1[axis].abs());
            let were_floats = printed.is_some_and(|p| p.were_floats(axis, largest));
            match types[axis] {
                Scalar::F32 => Some((float_step(largest), largest)),
                Scalar::F64 if were_floats => Some((float_step(largest), largest)),
                Scalar::F64 => Some((largest.next_up() - largest, largest)),
                _ => None,
            }
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The coarsest step at which a coordinate that is not the same everywhere is printed, input units, and the largest
/// such coordinate.
pub(super) fn printed_step(printed: &PrintedDigits, bounds: ([f64; 3], [f64; 3])) -> Option<(f64, f64)> {
    (0..3)
        .filter(|&axis| bounds.0[axis] < bounds.1[axis])
        .filter_map(|axis| Some((printed.step(axis)?, bounds.0[axis].abs().max(bounds.1[axis].abs()))))
        .max_by(|a, b| a.0.total_cmp(&b.0))
}

/// Holds the steps of a file's coordinates against its edges.
///
/// Printed steps are refused only where they are longer than edges: a grid whose coordinates are printed in full has
/// steps nearly as long (0 and 1 of a cube), and nothing is wrong with it.
///
/// # Errors
/// The steps have destroyed the surface.
pub(super) fn check_precision(
    file: &SurveyFile,
    sample: &EdgeSample,
    frame: &Frame,
) -> Result<Option<Warning>, OpenError> {
    let path = || file.path().display().to_string();
    let printed = file.mesh.printed.as_ref();
    let step = coarsest_step(file.axis_types(), file.input_bounds(), printed);
    if let (Some((step, largest)), Some(edge_m)) = (step, sample.mean_edge_m()) {
        let step_m = step * frame.metres_per_input_unit;
        if step_m > COARSEST_STEP_IN_EDGES * edge_m {
            return Err(OpenError::FloatStep { path: path(), largest, step_m, edge_m });
        }
    }
    let step = printed.and_then(|printed| printed_step(printed, file.input_bounds()));
    if let (Some((step, largest)), Some(edge_m)) = (step, sample.mean_with_collapsed_m()) {
        let step_m = step * frame.metres_per_input_unit;
        if step_m > edge_m {
            return Err(OpenError::PrintedStep { path: path(), largest, step_m, edge_m });
        }
        if step_m > COARSEST_STEP_IN_EDGES * edge_m {
            return Ok(Some(Warning::CoarselyPrinted { path: path(), step_m, edge_m }));
        }
    }
    Ok(None)
}

/// Nothing in this world is steeper, edge for edge: tan 89.9°. Gravel in degrees is steeper by far, for a degree is
/// 111 km: where edges rise a twentieth of their length, which is little for gravel, it comes to 5,000.
const STEEPEST: f64 = 500.0;
/// No degrees are larger, whichever way longitudes are counted and whichever comes first.
const LARGEST_DEGREES: f64 = 360.0;

/// Whether plan coordinates are degrees and heights are lengths.
///
/// # Errors
/// They are.
pub(super) fn check_not_degrees(
    path: &str,
    sample: &EdgeSample,
    bounds: ([f64; 3], [f64; 3]),
) -> Result<(), OpenError> {
    let [x_extent, y_extent, z_extent] = std::array::from_fn(|i| bounds.1[i] - bounds.0[i]);
    let in_range = (0..2).all(|i| bounds.0[i] >= -LARGEST_DEGREES && bounds.1[i] <= LARGEST_DEGREES);
    let steepness = sample.steepness();
    // A reach of one degree would be longer than any survey. Heights vary by more than the plan does.
    if in_range && x_extent.max(y_extent) < 1.0 && z_extent > x_extent.max(y_extent) && steepness > STEEPEST {
        return Err(OpenError::LooksLikeDegrees { path: path.to_owned(), x_extent, y_extent, z_extent, steepness });
    }
    Ok(())
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
        assert_eq!(coarsest_step([Scalar::F32; 3], bounds, None), Some((0.5, 5_250_000.0)));
        assert_eq!(coarsest_step([Scalar::I32; 3], bounds, None), None);
        let doubles = coarsest_step([Scalar::F64; 3], bounds, None).expect("doubles have a step");
        assert!(doubles.0 < 1e-9);
    }
}
