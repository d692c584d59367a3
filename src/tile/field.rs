//! The normal field of a tile: what a curvature stencil averages.

use crate::geometry::{DVec3, PlanBox, triangle_centroid, triangle_normal};
use crate::index::{CellBlock, Index};
use crate::open::Surface;

/// Unit triangle normals at triangle centroids, by ascending global triangle id.
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
    pub fn load(surface: &dyn Surface, index: &Index, block: &CellBlock) -> NormalField {
        let ids = index.triangles.in_block(&index.grid, block);
        let mut centroids = Vec::with_capacity(ids.len());
        let mut normals = Vec::with_capacity(ids.len());
        for id in ids {
            let corners = surface.corners(id);
            centroids.push(triangle_centroid(corners));
            normals.push(triangle_normal(corners));
        }
        NormalField { centroids, normals, loaded: index.grid.plan(block) }
    }

    /// Bytes that a field of this many triangles takes while it is worked on: for each triangle 48 of its own, 16 of the
    /// points of half as many vertices, about 30 while the curvature stage works (measured), and 8 for the exact search
    /// if it is needed.
    pub fn footprint_bytes(triangles: u64) -> u64 {
        triangles * 102
    }
}
