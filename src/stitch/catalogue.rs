//! The catalogue of a survey: every grain once, numbered and coloured.

use crate::geometry::PlanBox;
use crate::measure::Grain;
use serde::{Deserialize, Serialize};

/// A grain with its number and map colour.
#[derive(Debug, Clone, PartialEq)]
pub struct NumberedGrain {
    /// 1, 2, 3, ... in the order of the anchors.
    pub grain_id: u64,
    /// Small number that differs from that of every touching grain.
    pub segment_color: u32,
    /// The measured grain.
    pub grain: Grain,
}

/// A convex body wider than `segment.max_grain_m`: bedrock, a wall, a merged mass. Never a grain.
#[derive(Debug, Clone, PartialEq)]
pub struct Oversize {
    /// Smallest global triangle id of the body.
    pub anchor: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Surface area, m².
    pub surface_area_m2: f64,
    /// Box in plan, local metres.
    pub bounds: PlanBox,
}

/// How one tile was worked. Of what is found, only this depends on the tiling.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TileReport {
    /// Row-major number of the tile.
    pub tile: u64,
    /// Core in plan, local metres; half-open.
    pub core: PlanBox,
    /// Triangles whose centroid lies in the core.
    pub core_triangles: u64,
    /// Triangles segmented for it: its core with a halo, and whatever was looked at again.
    pub segmented_triangles: u64,
    /// Blocks segmented until nothing in its core was unknown.
    pub attempts: u32,
    /// Grains that the tile owns.
    pub grains: u64,
}

/// Everything that the tiles found, in an order that does not know about tiles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Catalogue {
    /// Grains by ascending `grain_id`.
    pub grains: Vec<NumberedGrain>,
    /// Oversize bodies by ascending anchor.
    pub oversize: Vec<Oversize>,
}
