//! The normal field of a tile: what a curvature stencil averages.

use super::Patch;
use crate::geometry::{DVec3, PlanBox, triangle_centroid, triangle_normal};
use crate::index::{CellBlock, Index};
use crate::store::StoreError;

/// Unit triangle normals at triangle centroids, by ascending survey number.
#[derive(Debug, Clone)]
pub struct NormalField {
    /// Centroids, local metres.
    pub centroids: Vec<DVec3>,
    /// Unit normals; zero where a triangle has no area.
    pub normals: Vec<DVec3>,
    /// What was loaded, in plan: every centroid inside is here. Infinite where the survey ends.
    pub loaded: PlanBox,
}

impl NormalField {
    /// Loads the normals of all triangles whose centroid lies in the block.
    ///
    /// # Errors
    /// The index cannot be read.
    pub fn load(index: &Index, block: &CellBlock) -> Result<NormalField, StoreError> {
        let patch = Patch::load(index, block)?;
        let (mut centroids, mut normals) = (Vec::with_capacity(patch.corners.len()), Vec::new());
        centroids.extend(patch.each_corners().map(triangle_centroid));
        normals.extend(patch.each_corners().map(triangle_normal));
        Ok(NormalField { centroids, normals, loaded: index.grid.plan(block) })
    }

    /// Bytes that a field of this many triangles takes while it is worked on: 48 for itself, 16 for the points of
    /// its core, 30 for grids and results, 8 for the exact search where it is needed.
    pub fn footprint_bytes(triangles: u64) -> u64 {
        triangles * 102
    }
}
