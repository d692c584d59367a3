//! The normal field of a tile: what a curvature stencil averages.

use super::patch::{TakeTriangles, each_triangle};
use crate::geometry::{DVec3, PlanBox, triangle_centroid, triangle_normal};
use crate::index::{CellBlock, Index};
use crate::store::StoreError;

/// Unit triangle normals at triangle centroids, by ascending survey number.
#[derive(Debug, Clone)]
pub struct NormalField {
    /// Centroids, local metres.
    pub centroids: Vec<DVec3>,
    /// Unit normals; zero where a triangle has no area. Empty where only centroids were loaded.
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
        let mut field = NormalField::empty(index, block);
        field.normals.reserve_exact(field.centroids.capacity());
        each_triangle(index, block, &mut field)?;
        Ok(field)
    }

    /// Loads centroids only: enough for the search for nearest ones.
    ///
    /// # Errors
    /// The index cannot be read.
    pub fn load_centroids(index: &Index, block: &CellBlock) -> Result<NormalField, StoreError> {
        let mut field = NormalField::empty(index, block);
        each_triangle(index, block, &mut Centroids(&mut field.centroids))?;
        Ok(field)
    }

    /// Without triangles, but with room for the centroids of a block.
    fn empty(index: &Index, block: &CellBlock) -> NormalField {
        let triangles = index.triangles.count(&index.grid, block) as usize;
        let centroids = Vec::with_capacity(triangles);
        NormalField { centroids, normals: Vec::new(), loaded: index.grid.plan(block) }
    }

    /// Bytes that a field of this many triangles takes while it is worked on: 48 for itself, 16 for the points of
    /// its core, 26 for grids and results, 8 for the exact search where it is needed.
    pub fn footprint_bytes(triangles: u64) -> u64 {
        triangles * 102
    }
}

impl TakeTriangles for NormalField {
    #[inline(always)]
    fn add(&mut self, corners: [DVec3; 3]) {
        self.centroids.push(triangle_centroid(corners));
        self.normals.push(triangle_normal(corners));
    }

    fn replace(&mut self, place: usize, corners: [DVec3; 3]) {
        self.centroids[place] = triangle_centroid(corners);
        self.normals[place] = triangle_normal(corners);
    }
}

/// Centroids of triangles.
struct Centroids<'a>(&'a mut Vec<DVec3>);

impl TakeTriangles for Centroids<'_> {
    #[inline(always)]
    fn add(&mut self, corners: [DVec3; 3]) {
        self.0.push(triangle_centroid(corners));
    }

    fn replace(&mut self, place: usize, corners: [DVec3; 3]) {
        self.0[place] = triangle_centroid(corners);
    }
}
