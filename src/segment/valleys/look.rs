//! How the ground is looked at.

use crate::index::Scale;
use crate::settings::ValleySettings;
use std::f64::consts::PI;

/// How the ground is looked at: by the first look and by the second with other numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Times that normals are smoothed.
    pub normal_passes: u32,
    /// Normals of neighbours that differ by so much weigh a quarter.
    pub crease: f64,
    /// What bends downward by more is a valley, 1 over the mean edge length.
    pub valley_depth: f64,
    /// Bridges narrower than twice this are cut, mean edge lengths.
    pub bridge_edges: f64,
    /// How far a seed takes back what lies around it, mean edge lengths.
    pub refill_edges: f64,
    /// The smallest seed, m².
    pub seed_area_m2: f64,
    /// Cores that score less are no stones.
    pub stone_score: f64,
}

/// What lies on both sides of a crease is smoothed together: on rough ground most creases are noise.
const NO_CREASES: f64 = 10.0;

impl Look {
    /// The first look, at everything.
    pub fn first(settings: &ValleySettings, smallest_grain_m2: f64, scale: &Scale) -> Look {
        Look {
            normal_passes: settings.normal_passes,
            crease: settings.crease,
            valley_depth: settings.valley_depth,
            bridge_edges: settings.bridge_edges,
            refill_edges: settings.refill_edges,
            seed_area_m2: settings.seed_share * inner_m2(smallest_grain_m2, settings.bridge_edges * scale.mean_edge_m),
            stone_score: settings.stone_score,
        }
    }

    /// The second look, at what the first left over; none if none is asked for.
    pub fn second(settings: &ValleySettings, smallest_grain_m2: f64, scale: &Scale) -> Option<Look> {
        let smallest_seed_m2 = settings.second_seed_triangles * scale.mean_triangle_area_m2;
        let first = Look::first(settings, smallest_grain_m2, scale);
        (settings.second_passes > 0).then(|| Look {
            normal_passes: settings.second_passes,
            crease: NO_CREASES,
            valley_depth: settings.second_depth,
            seed_area_m2: smallest_seed_m2.max(settings.second_seed_share * first.seed_area_m2),
            ..first
        })
    }
}

/// What is left of a disc of an area once a rim is taken off, m²; of one that is hardly wider than its rim a sixteenth.
fn inner_m2(area_m2: f64, rim_m: f64) -> f64 {
    let radius_m = (area_m2 / PI).sqrt();
    PI * (radius_m - rim_m).max(0.25 * radius_m).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;

    #[test]
    fn seeds_are_smaller_where_the_smallest_grain_is_few_edges_wide() {
        let scale = |mean_edge_m: f64| Scale {
            vertices: 0,
            triangles: 0,
            min: DVec3::ZERO,
            max: DVec3::ZERO,
            surface_area_m2: 0.0,
            mean_triangle_area_m2: 0.43 * mean_edge_m * mean_edge_m,
            mean_edge_m,
            spacing_m: 0.0,
            zero_area_triangles: 0,
        };
        let settings = ValleySettings { seed_share: 1.0, bridge_edges: 1.25, ..ValleySettings::default() };
        let share = |mean_edge_m: f64| Look::first(&settings, PI, &scale(mean_edge_m)).seed_area_m2 / PI;
        assert!((share(0.08) - 0.81).abs() < 1e-12, "a rim of a tenth: {}", share(0.08));
        assert!((share(0.4) - 0.25).abs() < 1e-12, "a rim of a half: {}", share(0.4));
        assert_eq!(share(3.0), 1.0 / 16.0);
        let second = |mean_edge_m: f64| Look::second(&settings, PI, &scale(mean_edge_m)).map(|look| look.seed_area_m2);
        assert!(
            second(0.01)
                .is_some_and(|area_m2| (area_m2 / PI - 0.9875f64.powi(2) * settings.second_seed_share).abs() < 1e-12)
        );
        assert!(second(1.0).is_some_and(|area_m2| (area_m2 - 0.43 * settings.second_seed_triangles).abs() < 1e-12));
        assert_eq!(Look::second(&ValleySettings { second_passes: 0, ..settings }, PI, &scale(0.01)), None);
    }
}
