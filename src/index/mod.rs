//! Indexing: one pass over the survey sorts its triangles into square cells in plan and gathers what
//! must be the same for every tile.
//!
//! Cost: about 20 bytes per triangle and 16 per vertex, held in memory in this version.

mod cells;
mod scale;

pub use cells::{CellBlock, CellGrid, CellLists};
pub use scale::Scale;

use crate::geometry::{DVec3, ExactSum, triangle_area, triangle_centroid};
use crate::open::Surface;
use rayon::prelude::*;

/// Elements handled by one parallel task: large enough to hide its cost, small enough to share out.
const CHUNK: u64 = 1 << 16;
/// Triangles in an average cell: tiles are whole cells, so this is how finely a tile can be cut.
const TRIANGLES_PER_CELL: f64 = 256.0;

/// A survey that cannot be indexed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IndexError {
    /// Every triangle is degenerate.
    #[error(
        "the {triangles} triangles of the survey have no area at all\nhelp: look at the mesh in CloudCompare or MeshLab; coordinates may have been rounded away by float32 (export with an offset, or as double)"
    )]
    NoArea {
        /// How many triangles there are.
        triangles: u64,
    },
}

/// Where everything is, and the numbers that all tiles share.
#[derive(Debug, Clone)]
pub struct Index {
    /// Cells in plan.
    pub grid: CellGrid,
    /// Triangles by the cell of their centroid.
    pub triangles: CellLists,
    /// Vertices by cell; those that no triangle uses lie in the nearest.
    pub vertices: CellLists,
    /// How many triangle corners meet at each vertex of the survey. A tile that has loaded as many
    /// knows that it sees all there is around that vertex.
    pub valence: Vec<u32>,
    /// Survey-wide figures. `spacing_m` is 0 until it has been measured.
    pub scale: Scale,
}

impl Index {
    /// Indexes a survey.
    ///
    /// # Errors
    /// [`IndexError::NoArea`] when no triangle has any area.
    pub fn build(surface: &dyn Surface) -> Result<Index, IndexError> {
        let mut valence = vec![0u32; surface.vertices() as usize];
        for t in 0..surface.triangles() {
            for v in surface.triangle(t) {
                valence[v as usize] += 1;
            }
        }
        let scale = figures(surface, &valence);
        if scale.mean_triangle_area_m2 <= 0.0 {
            return Err(IndexError::NoArea { triangles: scale.triangles });
        }
        let grid =
            CellGrid::over(scale.min, scale.max, scale.triangles, scale.mean_triangle_area_m2, TRIANGLES_PER_CELL);
        let place = |p: DVec3| grid.number(grid.cell_of(p)) as u32;
        let of_triangle: Vec<u32> =
            (0..scale.triangles).into_par_iter().map(|t| place(triangle_centroid(surface.corners(t)))).collect();
        let triangles = CellLists::build(grid.len(), &of_triangle);
        drop(of_triangle);
        let of_vertex: Vec<u32> = (0..scale.vertices).into_par_iter().map(|v| place(surface.position(v))).collect();
        let vertices = CellLists::build(grid.len(), &of_vertex);
        drop(of_vertex);
        Ok(Index { grid, triangles, vertices, valence, scale })
    }
}

#[derive(Clone)]
struct Sums {
    min: DVec3,
    max: DVec3,
    area: ExactSum,
    edges: ExactSum,
    zero_area: u64,
}

impl Sums {
    const NOTHING: Sums = Sums {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
        area: ExactSum::ZERO,
        edges: ExactSum::ZERO,
        zero_area: 0,
    };

    fn merge(mut self, other: Sums) -> Sums {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.area.merge(other.area);
        self.edges.merge(other.edges);
        self.zero_area += other.zero_area;
        self
    }
}

fn chunks(n: u64) -> impl ParallelIterator<Item = std::ops::Range<u64>> {
    (0..n.div_ceil(CHUNK)).into_par_iter().map(move |c| c * CHUNK..((c + 1) * CHUNK).min(n))
}

fn figures(surface: &dyn Surface, valence: &[u32]) -> Scale {
    let (vertices, triangles) = (surface.vertices(), surface.triangles());
    let of_vertices = chunks(vertices)
        .map(|range| {
            range.filter(|&v| valence[v as usize] > 0).fold(Sums::NOTHING, |mut sums, v| {
                let p = surface.position(v);
                sums.min = sums.min.min(p);
                sums.max = sums.max.max(p);
                sums
            })
        })
        .reduce(|| Sums::NOTHING, Sums::merge);
    let of_triangles = chunks(triangles)
        .map(|range| {
            range.fold(Sums::NOTHING, |mut sums, t| {
                let c = surface.corners(t);
                let area = triangle_area(c);
                sums.area.add(area);
                sums.zero_area += u64::from(area == 0.0);
                for i in 0..3 {
                    sums.edges.add((c[(i + 1) % 3] - c[i]).length());
                }
                sums
            })
        })
        .reduce(|| Sums::NOTHING, Sums::merge);
    let n = triangles.max(1) as f64;
    Scale {
        vertices,
        triangles,
        min: of_vertices.min,
        max: of_vertices.max,
        surface_area_m2: of_triangles.area.value(),
        mean_triangle_area_m2: of_triangles.area.value() / n,
        mean_edge_m: of_triangles.edges.value() / (3.0 * n),
        spacing_m: 0.0,
        zero_area_triangles: of_triangles.zero_area,
    }
}
