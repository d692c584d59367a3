//! The summary of a survey: counts, areas and grain sizes, every key with its unit.

use super::percentiles::Sizes;
use crate::index::Scale;
use crate::measure::shape;
use crate::settings::{MeasureSettings, Settings};
use crate::stitch::{Catalogue, NumberedGrain};
use serde::Serialize;
use std::f64::consts::PI;

/// Sizes of the b axis on one base.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BAxis {
    /// How it was computed.
    pub base: &'static str,
    /// 5th percentile.
    pub d5_m: Option<f64>,
    /// 16th percentile.
    pub d16_m: Option<f64>,
    /// 25th percentile.
    pub d25_m: Option<f64>,
    /// Median.
    pub d50_m: Option<f64>,
    /// 75th percentile.
    pub d75_m: Option<f64>,
    /// 84th percentile.
    pub d84_m: Option<f64>,
    /// 90th percentile.
    pub d90_m: Option<f64>,
    /// 95th percentile.
    pub d95_m: Option<f64>,
    /// Arithmetic mean.
    pub mean_m: Option<f64>,
    /// sqrt(D84/D16): 1 when all are the same.
    pub sorting_sqrt_d84_over_d16: Option<f64>,
}

/// Grain sizes are of the b axis unless the key says otherwise. Where there are no grains, values are null.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Grains.
    pub grains: u64,
    /// Bodies wider than `segment.max_grain_m`: no grains, and in no percentile.
    pub oversize_bodies: u64,
    /// Triangles of the survey.
    pub triangles: u64,
    /// Summed triangle area of the survey.
    pub surface_area_m2: f64,
    /// West-east extent of the survey's box.
    pub survey_width_m: f64,
    /// South-north extent of the survey's box.
    pub survey_height_m: f64,
    /// Area of the survey's box in plan.
    pub survey_box_area_m2: f64,
    /// Summed area of the grains' outlines in plan, which overlap where stones lean over others.
    pub grain_footprint_area_m2: f64,
    /// Area in plan under at least one outline.
    pub grain_covered_area_m2: f64,
    /// The same over the survey's box, which may hold places without survey.
    pub grain_cover_of_survey_box: Option<f64>,
    /// Smallest visible surface of a grain that was counted: all sizes are truncated there.
    pub smallest_measurable_grain_area_m2: f64,
    /// Diameter of the circle of that area.
    pub smallest_measurable_grain_diameter_m: f64,
    /// Each grain counts once.
    pub b_axis_area_by_number: BAxis,
    /// Comparable with Wolman counts and sieves.
    pub b_axis_grid_by_number: BAxis,
    /// Median of the a axis, area-by-number.
    pub a_axis_d50_area_by_number_m: Option<f64>,
    /// Median of the c axis (visible part), area-by-number.
    pub c_axis_d50_area_by_number_m: Option<f64>,
    /// Median of the convex-hull sphericity.
    pub median_hull_sphericity: Option<f64>,
    /// Share of grains with any flag.
    pub share_flagged: Option<f64>,
    /// Share of grains that touch an edge of the mesh.
    pub share_touching_edge: Option<f64>,
    /// Share of grains of fewer triangles than `measure.few_triangles`.
    pub share_few_triangles: Option<f64>,
    /// Share of grains whose attitude is not defined, by `measure.equant_ratio`.
    pub share_near_equant: Option<f64>,
}

/// Areas that the catalogue does not tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Areas {
    /// The limit that was held against the grains, m².
    pub smallest_grain_m2: f64,
    /// In plan under at least one outline, m².
    pub covered_m2: f64,
}

impl Summary {
    /// The summary of a catalogue.
    pub fn new(catalogue: &Catalogue, settings: &Settings, scale: &Scale, areas: &Areas) -> Summary {
        let grains = &catalogue.grains;
        let sizes = |axis: usize| Sizes::new(grains.iter().map(|g| g.grain.axes_m[axis]));
        let b = sizes(1);
        let sphericity = Sizes::new(
            grains.iter().filter_map(|g| shape::hull_sphericity(g.grain.hull_volume_m3, g.grain.hull_area_m2)),
        );
        let share = |flagged: &dyn Fn(&NumberedGrain) -> bool| {
            (!grains.is_empty()).then(|| grains.iter().filter(|g| flagged(g)).count() as f64 / grains.len() as f64)
        };
        let m = &settings.measure;
        let equant = |g: &NumberedGrain| near_equant(g.grain.axes_m, m) != (false, false);
        let few = |g: &NumberedGrain| g.grain.triangles < m.few_triangles;
        let footprint = grains.iter().map(|g| g.grain.footprint_area_m2).fold(0.0, |sum, area| sum + area);
        let size = scale.max - scale.min;
        let box_area = size.x * size.y;
        Summary {
            grains: grains.len() as u64,
            oversize_bodies: catalogue.oversize.len() as u64,
            triangles: scale.triangles,
            surface_area_m2: scale.surface_area_m2,
            survey_width_m: size.x,
            survey_height_m: size.y,
            survey_box_area_m2: box_area,
            grain_footprint_area_m2: footprint,
            grain_covered_area_m2: areas.covered_m2,
            grain_cover_of_survey_box: Some(areas.covered_m2 / box_area).filter(|c| c.is_finite()),
            smallest_measurable_grain_area_m2: areas.smallest_grain_m2,
            smallest_measurable_grain_diameter_m: 2.0 * (areas.smallest_grain_m2 / PI).sqrt(),
            b_axis_area_by_number: BAxis::new(
                "area-by-number: each grain counts once, linear interpolation (type 7)",
                |p| b.area_by_number(p),
                b.area_by_number_mean(),
            ),
            b_axis_grid_by_number: BAxis::new(
                "grid-by-number: each grain weighs b² (Kellerhals & Bray 1971), midpoint rule",
                |p| b.grid_by_number(p),
                b.grid_by_number_mean(),
            ),
            a_axis_d50_area_by_number_m: sizes(0).area_by_number(50.0),
            c_axis_d50_area_by_number_m: sizes(2).area_by_number(50.0),
            median_hull_sphericity: sphericity.area_by_number(50.0),
            share_flagged: share(&|g| g.grain.touches_edge || few(g) || equant(g)),
            share_touching_edge: share(&|g| g.grain.touches_edge),
            share_few_triangles: share(&few),
            share_near_equant: share(&equant),
        }
    }
}

impl BAxis {
    fn new(base: &'static str, percentile: impl Fn(f64) -> Option<f64>, mean_m: Option<f64>) -> BAxis {
        let (d16_m, d84_m) = (percentile(16.0), percentile(84.0));
        BAxis {
            base,
            d5_m: percentile(5.0),
            d16_m,
            d25_m: percentile(25.0),
            d50_m: percentile(50.0),
            d75_m: percentile(75.0),
            d84_m,
            d90_m: percentile(90.0),
            d95_m: percentile(95.0),
            mean_m,
            sorting_sqrt_d84_over_d16: d84_m.zip(d16_m).map(|(d84, d16)| (d84 / d16).sqrt()).filter(|s| s.is_finite()),
        }
    }
}

/// Whether a/b and b/c lie below `measure.equant_ratio`. Where a and b are near equal the direction of a
/// (yaw, trend, plunge) is noise; where b and c are, the roll and the a-b plane (dip) are.
pub fn near_equant([a, b, c]: [f64; 3], settings: &MeasureSettings) -> (bool, bool) {
    let below = |over: f64, under: f64| under > 0.0 && over / under < settings.equant_ratio;
    (below(a, b), below(b, c))
}
