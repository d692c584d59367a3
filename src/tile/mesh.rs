//! The mesh of a tile: core and halo, with what the cut left incomplete.

use crate::geometry::{DVec3, triangle_area, triangle_centroid};
use crate::index::{CellBlock, Index};
use crate::open::Surface;

/// Bytes that one loaded triangle takes at the height of segmentation, while neighbours are paired.
///
/// Counted, for half as many vertices as triangles: positions 12, corners 12, complete 0.5, in_core 1, and the
/// divergence of the vertices 4; half-edges 24, the ends of their lists 2, neighbours 12; makes 67.5. Ids and
/// areas, which segmentation does not need, add 40 as they are loaded now (vertex ids 24, for the list of all
/// corners they were found in; triangle ids 8; areas 8). A tenth for growth comes on top. Later steps take
/// less: 17 for neighbours, states and labels, and up to 18 more for each triangle that is unknown.
pub const BYTES_PER_TRIANGLE: u64 = 120;

/// Local numbers of half-edges, three for each triangle, must fit 32 bits.
const MOST_TRIANGLES: usize = 1 << 30;

/// Part of the survey: all triangles whose centroid lies in a block of cells, with their vertices.
///
/// Local numbers ascend with global ids, so that "lowest local number" and "lowest global id" agree.
#[derive(Debug, Clone, Default)]
pub struct TileMesh {
    /// Global ids of the vertices, ascending.
    pub vertex_ids: Vec<u64>,
    /// Their positions, local metres.
    pub positions: Vec<DVec3>,
    /// Whether every triangle around the vertex was loaded.
    pub complete: Vec<bool>,
    /// Global ids of the triangles, ascending.
    pub triangle_ids: Vec<u64>,
    /// Their corners, as local vertex numbers.
    pub triangles: Vec<[u32; 3]>,
    /// Their areas, m².
    pub areas_m2: Vec<f64>,
    /// Whether the tile's core owns the triangle.
    pub in_core: Vec<bool>,
}

impl TileMesh {
    /// Loads a block of cells; `core` says what of it is owned.
    pub fn load(surface: &dyn Surface, index: &Index, core: &CellBlock, block: &CellBlock) -> TileMesh {
        let triangle_ids = index.triangles.in_block(&index.grid, block);
        assert!(
            triangle_ids.len() <= MOST_TRIANGLES,
            "a tile of {} triangles; at most {MOST_TRIANGLES} can be worked at once: set --max-grain or --tile-size",
            triangle_ids.len()
        );
        let global: Vec<[u64; 3]> = triangle_ids.iter().map(|&t| surface.triangle(t)).collect();
        let mut vertex_ids: Vec<u64> = global.iter().flatten().copied().collect();
        vertex_ids.sort_unstable();
        vertex_ids.dedup();
        let positions: Vec<DVec3> = vertex_ids.iter().map(|&v| surface.position(v)).collect();
        let triangles: Vec<[u32; 3]> = global
            .iter()
            .map(|corners| corners.map(|v| vertex_ids.partition_point(|&other| other < v) as u32))
            .collect();
        let mut valence = vec![0u32; vertex_ids.len()];
        for v in triangles.iter().flatten() {
            valence[*v as usize] += 1;
        }
        let complete = vertex_ids.iter().zip(&valence).map(|(&v, &n)| index.valence[v as usize] == n).collect();
        let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize]);
        let areas_m2 = triangles.iter().map(|t| triangle_area(corners(t))).collect();
        let in_core =
            triangles.iter().map(|t| core.contains(index.grid.cell_of(triangle_centroid(corners(t))))).collect();
        TileMesh { vertex_ids, positions, complete, triangle_ids, triangles, areas_m2, in_core }
    }

    /// Global id of a vertex; ascends with the local number.
    pub fn vertex_id(&self, vertex: u32) -> u64 {
        self.vertex_ids[vertex as usize]
    }

    /// Global id of a triangle; ascends with the local number.
    pub fn triangle_id(&self, triangle: u32) -> u64 {
        self.triangle_ids[triangle as usize]
    }

    /// Area of a triangle, m².
    pub fn area_m2(&self, triangle: u32) -> f64 {
        triangle_area(self.corners(triangle))
    }

    /// The corners of a triangle, local metres.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// Local numbers of the vertices of some triangles, ascending, each once.
    pub fn vertices_of(&self, triangles: &[u32]) -> Vec<u32> {
        let mut vertices: Vec<u32> = triangles.iter().flat_map(|&t| self.triangles[t as usize]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }

    /// Positions of the vertices of some triangles, by ascending vertex id, each once; local metres.
    pub fn points_of(&self, triangles: &[u32]) -> Vec<DVec3> {
        self.vertices_of(triangles).into_iter().map(|v| self.positions[v as usize]).collect()
    }

    /// Bytes that a tile of this many triangles takes while it is worked on.
    pub fn footprint_bytes(triangles: u64) -> u64 {
        triangles * BYTES_PER_TRIANGLE
    }
}
