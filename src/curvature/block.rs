//! The candidates around one cell, narrowed for a group of its vertices.

use super::buffer::Points;
use super::grid::Grid;
use super::lanes::Lanes;
use crate::geometry::DVec3;

/// A block of candidates, and the part of it that a group of vertices needs.
pub(super) struct Block {
    /// The cell that the block is around.
    pub(super) slot: [i32; 3],
    /// Cells that it reaches beyond that cell.
    pub(super) rings: i32,
    /// Centre of the cell, local metres: candidates are relative to it.
    pub(super) centre: DVec3,
    group_centre: [f32; 3],
    group_half: [f32; 3],
    /// Radius of the balls that the group's list is good for, metres.
    pub(super) group_radius_m: f64,
}

impl Block {
    /// The block around a cell, with no group yet.
    pub(super) fn around(grid: &Grid, slot: [i32; 3], rings: i32) -> Block {
        Block {
            slot,
            rings,
            centre: grid.centre(slot),
            group_centre: [0.0; 3],
            group_half: [0.0; 3],
            group_radius_m: 0.0,
        }
    }

    /// Starts a group of vertices, local metres.
    #[inline(always)]
    pub(super) fn start_group(&mut self, points: impl Iterator<Item = DVec3>) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in points {
            let at = p - self.centre;
            (low, high) = (low.min(at), high.max(at));
        }
        self.group_centre = ((low + high) * 0.5).as_vec3().to_array();
        self.group_half = ((high - low) * 0.500_01).as_vec3().to_array();
        self.group_radius_m = 0.0;
    }

    /// Narrows the block to what a ball of this radius around any vertex of the group can hold.
    #[inline(always)]
    pub(super) fn narrow<L: Lanes>(&mut self, lanes: L, block: &Points, group: &mut Points, radius_m: f64) {
        self.group_radius_m = radius_m;
        let limit = (radius_m * 1.000_01) as f32;
        lanes.keep_near_box(block, self.group_centre, self.group_half, limit * limit, group);
        group.pad(group.len + 64);
    }
}
