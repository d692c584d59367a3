//! Settings that suit a survey, from its mean edge alone.
//!
//! A grain needs some 50 triangles to have axes, so the mesh decides what can be seen; and the closer a
//! camera was, the smaller the grains that it was meant for. Without colours and at 10 mm or more a mesh is
//! most likely made from a laser scan.

use super::SurfaceFigures;
use crate::settings::{PRESETS, SegmentSettings, Settings, ValleySettings};
use serde::Serialize;
use std::f64::consts::PI;

/// Where a preset is meant for meshes that are coarser, the smallest grain is a disc so many edges wide,
const GRAIN_EDGES: f64 = 10.0;
/// but no less than the smallest of the published method, m².
const PUBLISHED_M2: f64 = 1e-4;
/// Triangles that the smallest measurable grain needs.
const SMALLEST_GRAIN_TRIANGLES: f64 = 50.0;

/// A settings file under `configs/`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Mean edge below 1 mm.
    Sandbox,
    /// Mean edge below 5 mm.
    Mast,
    /// Anything coarser.
    Drone,
    /// Mean edge of 10 mm or more, and no colours.
    LaserScan,
}

impl Preset {
    fn of(mean_edge_m: f64, has_colors: bool) -> Preset {
        if mean_edge_m >= 0.010 && !has_colors {
            Preset::LaserScan
        } else if mean_edge_m < 0.001 {
            Preset::Sandbox
        } else if mean_edge_m < 0.005 {
            Preset::Mast
        } else {
            Preset::Drone
        }
    }

    /// The file's name without its end, as in `configs/laser-scan.toml`.
    pub fn name(self) -> &'static str {
        match self {
            Preset::Sandbox => "sandbox",
            Preset::Mast => "mast",
            Preset::Drone => "drone",
            Preset::LaserScan => "laser-scan",
        }
    }

    /// What the preset takes for a grain.
    fn limits(self) -> SegmentSettings {
        // Not by name: a file may have that name.
        let preset = PRESETS.iter().find(|(name, _)| *name == self.name());
        let settings: Option<Settings> = preset.and_then(|(_, text)| toml::from_str(text).ok());
        settings.unwrap_or_default().segment
    }
}

/// What a survey can show, and settings for it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Suggestion {
    /// Visible surface of the smallest measurable grain, m²: 50 mean triangles.
    pub smallest_grain_area_m2: f64,
    /// Diameter of the circle of that area, metres.
    pub smallest_grain_diameter_m: f64,
    /// The settings file that suits.
    pub preset: Preset,
    /// For `--min-grain-area`, m²: that of the preset, or a disc of ten edges (but at least 1e-4) where the mesh is finer than the preset
    /// is meant for; never less than the above, rounded up to two digits.
    pub min_grain_area_m2: f64,
    /// For `--max-grain`, metres.
    pub max_grain_m: f64,
    /// Whether the mean edge is above 30 mm, so that only boulders can be told apart.
    pub coarse: bool,
    /// What the lengths of the default method come to.
    pub lengths: ValleyLengths,
}

/// What the settings of `[valleys]`, which are multiples of the mean edge, come to in a survey.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ValleyLengths {
    /// Radius of the bluntest bend that is a valley, metres.
    pub bluntest_valley_m: f64,
    /// Width of the widest bridge between stones that is cut, metres.
    pub widest_bridge_m: f64,
    /// Width over which normals are smoothed, metres: what is finer is taken for noise.
    pub smoothed_m: f64,
    /// The same for the second look, at what nothing claimed, metres.
    pub smoothed_again_m: f64,
    /// How far stones grow into the valleys around them, metres.
    pub growth_m: f64,
    /// Widest gap between patches of one stone, metres.
    pub widest_gap_m: f64,
}

impl ValleyLengths {
    fn new(mean_edge_m: f64) -> ValleyLengths {
        let v = ValleySettings::default();
        // Each pass is a step of about one edge to a random side.
        let smoothed_m = |passes: u32| 2.0 * f64::from(passes).sqrt() * mean_edge_m;
        ValleyLengths {
            bluntest_valley_m: mean_edge_m / v.valley_depth,
            widest_bridge_m: 2.0 * v.bridge_edges * mean_edge_m,
            smoothed_m: smoothed_m(v.normal_passes),
            smoothed_again_m: smoothed_m(v.second_passes),
            growth_m: v.growth_edges * mean_edge_m,
            widest_gap_m: v.join_reach_edges * mean_edge_m,
        }
    }
}

impl Suggestion {
    /// The suggestion for a surface.
    pub fn new(surface: &SurfaceFigures, has_colors: bool) -> Suggestion {
        let area = SMALLEST_GRAIN_TRIANGLES * surface.mean_triangle_area_m2;
        let preset = Preset::of(surface.mean_edge_m, has_colors);
        let limits = preset.limits();
        let fine_m2 = round_up(PI / 4.0 * (GRAIN_EDGES * surface.mean_edge_m).powi(2)).max(PUBLISHED_M2);
        Suggestion {
            smallest_grain_area_m2: area,
            smallest_grain_diameter_m: (4.0 * area / PI).sqrt(),
            preset,
            min_grain_area_m2: limits.min_grain_area_m2.min(fine_m2).max(round_up(area)),
            max_grain_m: limits.max_grain_m,
            coarse: surface.mean_edge_m > 0.030,
            lengths: ValleyLengths::new(surface.mean_edge_m),
        }
    }
}

/// The next number of two digits that is not lower; 0 for 0.
fn round_up(value: f64) -> f64 {
    if value <= 0.0 || !value.is_finite() {
        return 0.0;
    }
    let exponent = value.log10().floor() as i32 - 1;
    // Through text, so that 1.3e-5 is the number of that name and not 13 times a rounded power.
    let digits = (value / 10f64.powi(exponent) - 1e-9).ceil();
    format!("{digits}e{exponent}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_are_rounded_up_to_two_digits() {
        assert_eq!(round_up(1.21e-5), 1.3e-5);
        assert_eq!(round_up(4e-5), 4e-5);
        assert_eq!(round_up(9.95e-3), 1e-2);
        assert_eq!(round_up(0.0), 0.0);
    }

    #[test]
    fn the_smallest_grain_is_that_of_the_preset_or_of_the_mesh() {
        let limits = [Preset::Sandbox, Preset::Mast, Preset::Drone, Preset::LaserScan].map(Preset::limits);
        let default = SegmentSettings::default();
        assert_eq!(limits[2].min_grain_area_m2, 5e-3);
        assert!(limits.iter().all(|l| l.max_grain_m != default.max_grain_m), "{limits:?}");
        let suggested = |mean_edge_m: f64| {
            let mean_triangle_area_m2 = 0.4 * mean_edge_m * mean_edge_m;
            let surface = SurfaceFigures { mean_edge_m, mean_triangle_area_m2, ..SurfaceFigures::default() };
            Suggestion::new(&surface, true).min_grain_area_m2
        };
        assert_eq!(suggested(0.0007), limits[0].min_grain_area_m2);
        // A mesh just too coarse for a preset is not asked for grains ten times as large.
        assert_eq!([0.00105, 0.002, 0.004, 0.006].map(suggested), [1e-4, 3.2e-4, limits[1].min_grain_area_m2, 2.9e-3]);
        assert_eq!(suggested(0.012), limits[2].min_grain_area_m2);
        assert_eq!(suggested(0.04), 0.032);
    }

    #[test]
    fn the_mean_edge_chooses_the_preset() {
        assert_eq!(Preset::of(0.0004, true), Preset::Sandbox);
        assert_eq!(Preset::of(0.002, false), Preset::Mast);
        assert_eq!(Preset::of(0.02, true), Preset::Drone);
        assert_eq!(Preset::of(0.0167, false), Preset::LaserScan);
        assert_eq!(Preset::of(0.008, false), Preset::Drone);
    }
}
