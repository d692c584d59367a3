//! The mesh of a tile: core and halo, with what the cut left incomplete.

use super::patch::Patch;
use super::read::read_of;
use super::runs::Runs;
use crate::geometry::{DVec3, PlanBox, triangle_area};
use crate::index::{CellBlock, Index, MOST_COUNTED};
use crate::store::StoreError;

/// Bytes that one loaded triangle takes at the height of segmentation.
///
/// Counted, for half as many vertices as triangles (a mesh whose triangles are not joined has six times as many), few of
/// them with more than eight neighbours: positions 12, corners 12, complete 0.5, in_core 1, the divergence
/// of the vertices 4, neighbours 12; states and labels 5, components while they are numbered 8, vertices of bodies 6; or
/// instead of the last three colours 6, triangles of grains 4 and what is measured; makes 60. Along
/// valleys instead of the divergence and what follows: neighbours of the vertices 17, normals, bends and areas 16, floods and
/// labels 11; makes 70. Measured with 10 million in one tile: 68, and 74 to 78 along valleys. Something for growth comes on top;
/// unknown triangles take up to 18 more each. What the second look along valleys looks at takes as much again: next to nothing
/// on open beds, measured 3 to 20 for each of all triangles on crowded ones, where the share of memory that tiles are not made for
/// has room for it; 50 if nothing is claimed at first, for which nothing is set aside.
pub const BYTES_PER_TRIANGLE: u64 = 96;

/// A triangle and one of its sides must fit 32 bits.
const MOST_TRIANGLES: usize = 1 << 30;

/// Part of the survey: all triangles whose centroid lies in a block of cells, with their vertices.
///
/// Local numbers ascend with the survey's, so that "lowest local number" and "lowest number" agree.
#[derive(Debug, Clone, Default)]
pub struct TileMesh {
    /// Positions of the vertices, local metres.
    pub positions: Vec<DVec3>,
    /// Whether every triangle around the vertex was loaded.
    pub complete: Vec<bool>,
    /// Corners of the triangles, as local vertex numbers.
    pub triangles: Vec<[u32; 3]>,
    /// Whether the triangle is owned.
    pub in_core: Vec<bool>,
    /// The ground of which everything is loaded: all triangles whose centroid lies there. None where that is all ground.
    pub seen: Option<PlanBox>,
    /// The survey's numbers of the vertices.
    pub vertex_runs: Runs,
    /// The survey's numbers of the triangles.
    pub triangle_runs: Runs,
}

/// What of a loaded block is asked for.
#[derive(Debug, Clone, Copy)]
pub enum Owned<'a> {
    /// Everything in these cells: a tile's core.
    Cells(&'a CellBlock),
    /// These triangles of a core, by ascending survey number: what is looked at again.
    Triangles(&'a [u64]),
}

/// Whether around each vertex of a patch there are as many corners as around it in the survey.
fn complete(index: &Index, patch: &Patch) -> Result<Vec<bool>, StoreError> {
    let mut valence = vec![0u16; patch.positions.len()];
    for v in patch.corners.iter().flatten() {
        let valence = &mut valence[*v as usize];
        *valence = valence.saturating_add(1);
    }
    let whole = read_of(index.valences(), &patch.vertices)?;
    Ok(valence.iter().zip(whole).map(|(&here, whole)| whole < MOST_COUNTED && here == whole).collect())
}

impl TileMesh {
    /// Loads a block of cells, of which some is owned.
    ///
    /// # Errors
    /// The index cannot be read.
    pub fn load(index: &Index, owned: Owned, block: &CellBlock) -> Result<TileMesh, StoreError> {
        let count = index.triangles.count(&index.grid, block);
        assert!(
            count <= MOST_TRIANGLES as u64,
            "a tile of {count} triangles; at most {MOST_TRIANGLES} can be worked at once: set --max-grain or --tile-size",
        );
        let patch = Patch::load(index, block)?;
        let everything = patch.corners.len() as u64 == index.scale.triangles;
        let complete = if everything { vec![true; patch.positions.len()] } else { complete(index, &patch)? };
        let mut in_core = vec![false; patch.corners.len()];
        match owned {
            Owned::Cells(core) => {
                for range in patch.triangles.shared(&index.triangles.ranges(&index.grid, core)) {
                    in_core[range.start as usize..range.end as usize].fill(true);
                }
            }
            Owned::Triangles(triangles) => {
                triangles.iter().filter_map(|&t| patch.triangles.local(t)).for_each(|t| in_core[t as usize] = true);
            }
        }
        let Patch { vertices: vertex_runs, positions, triangles: triangle_runs, corners: triangles } = patch;
        let seen = (!everything).then(|| index.grid.plan(block));
        Ok(TileMesh { positions, complete, triangles, in_core, seen, vertex_runs, triangle_runs })
    }

    /// The corners of a triangle, local metres.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// Area of a triangle, m².
    pub fn area_m2(&self, triangle: u32) -> f64 {
        triangle_area(self.corners(triangle))
    }

    /// The survey's number of a vertex; ascends with the local one.
    pub fn vertex_id(&self, vertex: u32) -> u64 {
        self.vertex_runs.number(vertex)
    }

    /// The survey's number of a triangle; ascends with the local one.
    pub fn triangle_id(&self, triangle: u32) -> u64 {
        self.triangle_runs.number(triangle)
    }

    /// Bytes that a tile of this many triangles takes while it is worked on.
    pub fn footprint_bytes(triangles: u64) -> u64 {
        triangles * BYTES_PER_TRIANGLE
    }
}
