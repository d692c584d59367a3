//! The table of grain attributes: one list of columns for the CSV, the GeoPackage and the documentation.

use crate::measure::Grain;
use crate::measure::attitude::Attitude;
use crate::measure::confidence::confidence;
use crate::measure::shape::{self, SneedFolk, Zingg};
use crate::open::Frame;
use crate::settings::Settings;
use crate::statistics::near_equant;
use crate::stitch::NumberedGrain;
use serde::Serialize;
use std::borrow::Cow;

/// Type of a column's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// 64-bit integer.
    Integer,
    /// 64-bit float, 10 significant digits; positions in map units with 6 decimals.
    Real,
    /// Text.
    Text,
    /// True or false.
    Boolean,
}

/// One value of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// No value: NULL, or an empty field.
    Null,
    /// Integer.
    Integer(i64),
    /// Real number.
    Real(f64),
    /// Coordinate in map units.
    Position(f64),
    /// Text.
    Text(Cow<'static, str>),
    /// Truth.
    Boolean(bool),
}

impl Value {
    /// A real number, rounded to 10 significant digits; NULL where it is not finite.
    pub fn real(value: f64) -> Value {
        if !value.is_finite() {
            return Value::Null;
        }
        // The text of a rounded number always parses, and -0 becomes 0.
        Value::Real(format!("{value:.9e}").parse::<f64>().map_or(value, |v| v + 0.0))
    }

    /// [`Value::real`], NULL for none.
    pub fn maybe(value: Option<f64>) -> Value {
        value.map_or(Value::Null, Value::real)
    }

    /// Text of the value in a CSV: empty for NULL.
    pub fn csv_text(&self) -> Cow<'_, str> {
        match self {
            Value::Null => Cow::Borrowed(""),
            Value::Integer(i) => Cow::Owned(i.to_string()),
            Value::Real(r) => Cow::Owned(r.to_string()),
            Value::Position(p) => Cow::Owned(format!("{p:.6}")),
            Value::Text(t) => Cow::Borrowed(t),
            Value::Boolean(true) => Cow::Borrowed("true"),
            Value::Boolean(false) => Cow::Borrowed("false"),
        }
    }
}

/// A grain with everything that its columns derive from.
pub struct Row<'a> {
    numbered: &'a NumberedGrain,
    grain: &'a Grain,
    settings: &'a Settings,
    position: [f64; 3],
    attitude: Attitude,
}

impl<'a> Row<'a> {
    /// The row of a grain.
    pub fn new(numbered: &'a NumberedGrain, frame: &Frame, settings: &'a Settings) -> Row<'a> {
        let grain = &numbered.grain;
        let position = frame.position(grain.centroid);
        Row { numbered, grain, settings, position, attitude: Attitude::of(grain.directions) }
    }
}

/// One column of the table.
#[derive(Clone, Copy, Serialize)]
pub struct Column {
    /// Name, with its unit.
    pub name: &'static str,
    /// Type.
    #[serde(rename = "type")]
    pub kind: Kind,
    /// Meaning, in one line.
    pub description: &'static str,
    /// The column's value in a row.
    #[serde(skip)]
    pub value: fn(&Row) -> Value,
}

macro_rules! columns {
    ($($name:literal $kind:ident $description:literal $value:expr;)*) => {
        &[$(Column { name: $name, kind: Kind::$kind, description: $description, value: $value }),*]
    };
}

/// All columns, in the order in which they are written.
pub const COLUMNS: &[Column] = columns! {
    "grain_id" Integer "number of the grain, from 1, in the order of the lowest triangle of each" |r| whole(r.numbered.grain_id);
    "segment_color" Integer "small number that differs from that of every touching grain" |r| Value::Integer(i64::from(r.numbered.segment_color));
    "centroid_x" Real "east coordinate of the area-weighted centroid of the visible surface, map units" |r| Value::Position(r.position[0]);
    "centroid_y" Real "north coordinate of the same, map units" |r| Value::Position(r.position[1]);
    "centroid_z" Real "height of the same, map units" |r| Value::Position(r.position[2]);
    "a_axis_m" Real "long axis: extent along the first principal axis of the vertices" |r| Value::real(r.grain.axes_m[0]);
    "b_axis_m" Real "intermediate axis, the grain size of sieves and Wolman counts" |r| Value::real(r.grain.axes_m[1]);
    "c_axis_m" Real "short extent of the visible part: too short where the lower half is buried, too long where a tilted flank is all that shows" |r| Value::real(r.grain.axes_m[2]);
    "ellipsoid_a_axis_m" Real "long axis of the least-squares ellipsoid; none where no ellipsoid fits, or only one that is far longer than what is seen" |r| Value::maybe(r.grain.ellipsoid_axes_m.map(|e| e[0]));
    "ellipsoid_b_axis_m" Real "intermediate axis of the same" |r| Value::maybe(r.grain.ellipsoid_axes_m.map(|e| e[1]));
    "ellipsoid_c_axis_m" Real "short axis of the same" |r| Value::maybe(r.grain.ellipsoid_axes_m.map(|e| e[2]));
    "a_fit_m" Real "long axis of the completed stone: a rounded body fitted to the visible part, and to the usual shape of stones; none where too little is seen" |r| Value::maybe(r.grain.completed.map(|c| c.axes_m[0]));
    "b_fit_m" Real "intermediate axis of the completed stone" |r| Value::maybe(r.grain.completed.map(|c| c.axes_m[1]));
    "c_fit_m" Real "short axis of the completed stone, with what is buried; may be below c_axis_m, where a tilted flank is all that shows" |r| Value::maybe(r.grain.completed.map(|c| c.axes_m[2]));
    "c_fit_error_m" Real "standard deviation of c_fit_m as the fit states it" |r| Value::maybe(r.grain.completed.map(|c| c.c_error_m));
    "seen_share" Real "share of the completed stone's surface that is visible, 0 to 1" |r| Value::maybe(r.grain.completed.map(|c| c.seen_share));
    "c_fit_from_prior" Boolean "c_fit_m rests more on measure.prior_c_over_b than on the surface" |r| r.grain.completed.map_or(Value::Null, |c| Value::Boolean(c.c_from_prior));
    "yaw_deg" Real "ZYX Tait-Bryan angle about the vertical that turns east-north-up into a-b-c, east towards north" |r| Value::real(r.attitude.yaw_deg);
    "pitch_deg" Real "second angle of the same, positive with a downward" |r| Value::real(r.attitude.pitch_deg);
    "roll_deg" Real "third angle of the same, about a" |r| Value::real(r.attitude.roll_deg);
    "a_trend_deg" Real "azimuth of the lower end of a, clockwise from grid north; none where a is vertical, arbitrary where near_equant_ab" |r| Value::maybe(r.attitude.a_trend_deg);
    "a_plunge_deg" Real "angle of a below the horizon, 0 to 90" |r| Value::real(r.attitude.a_plunge_deg);
    "ab_dip_deg" Real "dip of the a-b plane from the horizontal, 0 to 90" |r| Value::real(r.attitude.ab_dip_deg);
    "ab_dip_direction_deg" Real "azimuth of steepest descent of the a-b plane, clockwise from grid north; none where it is level, arbitrary where near_equant_bc" |r| Value::maybe(r.attitude.ab_dip_direction_deg);
    "red_mean" Real "mean of the vertices' red, 0 to 1; none where the mesh has no colours" |r| color(r.grain.color_mean, 0);
    "green_mean" Real "mean green" |r| color(r.grain.color_mean, 1);
    "blue_mean" Real "mean blue" |r| color(r.grain.color_mean, 2);
    "red_std" Real "population standard deviation of red" |r| color(r.grain.color_std, 0);
    "green_std" Real "the same of green" |r| color(r.grain.color_std, 1);
    "blue_std" Real "the same of blue" |r| color(r.grain.color_std, 2);
    "surface_area_m2" Real "visible surface: summed area of the triangles" |r| Value::real(r.grain.surface_area_m2);
    "hull_area_m2" Real "area of the convex hull of the visible part" |r| Value::real(r.grain.hull_area_m2);
    "hull_volume_m3" Real "volume of the convex hull of the visible part" |r| Value::real(r.grain.hull_volume_m3);
    "hull_sphericity" Real "Wadell sphericity of the hull, pi^(1/3) (6V)^(2/3) / A; raises confidence" |r| Value::maybe(shape::hull_sphericity(r.grain.hull_volume_m3, r.grain.hull_area_m2));
    "b_over_a" Real "b/a" |r| Value::maybe(shape::b_over_a(r.grain.axes_m));
    "c_over_b" Real "c/b" |r| Value::maybe(shape::c_over_b(r.grain.axes_m));
    "zingg_class" Text "Zingg (1935), split at 2/3: spheroid, disc, rod, blade" |r| text(Zingg::of(r.grain.axes_m).map(Zingg::name));
    "sneed_folk_class" Text "Sneed & Folk (1958): C compact; CP CB CE; P platy, B bladed, E elongate; VP VB VE very" |r| text(SneedFolk::of(r.grain.axes_m).map(SneedFolk::code));
    "corey_shape" Real "Corey shape factor c/sqrt(ab)" |r| Value::maybe(shape::corey(r.grain.axes_m));
    "krumbein_sphericity" Real "Krumbein (1941) intercept sphericity (bc/a^2)^(1/3)" |r| Value::maybe(shape::krumbein(r.grain.axes_m));
    "max_projection_sphericity" Real "Sneed & Folk (1958) maximum-projection sphericity (c^2/(ab))^(1/3)" |r| Value::maybe(shape::max_projection(r.grain.axes_m));
    "sieve_diameter_m" Real "square sieve hole that the stone just passes, b sqrt((1+(c/b)^2)/2), of the visible axes" |r| Value::maybe(shape::sieve_diameter_m(r.grain.axes_m));
    "footprint_area_m2" Real "area of the outline in plan" |r| Value::real(r.grain.footprint_area_m2);
    "exposed_share" Real "visible surface over the surface of the ellipsoid with the visible axes a, b, c; seen_share is the same of the completed stone" |r| Value::maybe(shape::exposed_share(r.grain.surface_area_m2, r.grain.axes_m));
    "confidence" Real "chance that the grain and one stone overlap by half or more of their joint visible surface, 0 to 1; says nothing about what is hidden or beyond an edge; none for rheinwalt2025" |r| Value::maybe(confidence(r.grain));
    "patches" Integer "visible patches that were joined to this grain; not used by confidence; none for rheinwalt2025" |r| r.grain.evidence.map_or(Value::Null, |e| Value::Integer(i64::from(e.patches)));
    "border_bend" Real "mean bending along its border, in 1 over the mean edge length: far below 0 where valleys surround it; not used by confidence" |r| Value::maybe(r.grain.evidence.map(|e| e.rim_bend));
    "free_border_share" Real "share of its border that no other stone, nor sand, has grown to: nobody's ground; 0 to 1, lowers confidence" |r| Value::maybe(r.grain.evidence.map(|e| e.free_rim));
    "bulge" Real "mean curvature times the square root of the area: 2.5 for half a ball, 0 for a plane, below 0 for a hollow; not used by confidence" |r| Value::maybe(r.grain.evidence.map(|e| e.bulge));
    "core_share" Real "share of its area that lies away from valleys, 0 to 1; raises confidence" |r| Value::maybe(r.grain.evidence.map(|e| e.core_share));
    "triangles" Integer "number of triangles; more of them raise confidence" |r| whole(r.grain.triangles);
    "touches_edge" Boolean "an edge of the mesh (survey border, hole, scan shadow) bounds the grain: what lies beyond is in none of its sizes" |r| Value::Boolean(r.grain.touches_edge);
    "few_triangles" Boolean "fewer triangles than measure.few_triangles: sizes are coarse" |r| Value::Boolean(r.grain.triangles < r.settings.measure.few_triangles);
    "near_equant_ab" Boolean "a/b below measure.equant_ratio: yaw, pitch, roll, trend and plunge are given but undefined" |r| Value::Boolean(near_equant(r.grain.axes_m, &r.settings.measure).0);
    "near_equant_bc" Boolean "b/c below measure.equant_ratio: roll, dip and dip direction are given but undefined" |r| Value::Boolean(near_equant(r.grain.axes_m, &r.settings.measure).1);
};

fn whole(value: u64) -> Value {
    i64::try_from(value).map_or(Value::Null, Value::Integer)
}

fn color(channels: Option<[f64; 3]>, channel: usize) -> Value {
    Value::maybe(channels.map(|c| c[channel]))
}

fn text(name: Option<&'static str>) -> Value {
    name.map_or(Value::Null, |n| Value::Text(Cow::Borrowed(n)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reals_keep_ten_significant_digits_and_no_sign_of_zero() {
        assert_eq!(Value::real(0.012_345_678_912_345).csv_text(), "0.01234567891");
        assert_eq!(Value::real(-0.0).csv_text(), "0");
        assert_eq!(Value::real(f64::NAN), Value::Null);
        assert_eq!(Value::real(1.0 / 3.0).csv_text(), "0.3333333333");
        assert_eq!(Value::Position(1_480_000.5).csv_text(), "1480000.500000");
    }

    #[test]
    fn no_two_columns_share_a_name() {
        let mut names: Vec<&str> = COLUMNS.iter().map(|c| c.name).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|w| w[0] != w[1]));
    }
}
