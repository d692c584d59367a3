//! A validation for people: tables with units.

use super::grain_table::{Reliability, SizedBy};
use super::report::Report;
use super::score::{AxisErrors, BAxis, Counts, References, Score, Spheres};
use super::spread::{Middle, Percentiles};
use super::truth::TruthRule;
use std::fmt::{self, Display, Formatter};

impl Display for Report {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (score, perfect) = (&self.score, &self.perfect_labels);
        let rule = match self.truth {
            TruthRule::Best => "all that lies nearest to it",
            TruthRule::Strict => "only what lies right on it",
        };
        writeln!(f, "{} against {}", self.labels, self.scene)?;
        writeln!(f, "{} stones count, {} grains; a stone is {rule}\n", score.visible, score.segments)?;
        writeln!(
            f,
            "{:<26}{:>6}{:>7}{:>7}{:>11}{:>8}{:>7}{:>7}",
            "detection", "found", "false", "missed", "precision", "recall", "F1", "IoU"
        )?;
        write_counts(f, "grain mostly the stone", &score.detection_majority)?;
        write_counts(f, "overlap (IoU) 0.5 or more", &score.detection_iou50)?;
        write_counts(f, "  true labels would give", &perfect.detection_iou50)?;
        write_errors(f, score)?;
        if let Some(area) = &score.area {
            writeln!(f, "\n{:<26}{:>10}{:>10}{:>10}", "surface of found stones", "precision", "recall", "IoU")?;
            let columns = [area.precision, area.recall, area.iou];
            write_row(f, "mean", columns.map(|c| format!("{:.3}", c.mean)))?;
            write_row(f, "median", columns.map(|c| format!("{:.3}", c.median)))?;
        }
        if let Some(axes) = &score.axes {
            write_axes(f, self, axes)?;
        }
        if let Some(turned) = &score.orientation {
            writeln!(
                f,
                "\n{:<26}{:>10}{:>10}{:>10}{:>18}",
                "axes turned by, degrees", "A", "B", "C", "yaw+pitch+roll"
            )?;
            write_degrees(f, "mean", [turned.a, turned.b, turned.c, turned.cumulative].map(|m| m.mean))?;
            write_degrees(f, "median", [turned.a, turned.b, turned.c, turned.cumulative].map(|m| m.median))?;
        }
        if let Some(b_axis) = &score.b_axis_mm {
            write_b_axes(f, self, b_axis)?;
        }
        if let Some(references) = &score.reference_pebbles {
            write_references(f, references)?;
        }
        if let Some(spheres) = &score.spheres {
            write_spheres(f, spheres)?;
        }
        match &self.reliability {
            Some(reliability) => write_reliability(f, reliability),
            None => Ok(()),
        }
    }
}

fn write_row(f: &mut Formatter<'_>, name: &str, cells: [String; 3]) -> fmt::Result {
    let [a, b, c] = cells;
    writeln!(f, "{name:<26}{a:>10}{b:>10}{c:>10}")
}

fn write_counts(f: &mut Formatter<'_>, name: &str, counts: &Counts) -> fmt::Result {
    let Counts { tp, fp, missed, precision, recall, f1, iou } = counts;
    writeln!(f, "{name:<26}{tp:>6}{fp:>7}{missed:>7}{precision:>11.3}{recall:>8.3}{f1:>7.3}{iou:>7.3}")
}

fn write_errors(f: &mut Formatter<'_>, score: &Score) -> fmt::Result {
    let errors = &score.errors;
    writeln!(
        f,
        "false: {} on sand, {} further grains on {} split stones (over-segmentation)",
        errors.mostly_sand, errors.over_segmented_extra, errors.over_segmented_pebbles
    )?;
    writeln!(
        f,
        "missed: {} merged into another grain (under-segmentation), {} in no grain to speak of",
        errors.under_segmented, errors.missed
    )?;
    let Counts { tp, fp, .. } = score.detection_majority;
    let others = score.segments.saturating_sub(tp + fp + errors.phantom_ignored);
    if others + errors.phantom_ignored > 0 {
        writeln!(
            f,
            "not judged: {others} on stones that do not count, {} on membranes over space that no camera saw",
            errors.phantom_ignored
        )?;
    }
    Ok(())
}

fn write_axes(f: &mut Formatter<'_>, report: &Report, boxes: &AxisErrors) -> fmt::Result {
    writeln!(f, "\n{:<26}{:>13}{:>26}{:>26}", "axes, errors in percent", "A", "B", "C")?;
    writeln!(f, "{:<26}{}", "", format!("{:>10}{:>8}{:>8}", "mean |e|", "median", "bias").repeat(3))?;
    write_axis_errors(f, "box: *_axis_m", boxes)?;
    let by_run = [("ellipsoid_*_axis_m", &report.ellipsoid), ("completed: *_fit_m", &report.fit)];
    for (name, sized) in by_run {
        if let Some(SizedBy { axes, .. }) = sized {
            write_axis_errors(f, name, axes)?;
        }
    }
    match &report.perfect_labels.axes {
        Some(axes) => write_axis_errors(f, "  true labels would give", axes),
        None => Ok(()),
    }
}

fn write_axis_errors(f: &mut Formatter<'_>, name: &str, axes: &AxisErrors) -> fmt::Result {
    write!(f, "{name:<26}")?;
    for axis in axes.to_array() {
        let [mean, median] = [axis.mean_abs_percent, axis.median_abs_percent].map(|e| percent(e, false));
        write!(f, "{mean:>10}{median:>8}{:>8}", percent(axis.bias_percent, true))?;
    }
    writeln!(f)
}

/// Percent with one decimal; what is beyond all sense, such as an ellipsoid that fits nearly a plane, stays short.
fn percent(value: f64, has_sign: bool) -> String {
    match (value.abs() < 1e4 || value.is_nan(), has_sign) {
        (true, false) => format!("{value:.1}"),
        (true, true) => format!("{value:+.1}"),
        (false, false) => format!("{value:.0e}"),
        (false, true) => format!("{value:+.0e}"),
    }
}

fn write_degrees(f: &mut Formatter<'_>, name: &str, [a, b, c, all]: [f64; 4]) -> fmt::Result {
    writeln!(f, "{name:<26}{a:>10.1}{b:>10.1}{c:>10.1}{all:>18.1}")
}

fn write_b_axes(f: &mut Formatter<'_>, report: &Report, boxes: &BAxis) -> fmt::Result {
    writeln!(f, "\n{:<26}{:>9}{:>19}{:>19}", "b axis, mm", "D16", "D50", "D84")?;
    write_sizes(f, "true stones", Some(boxes.truth), None)?;
    write_sizes(f, "box: *_axis_m", boxes.segments, boxes.error_percent)?;
    let by_run = [("ellipsoid_*_axis_m", &report.ellipsoid), ("completed: *_fit_m", &report.fit)];
    for (name, sized) in by_run {
        if let Some(b_axis) = sized.as_ref().and_then(|sized| sized.b_axis_mm) {
            write_sizes(f, name, b_axis.segments, b_axis.error_percent)?;
        }
    }
    match &report.perfect_labels.b_axis_mm {
        Some(b_axis) => write_sizes(f, "  true labels would give", b_axis.segments, b_axis.error_percent),
        None => Ok(()),
    }
}

fn write_sizes(
    f: &mut Formatter<'_>,
    name: &str,
    sizes: Option<Percentiles>,
    errors: Option<Percentiles>,
) -> fmt::Result {
    let Some(sizes) = sizes else { return writeln!(f, "{name:<26}{:>9}{:>19}{:>19}", "none", "none", "none") };
    let error = |i: usize| errors.map_or_else(String::new, |e| format!("{} %", percent(e.to_array()[i], true)));
    let [d16, d50, d84] = sizes.to_array();
    let row = format!("{d16:>9.1}{:>10}{d50:>9.1}{:>10}{d84:>9.1}{:>10}", error(0), error(1), error(2));
    writeln!(f, "{name:<26}{}", row.trim_end())
}

fn write_references(f: &mut Formatter<'_>, references: &References) -> fmt::Result {
    let References { n, iou_over_08, rows, .. } = references;
    writeln!(f, "\nreference pebbles: {n}, of which {iou_over_08} with an IoU above 0.8")?;
    writeln!(
        f,
        "  no  precision  recall    IoU  represented  dA mm  dB mm  dC mm  sum cm   yaw  pitch  roll  sum deg"
    )?;
    for row in rows {
        let [a, b, c] = row.errors_m().map(|m| 1e3 * m);
        let represented = row.represented.map_or_else(String::new, |share| format!("{share:.2}"));
        write!(f, "{:>4}{:>11.3}{:>8.3}{:>7.3}{represented:>13}", row.reference, row.precision, row.recall, row.iou)?;
        write!(f, "{a:>+7.1}{b:>+7.1}{c:>+7.1}{:>8.2}", row.cumulative_axes_cm)?;
        if let Some(turned) = &row.attitude {
            write!(f, "{:>6.0}{:>7.0}{:>6.0}{:>9.0}", turned.yaw, turned.pitch, turned.roll, turned.cumulative_angle)?;
        }
        writeln!(f)?;
    }
    Ok(())
}

fn write_spheres(f: &mut Formatter<'_>, spheres: &Spheres) -> fmt::Result {
    let Spheres { n, rmse_mm, rmse_true_radius_mm, radius_bias_mm } = spheres;
    let Middle { mean, median } = rmse_mm.middle;
    writeln!(f, "\ncalibration balls: {n}; distances of their surfaces from spheres (RMSE), mm")?;
    writeln!(f, "{:<26}mean {mean:.3}, median {median:.3}, largest {:.3}", "of the radius that fits", rmse_mm.max)?;
    let Middle { mean, .. } = rmse_true_radius_mm.middle;
    writeln!(f, "{:<26}mean {mean:.3}, largest {:.3}", "of the true radius", rmse_true_radius_mm.max)?;
    writeln!(f, "{:<26}{radius_bias_mm:+.3}", "radius too large by, mm")
}

fn write_reliability(f: &mut Formatter<'_>, reliability: &Reliability) -> fmt::Result {
    writeln!(f, "\n{:<26}{:>10}{:>10}{:>10}", "confidence stated", "grains", "mean", "right")?;
    for bin in &reliability.bins {
        let name = format!("{:.1} to {:.1}", bin.from, bin.from + 0.1);
        let shares = [bin.mean_confidence, bin.share_right].map(|share| format!("{share:.3}"));
        writeln!(f, "{name:<26}{:>10}{:>10}{:>10}", bin.grains, shares[0], shares[1])?;
    }
    let difference = reliability.calibration_error;
    writeln!(
        f,
        "right: overlap of 0.5 or more; mean and share that is right differ by {difference:.3} (mean over grains)"
    )
}
