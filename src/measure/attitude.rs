//! Attitude of a stone: how its axes lie in space, in the words of geologists and of robotics.
//!
//! Input are the unit vectors of the axes a, b, c in the local frame (x east, y north, z up): right-handed,
//! c upward, a eastward (see [`crate::measure::Grain::directions`]). North is grid north.
//!
//! * **Yaw, pitch, roll**: R, the matrix whose COLUMNS are a, b, c, turns a stone that lies with a east,
//!   b north and c up into its place, and `R = Rz(yaw) Ry(pitch) Rx(roll)` (Tait-Bryan ZYX, active, angles
//!   counter-clockwise about the positive axis). Yaw is counted from east towards north. Pitch is positive
//!   when a points DOWN. By the sign rule of the axes yaw and roll lie in -90 to 90.
//! * **Trend and plunge** of a: azimuth, clockwise from north, of the end that points down, and its angle
//!   below the horizon, 0 to 90. A horizontal a has two ends: the trend in 0 to 180 is given.
//! * **Dip and dip direction** of the a-b plane: its steepest angle, 0 to 90, and the azimuth of steepest
//!   descent, clockwise from north. A pebble imbricated in a current dips upstream.
//!
//! Worked example: a flat pebble, horizontal, with its long axis at azimuth 30 has a = (0.5, 0.866, 0),
//! b = (-0.866, 0.5, 0), c = (0, 0, 1): yaw 60, pitch 0, roll 0, trend 30, plunge 0, dip 0, no dip
//! direction. Tilted so that a points 20 degrees down at azimuth 30: pitch 20, plunge 20, dip 20 towards 30.
//!
//! The program published with Rheinwalt et al. (2025) has the axes as ROWS in the same formulas, which
//! gives the angles of the inverse rotation (yaw -60 or 120 in the first example): its three
//! angles cannot be compared with these, its axes can.

use crate::geometry::DVec3;

/// Below this horizontal part of a unit vector (0.2 arc seconds) its azimuth is noise.
const VERTICAL: f64 = 1e-6;

/// Attitude of one stone, degrees; conventions in the module's text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Rotation about the vertical, east towards north, -180 to 180.
    pub yaw_deg: f64,
    /// Rotation about the turned north axis, -90 to 90, positive with a downward.
    pub pitch_deg: f64,
    /// Rotation about a, -180 to 180. 0 where a is vertical, since only yaw and roll together are defined.
    pub roll_deg: f64,
    /// Azimuth of the lower end of a, 0 to 360; none where a is vertical.
    pub a_trend_deg: Option<f64>,
    /// Angle of a below the horizon, 0 to 90.
    pub a_plunge_deg: f64,
    /// Dip of the a-b plane, 0 to 90.
    pub ab_dip_deg: f64,
    /// Azimuth of steepest descent of the a-b plane, 0 to 360; none where the plane is level.
    pub ab_dip_direction_deg: Option<f64>,
}

impl Attitude {
    /// The attitude of unit axes a, b, c.
    pub fn of([a, b, c]: [DVec3; 3]) -> Attitude {
        let level = a.x.hypot(a.y);
        let (yaw, roll) = if level < VERTICAL { ((-b.x).atan2(b.y), 0.0) } else { (a.y.atan2(a.x), b.z.atan2(c.z)) };
        let down = if a.z > 0.0 { -a } else { a };
        let trend = azimuth_deg(down).map(|t| if a.z == 0.0 && t >= 180.0 { t - 180.0 } else { t });
        let up = if c.z < 0.0 { -c } else { c };
        Attitude {
            yaw_deg: degrees(yaw),
            pitch_deg: degrees((-a.z).atan2(level)),
            roll_deg: degrees(roll),
            a_trend_deg: trend,
            a_plunge_deg: degrees((-down.z).atan2(level)),
            ab_dip_deg: degrees(up.x.hypot(up.y).atan2(up.z)),
            ab_dip_direction_deg: azimuth_deg(up),
        }
    }
}

/// Degrees, and 0 for -0.
fn degrees(radians: f64) -> f64 {
    radians.to_degrees() + 0.0
}

/// Clockwise from north, 0 up to but not 360; none for a vertical vector.
fn azimuth_deg(v: DVec3) -> Option<f64> {
    if v.x.hypot(v.y) < VERTICAL {
        return None;
    }
    let azimuth = v.x.atan2(v.y).to_degrees().rem_euclid(360.0);
    Some(if azimuth >= 360.0 { 0.0 } else { azimuth + 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    fn near(value: f64, expected: f64) {
        assert!((value - expected).abs() < 1e-9, "{value} is not {expected}");
    }

    /// Axes of a stone whose a plunges at an azimuth, turned about a by `spin` degrees.
    fn stone(trend: f64, plunge: f64, spin: f64) -> [DVec3; 3] {
        let (t, p, s) = (trend.to_radians(), plunge.to_radians(), spin.to_radians());
        let a = DVec3::new(t.sin() * p.cos(), t.cos() * p.cos(), -p.sin());
        let level_b = DVec3::new(-t.cos(), t.sin(), 0.0);
        let mut b = level_b * s.cos() + a.cross(level_b) * s.sin();
        let (mut a, mut c) = (a, a.cross(b));
        if c.z < 0.0 {
            (b, c) = (-b, -c);
        }
        if a.x < 0.0 {
            (a, b) = (-a, -b);
        }
        [a, b, c]
    }

    #[test]
    fn a_level_pebble_at_azimuth_30_has_yaw_60_and_no_dip_direction() {
        let at = Attitude::of(stone(30.0, 0.0, 0.0));
        near(at.yaw_deg, 60.0);
        near(at.pitch_deg, 0.0);
        near(at.roll_deg, 0.0);
        near(at.a_trend_deg.expect("level a"), 30.0);
        near(at.a_plunge_deg, 0.0);
        near(at.ab_dip_deg, 0.0);
        assert_eq!(at.ab_dip_direction_deg, None);
    }

    #[test]
    fn a_pebble_that_dips_along_its_long_axis_dips_where_it_plunges() {
        let at = Attitude::of(stone(30.0, 20.0, 0.0));
        near(at.pitch_deg, 20.0);
        near(at.a_trend_deg.expect("not vertical"), 30.0);
        near(at.a_plunge_deg, 20.0);
        near(at.ab_dip_deg, 20.0);
        near(at.ab_dip_direction_deg.expect("not level"), 30.0);
    }

    #[test]
    fn the_lower_end_of_a_westward_pebble_is_named_although_a_points_east() {
        let axes = stone(250.0, 35.0, 0.0);
        assert!(axes[0].x > 0.0);
        let at = Attitude::of(axes);
        near(at.a_trend_deg.expect("not vertical"), 250.0);
        near(at.a_plunge_deg, 35.0);
        near(at.pitch_deg, -35.0);
    }

    #[test]
    fn a_pebble_turned_about_a_level_long_axis_dips_sideways() {
        let at = Attitude::of(stone(90.0, 0.0, 25.0));
        near(at.yaw_deg, 0.0);
        near(at.roll_deg, 25.0);
        near(at.ab_dip_deg, 25.0);
        near(at.ab_dip_direction_deg.expect("not level"), 180.0);
    }

    #[test]
    fn the_three_angles_rebuild_the_rotation() {
        for trend in (0..360).step_by(17) {
            for plunge in [0.0, 3.0, 45.0, 89.0] {
                for spin in [-80.0, -10.0, 0.0, 33.0, 90.0] {
                    let [a, b, c] = stone(f64::from(trend), plunge, spin);
                    let at = Attitude::of([a, b, c]);
                    let rebuilt = DMat3::from_rotation_z(at.yaw_deg.to_radians())
                        * DMat3::from_rotation_y(at.pitch_deg.to_radians())
                        * DMat3::from_rotation_x(at.roll_deg.to_radians());
                    assert!(rebuilt.abs_diff_eq(DMat3::from_cols(a, b, c), 1e-12), "{trend} {plunge} {spin}");
                }
            }
        }
    }

    #[test]
    fn a_vertical_long_axis_has_no_trend_but_a_rotation() {
        let [a, b, c] = [-DVec3::Z, DVec3::new(-0.6, 0.8, 0.0), DVec3::new(0.8, 0.6, 0.0)];
        let at = Attitude::of([a, b, c]);
        assert_eq!(at.a_trend_deg, None);
        near(at.a_plunge_deg, 90.0);
        let rebuilt =
            DMat3::from_rotation_z(at.yaw_deg.to_radians()) * DMat3::from_rotation_y(at.pitch_deg.to_radians());
        assert!(rebuilt.abs_diff_eq(DMat3::from_cols(a, b, c), 1e-12));
    }
}
