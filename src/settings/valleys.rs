//! Settings of the method `valleys`.

use super::load::{SettingsError, range};
use serde::{Deserialize, Serialize};

/// How the method `valleys` tells stones apart. Lengths are in mean edge lengths of the survey, bending in 1 over the
/// mean edge length, so that one default serves meshes of any size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ValleySettings {
    /// Times that normals are smoothed, 0 to 20: more quiets noise and blurs narrow valleys.
    pub normal_passes: u32,
    /// Normals of neighbours that differ by this weigh a quarter in smoothing, as length of the difference of unit
    /// normals (0.3 is 17 degrees), 0.05 to 10: less keeps creases sharper, 10 smooths across them.
    pub crease: f64,
    /// A vertex bent downward by more than this, in 1 per mean edge length, lies in a valley, 0.01 to 0.5: less splits
    /// stones, more joins them. Sharp meshes take .07, smooth ones .04.
    pub valley_depth: f64,
    /// Bridges between stones narrower than twice this are cut, mean edge lengths, 0 to 10.
    pub bridge_edges: f64,
    /// Smallest seed of a stone, as a share of the smallest grain, 0 to 1: less finds small exposures, and more noise.
    pub seed_share: f64,
    /// How far a seed takes back what was cut off around it, mean edge lengths, 0 to 50.
    pub refill_edges: f64,
    /// How far a stone grows into the valleys around it, mean edge lengths, 0 to 50.
    pub growth_edges: f64,
    /// How much further a step in a valley counts than on level ground, per unit of bending, 0 to 100.
    pub valley_cost: f64,
    /// A core below this mean curvature times the square root of its area looks like sand, -10 to 10.
    pub sand_roundness: f64,
    /// A core bent downward by more than this in the mean, in 1 per mean edge length, looks like sand, 0 to 1.
    pub sand_bend: f64,
    /// A core whose hull is less spherical than this looks like sand, 0 to 1.
    pub sand_sphericity: f64,
    /// A core that lies further below its hull than this, as a share of the square root of its area, looks like sand,
    /// 0 to 1. What looks like sand in three of four ways is none.
    pub sand_hollow: f64,
    /// Cores are joined only if their border is longer than this share of the square root of the smaller one's area,
    /// 0 to 10; 10 joins none.
    pub join_border: f64,
    /// Nor if it is bent downward by more than this in the mean, in 1 per mean edge length, 0 to 10.
    pub join_depth: f64,
    /// And only if it lies less than this below the hull of both, mean edge lengths, 0 to 100,
    pub join_hollow_edges: f64,
    /// or less than this share of the square root of the smaller one's area, 0 to 10.
    pub join_hollow: f64,
}

impl Default for ValleySettings {
    fn default() -> Self {
        ValleySettings {
            normal_passes: 6,
            crease: 0.3,
            valley_depth: 0.07,
            bridge_edges: 1.5,
            seed_share: 0.5,
            refill_edges: 4.0,
            growth_edges: 6.0,
            valley_cost: 4.0,
            sand_roundness: 0.5,
            sand_bend: 0.01,
            sand_sphericity: 0.45,
            sand_hollow: 0.012,
            join_border: 0.3,
            join_depth: 0.2,
            join_hollow_edges: 1.5,
            join_hollow: 0.08,
        }
    }
}

impl ValleySettings {
    /// How far the steps look beyond a body, mean edge lengths: the sum of their reaches. A ring of vertices is about
    /// one edge wide.
    pub fn reach_edges(&self) -> f64 {
        f64::from(self.normal_passes + 2) + self.bridge_edges + self.refill_edges + self.growth_edges
    }

    /// Checks every value against its range.
    pub(super) fn check(&self) -> Result<(), SettingsError> {
        range("valleys.normal_passes", self.normal_passes, self.normal_passes <= 20, "must be at most 20 passes")?;
        macro_rules! within {
            ($($key:ident $low:literal $high:literal;)*) => {
                $(range(
                    concat!("valleys.", stringify!($key)),
                    self.$key,
                    ($low..=$high).contains(&self.$key),
                    concat!("must lie in ", stringify!($low), " to ", stringify!($high)),
                )?;)*
            };
        }
        within! {
            crease 0.05 10.0;
            valley_depth 0.01 0.5;
            bridge_edges 0.0 10.0;
            seed_share 0.0 1.0;
            refill_edges 0.0 50.0;
            growth_edges 0.0 50.0;
            valley_cost 0.0 100.0;
            sand_roundness -10.0 10.0;
            sand_bend 0.0 1.0;
            sand_sphericity 0.0 1.0;
            sand_hollow 0.0 1.0;
            join_border 0.0 10.0;
            join_depth 0.0 10.0;
            join_hollow_edges 0.0 100.0;
            join_hollow 0.0 10.0;
        }
        Ok(())
    }
}
