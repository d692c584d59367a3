//! The candidates around one cell, narrowed for vertices that are worked together.

use super::buffer::Points;
use super::grid::Grid;
use super::lanes::Lanes;
use crate::geometry::DVec3;

/// A block of candidates.
pub(super) struct Block {
    /// The cell that the block is around.
    pub(super) slot: [i32; 3],
    /// Cells that it reaches beyond that cell.
    pub(super) rings: i32,
    /// Centre of the cell, local metres: candidates are relative to it.
    pub(super) centre: DVec3,
}

impl Block {
    /// The block around a cell.
    pub(super) fn around(grid: &Grid, slot: [i32; 3], rings: i32) -> Block {
        Block { slot, rings, centre: grid.centre(slot) }
    }
}

/// The box around a group of vertices, relative to a block's centre.
pub(super) struct Group {
    /// Centre, metres: the group's candidates are relative to it.
    pub(super) centre: [f32; 3],
    half: [f32; 3],
    /// Half the diagonal, metres.
    pub(super) radius_m: f64,
}

impl Group {
    /// The box around places.
    #[inline(always)]
    pub(super) fn around(places: &[DVec3]) -> Group {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &at in places {
            (low, high) = (low.min(at), high.max(at));
        }
        let centre = ((low + high) * 0.5).as_vec3().to_array();
        let half = (high - low) * 0.500_01;
        Group { centre, half: half.as_vec3().to_array(), radius_m: half.length() }
    }

    /// Narrows the block to what balls around the stencil points of any vertex of the group can hold, whose farthest
    /// places are `radius_m` from the vertex.
    #[inline(always)]
    pub(super) fn narrow<L: Lanes>(
        &self,
        lanes: L,
        block: &Points,
        kept: &mut Points,
        (radius_m, offset_m): (f64, f64),
    ) {
        let reach = (radius_m * 1.000_01 - offset_m) as f32;
        lanes.keep_near_box(block, self.centre, self.half, (reach, offset_m as f32), kept);
    }
}
