//! Indexing: the survey is sorted on disk into square cells in plan, and what must be the same for every
//! tile is gathered on the way.
//!
//! Vertices and triangles get new numbers, by cell: row by row from the south-west, then by position. A tile
//! is then a few sequential reads, however the input was ordered, and the same surface has the same numbers
//! in whatever order its file is. Everything later knows elements by these numbers.
//!
//! ```text
//!  look (used vertices, grid) -> sort vertices -> their new numbers into the triangles -> sort triangles
//! ```
//!
//! Memory does not grow with the survey but for a bit for each vertex and 16 bytes for each cell (of about 64
//! triangles). On disk it takes about 35 bytes for each triangle.

mod cells;
mod colors;
mod corners;
mod ground;
mod identity;
mod manifest;
mod order;
mod scale;
mod seal;
mod shards;
mod triangles;
mod vertices;

pub use cells::{CellBlock, CellGrid, CellStarts};
pub use colors::Colors;
pub use scale::Scale;

use crate::geometry::{DVec3, ExactSum};
use crate::open::Surface;
use crate::store::{Column, Element, Shelf, StoreError};
use identity::Numbers;
use seal::Seal;
use std::ops::Range;

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
    /// The work folder cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Where everything is, and the numbers that all tiles share.
#[derive(Debug)]
pub struct Index {
    /// Cells in plan.
    pub grid: CellGrid,
    /// Triangles by the cell of their centroid.
    pub triangles: CellStarts,
    /// Vertices that triangles use, by their cell.
    pub vertices: CellStarts,
    /// Survey-wide figures. `spacing_m` is 0 until it has been measured.
    pub scale: Scale,
    columns: Columns,
    seals: Vec<Seal>,
}

impl Element for DVec3 {
    const BYTES: usize = 24;
    #[inline(always)]
    fn put(self, to: &mut [u8]) {
        self.to_array().put(to);
    }
    #[inline(always)]
    fn get(from: &[u8]) -> DVec3 {
        DVec3::from_array(Element::get(from))
    }
}

/// What the index keeps on disk.
#[derive(Debug)]
struct Columns {
    positions: Column<DVec3>,
    valences: Column<u16>,
    corners: Numbers<3>,
    vertex_inputs: Numbers<1>,
    triangle_inputs: Numbers<1>,
    colors: Option<Colors>,
}

const POSITIONS: &str = "positions";
const VALENCES: &str = "valences";
const CORNERS: &str = "corners";
const VERTEX_INPUTS: &str = "vertex_inputs";
const TRIANGLE_INPUTS: &str = "triangle_inputs";
const COLORS: &str = "colors";

/// How an index may be built. Never changes what is in it.
#[derive(Debug, Clone, Copy)]
pub struct BuildRoom {
    /// Memory, bytes.
    pub bytes: u64,
    /// Whether numbers take 64 bits even where 32 are enough.
    pub wide: bool,
}

impl Default for BuildRoom {
    fn default() -> BuildRoom {
        BuildRoom { bytes: 256 << 20, wide: false }
    }
}

/// Around a vertex of so many triangles or more, counting says nothing.
pub const MOST_COUNTED: u16 = u16::MAX;

impl Index {
    /// Indexes a survey onto a shelf. Uses the threads of the pool in which it runs.
    ///
    /// # Errors
    /// [`IndexError::NoArea`] when no triangle has any area; [`IndexError::Store`] when the disk is full or
    /// otherwise not usable.
    pub fn build(surface: &dyn Surface, shelf: &Shelf, room: BuildRoom) -> Result<Index, IndexError> {
        let ground = ground::look(surface)?;
        let fits = |n: u64| n <= u64::from(u32::MAX);
        let wide = room.wide || !fits(surface.vertices()) || !fits(surface.triangles());
        let room = BuildRoom { wide, ..room };
        let shards = shards::cut(&ground.in_row, shard_vertices(ground.vertices, room));
        let columns = Columns {
            positions: shelf.create(POSITIONS, ground.vertices)?,
            valences: shelf.create(VALENCES, ground.vertices)?,
            corners: Numbers::create(shelf, CORNERS, surface.triangles(), wide)?,
            vertex_inputs: Numbers::create(shelf, VERTEX_INPUTS, ground.vertices, wide)?,
            triangle_inputs: Numbers::create(shelf, TRIANGLE_INPUTS, surface.triangles(), wide)?,
            colors: match surface.full_color() {
                Some(full) => Some(Colors::create(shelf, COLORS, ground.vertices, full)?),
                None => None,
            },
        };
        let work = Work { surface, ground: &ground, shards: &shards, shelf, columns: &columns, room };
        let bytes = columns.colors.as_ref().is_none_or(|colors| Colors::are_bytes(colors.full()));
        let (vertices, triangles) = match (wide, bytes) {
            (false, true) => work.sort::<u32, [u8; 3]>()?,
            (false, false) => work.sort::<u32, [f32; 3]>()?,
            (true, true) => work.sort::<u64, [u8; 3]>()?,
            (true, false) => work.sort::<u64, [f32; 3]>()?,
        };
        surface.release();
        let scale = triangles.sums.scale(&ground, surface.triangles());
        if scale.mean_triangle_area_m2 <= 0.0 {
            return Err(IndexError::NoArea { triangles: scale.triangles });
        }
        Ok(Index {
            grid: ground.grid,
            triangles: CellStarts::new(triangles.start),
            vertices: CellStarts::new(vertices.start),
            scale,
            columns,
            seals: seal::of_shards(&shards, &vertices.checksums, triangles.written),
        })
    }

    /// Hands the corners of a range of triangles to `take`, in order, some at a time.
    ///
    /// # Errors
    /// The disk says no.
    pub fn each_corners(&self, triangles: Range<u64>, take: impl FnMut(&[[u64; 3]])) -> Result<(), StoreError> {
        self.columns.corners.each_slice(triangles, take)
    }

    /// Positions of vertices, local metres.
    pub fn positions(&self) -> &Column<DVec3> {
        &self.columns.positions
    }

    /// How many triangle corners meet at each vertex of the survey; [`MOST_COUNTED`] for more. A tile that has
    /// loaded as many knows that it sees all there is around that vertex.
    pub fn valences(&self) -> &Column<u16> {
        &self.columns.valences
    }

    /// Colours of vertices as the input has them, if it has any.
    pub fn colors(&self) -> Option<&Colors> {
        self.columns.colors.as_ref()
    }

    /// The input's numbers of a range of triangles.
    ///
    /// # Errors
    /// The disk says no.
    pub fn triangle_inputs(&self, triangles: Range<u64>) -> Result<Vec<u64>, StoreError> {
        let mut found = Vec::with_capacity((triangles.end - triangles.start) as usize);
        self.columns.triangle_inputs.each_slice(triangles, |inputs| found.extend_from_slice(inputs.as_flattened()))?;
        Ok(found)
    }

    /// The input's numbers of a range of vertices.
    ///
    /// # Errors
    /// The disk says no.
    pub fn vertex_inputs(&self, vertices: Range<u64>) -> Result<Vec<u64>, StoreError> {
        let mut found = Vec::with_capacity((vertices.end - vertices.start) as usize);
        self.columns.vertex_inputs.each_slice(vertices, |inputs| found.extend_from_slice(inputs.as_flattened()))?;
        Ok(found)
    }
}

/// What is sorted, and where to.
struct Work<'a> {
    surface: &'a dyn Surface,
    ground: &'a ground::Ground,
    shards: &'a [shards::Shard],
    shelf: &'a Shelf,
    columns: &'a Columns,
    room: BuildRoom,
}

impl Work<'_> {
    fn sort<I: identity::Id, C: colors::Color>(
        &self,
    ) -> Result<(vertices::SortedVertices, triangles::SortedTriangles), StoreError> {
        let Work { surface, ground, shards, shelf, columns, room } = *self;
        // Half is for the shards that are sorted: see `shard_vertices`.
        let quarter = room.bytes / 4;
        let to = vertices::Sorted {
            positions: &columns.positions,
            inputs: &columns.vertex_inputs,
            colors: columns.colors.as_ref(),
        };
        let vertices = vertices::sort::<I, C>(surface, ground, shards, (shelf, quarter), &to)?;
        let join = corners::JoinRoom { block: quarter, waiting: quarter };
        let scatter = corners::scatter::<I>(surface, &columns.vertex_inputs, shards, shelf, join)?;
        let to = triangles::Sorted {
            positions: &columns.positions,
            corners: &columns.corners,
            inputs: &columns.triangle_inputs,
            valences: &columns.valences,
        };
        Ok((vertices, triangles::sort::<I>(&scatter, &ground.grid, (shards, shards_together(shards, room)), &to)?))
    }
}

/// Bytes that an index takes on disk, with the scratch files of its making, if none of them fits into memory, and the
/// divergence of every vertex. Where the new numbers of all vertices do not fit into the memory either, corners wait on
/// disk as well.
pub fn disk_bytes(vertices: u64, triangles: u64, full_color: Option<f64>, room_bytes: u64) -> u64 {
    let wide = vertices.max(triangles) > u64::from(u32::MAX);
    let number = if wide { 8 } else { 4 };
    let bytes = full_color.is_none_or(Colors::are_bytes);
    let waiting = 28 + number + if bytes { 3 } else { 12 };
    let colors = if full_color.is_none() { 0 } else { waiting - 28 - number };
    let corners = if room_bytes / 4 / number < vertices { 24 } else { 0 };
    let scratch = (vertices * waiting).max(triangles * (4 * number + corners));
    vertices * (24 + 2 + 8 + number + colors) + triangles * 4 * number + scratch
}

/// Vertices of a shard, at least.
const LEAST_VERTICES: u64 = 1 << 12;
/// Vertices of a shard that the processor's cache holds, with their triangles.
const CACHED_VERTICES: u64 = 1 << 15;
/// More shards than this would leave the disk with pieces that are too small.
const MOST_CACHED_SHARDS: u64 = 256;

/// Shards for each thread that are worked at a time, at most.
const MOST_TOGETHER: usize = 8;

/// Vertices of a shard: what half of the memory holds, shared by the threads; fewer where that gives each
/// thread several to choose from, or where the processor's cache then holds a shard.
fn shard_vertices(vertices: u64, room: BuildRoom) -> u64 {
    let threads = rayon::current_num_threads() as u64;
    let each = sorting_bytes(room);
    let cached = CACHED_VERTICES.max(vertices / MOST_CACHED_SHARDS);
    (room.bytes / 2 / threads / each).min(vertices / (4 * threads)).min(cached).max(LEAST_VERTICES)
}

/// Bytes that a vertex of a shard takes while it is sorted with its triangles, or by itself.
fn sorting_bytes(room: BuildRoom) -> u64 {
    let width = if room.wide { 2 } else { 1 };
    vertices::SORTING_BYTES.max(2 * width * triangles::SORTING_BYTES)
}

/// Shards whose triangles are worked at a time: one for each thread, and more where half of the memory holds them, since
/// threads wait for one another at their end.
fn shards_together(shards: &[shards::Shard], room: BuildRoom) -> usize {
    let threads = rayon::current_num_threads();
    let largest = shards.iter().map(|s| s.vertices.end - s.vertices.start).max().unwrap_or(0).max(1);
    ((room.bytes / 2 / sorting_bytes(room) / largest) as usize).clamp(threads, MOST_TOGETHER * threads)
}

/// Sums over all triangles, and what they give.
#[derive(Clone)]
struct Sums {
    area: ExactSum,
    edges: ExactSum,
    zero_area: u64,
}

impl Sums {
    const NOTHING: Sums = Sums { area: ExactSum::ZERO, edges: ExactSum::ZERO, zero_area: 0 };

    #[inline(always)]
    fn add(&mut self, c: [DVec3; 3], area_m2: f64) {
        self.area.add(area_m2);
        self.zero_area += u64::from(area_m2 == 0.0);
        for i in 0..3 {
            self.edges.add((c[(i + 1) % 3] - c[i]).length());
        }
    }

    fn merge(mut self, other: Sums) -> Sums {
        self.area.merge(other.area);
        self.edges.merge(other.edges);
        self.zero_area += other.zero_area;
        self
    }

    fn scale(&self, ground: &ground::Ground, triangles: u64) -> Scale {
        let n = triangles.max(1) as f64;
        Scale {
            vertices: ground.vertices,
            triangles,
            min: ground.min,
            max: ground.max,
            surface_area_m2: self.area.value(),
            mean_triangle_area_m2: self.area.value() / n,
            mean_edge_m: self.edges.value() / (3.0 * n),
            spacing_m: 0.0,
            zero_area_triangles: self.zero_area,
        }
    }
}
