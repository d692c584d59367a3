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
    /// stones, more joins them; .05 to .07 are about as good on sharp and on smooth meshes.
    pub valley_depth: f64,
    /// Bridges between stones narrower than twice this are cut, mean edge lengths, 0 to 10.
    pub bridge_edges: f64,
    /// Smallest seed of a stone, as a share of what cutting bridges leaves of a disc of the smallest grain's area, 0.01 to 2: less
    /// finds small exposures, and more noise.
    pub seed_share: f64,
    /// How far a seed takes back what was cut off around it, mean edge lengths, 0 to 50.
    pub refill_edges: f64,
    /// How far a stone grows into the valleys around it, mean edge lengths, 0 to 50.
    pub growth_edges: f64,
    /// How much further a step in a valley counts than on level ground, per unit of bending, 0 to 100.
    pub valley_cost: f64,
    /// How much further a step counts where the surface faces straight down, as membranes do that a reconstruction spans
    /// over what no camera saw, 0 to 100; in proportion where it faces less down.
    pub overhang_cost: f64,
    /// How late sand starts to grow against stones, mean edge lengths, 0 to 50.
    pub sand_delay_edges: f64,
    /// A core that scores less is no stone, -10 to 10: sphericity of its hull (1 for a ball) plus half of its mean curvature
    /// times the square root of its area (2.5 for half a ball, 0 for a plane), less
    /// for a core that lies level and hollow.
    pub stone_score: f64,
    /// Cores are joined over gaps up to this share of the square root of the smaller one's area, 0 to 10; 0 joins none,
    pub join_reach: f64,
    /// and up to so many mean edge lengths, 0 to 50,
    pub join_reach_edges: f64,
    /// if the points of each rise over the tangent planes of the other by less than this, mean sine, 0 to 1,
    pub join_rise: f64,
    /// and if other cores reach into that hull with less than this share of the smaller one's area, 0 to 10.
    pub join_swallowed: f64,
    /// Times that normals are smoothed before a second look at what nothing claimed, 0 to 40; 0: no second look. Stones in
    /// deep gaps, which few cameras saw, are too rough for the first.
    pub second_passes: u32,
    /// `valley_depth` of the second look, 0.01 to 0.5.
    pub second_depth: f64,
    /// Smallest seed of the second look as a share of that of the first, 0.01 to 1,
    pub second_seed_share: f64,
    /// and the smallest seed of it in mean triangles, 0 to 100,000.
    pub second_seed_triangles: f64,
}

impl Default for ValleySettings {
    fn default() -> Self {
        ValleySettings {
            normal_passes: 5,
            crease: 0.2,
            valley_depth: 0.06,
            bridge_edges: 1.25,
            seed_share: 1.4,
            refill_edges: 3.0,
            growth_edges: 9.0,
            valley_cost: 3.5,
            overhang_cost: 7.0,
            sand_delay_edges: 4.0,
            stone_score: 0.6,
            join_reach: 1.65,
            join_reach_edges: 32.0,
            join_rise: 0.027,
            join_swallowed: 0.1,
            second_passes: 12,
            second_depth: 0.08,
            second_seed_share: 0.15,
            second_seed_triangles: 60.0,
        }
    }
}

impl ValleySettings {
    /// How far the steps look beyond a body, mean edge lengths: the sum of their reaches. A ring of vertices is about
    /// one edge wide.
    pub fn reach_edges(&self) -> f64 {
        let look = |passes: u32| f64::from(passes + 2) + self.bridge_edges + self.refill_edges + self.growth_edges;
        let second = if self.second_passes > 0 { look(self.second_passes) } else { 0.0 };
        look(self.normal_passes) + second + self.join_reach_edges
    }

    /// Checks every value against its range.
    pub(super) fn check(&self) -> Result<(), SettingsError> {
        range("valleys.normal_passes", self.normal_passes, self.normal_passes <= 20, "must be at most 20 passes")?;
        range("valleys.second_passes", self.second_passes, self.second_passes <= 40, "must be at most 40 passes")?;
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
            seed_share 0.01 2.0;
            refill_edges 0.0 50.0;
            growth_edges 0.0 50.0;
            valley_cost 0.0 100.0;
            overhang_cost 0.0 100.0;
            sand_delay_edges 0.0 50.0;
            stone_score -10.0 10.0;
            join_reach 0.0 10.0;
            join_reach_edges 0.0 50.0;
            join_rise 0.0 1.0;
            join_swallowed 0.0 10.0;
            second_depth 0.01 0.5;
            second_seed_share 0.01 1.0;
            second_seed_triangles 0.0 100000.0;
        }
        Ok(())
    }
}
