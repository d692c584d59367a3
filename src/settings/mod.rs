//! Every parameter of a run: its unit, default, allowed range and reason.
//!
//! The same keys serve the settings file (`--config`, TOML), the flags and `--set section.key=value`.
//! `configs/default.toml` is compared with [`Settings::default`] by a test.

mod load;
mod printed;
mod unused;
mod valleys;

pub use valleys::ValleySettings;

pub use load::{PRESETS, SettingsError, parse_bytes};

use serde::{Deserialize, Serialize};

/// All settings of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// What the input's coordinates mean.
    pub input: InputSettings,
    /// How a point cloud gets its surface.
    pub surface: SurfaceSettings,
    /// How curvature is computed.
    pub curvature: CurvatureSettings,
    /// What makes a grain.
    pub segment: SegmentSettings,
    /// How the method `valleys` tells stones apart.
    pub valleys: ValleySettings,
    /// When a measurement is flagged.
    pub measure: MeasureSettings,
    /// The grain-size raster.
    pub raster: RasterSettings,
    /// How the work is cut and how much of the machine it takes; never changes a result.
    pub work: WorkSettings,
    /// Which optional files are written.
    pub output: OutputSettings,
}

/// Unit of the input's coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// The unit of the CRS, metres without one.
    #[default]
    Auto,
    /// Metres.
    M,
    /// Millimetres.
    Mm,
    /// International feet (0.3048 m).
    Ft,
    /// US survey feet (1200/3937 m).
    #[serde(rename = "us-ft")]
    #[value(name = "us-ft")]
    UsFt,
}

/// What the input's coordinates mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct InputSettings {
    /// Unit of the input's coordinates: `auto`, `m`, `mm`, `ft`, `us-ft`.
    pub unit: Unit,
    /// Coordinate reference system: `EPSG:n`, WKT, or a file that holds WKT (`.prj`). Empty: none.
    pub crs: String,
    /// East, north and up shift added to the coordinates to reach the CRS, in units of the CRS.
    pub offset: [f64; 3],
    /// A file that holds this shift, as OpenDroneMap, Pix4D and others write it; it may name the CRS as well.
    /// Empty: none.
    pub offset_file: String,
    /// Vertices of different files that are as near as this are one, metres; 0 to choose it from the mean edge and
    /// the precision of the coordinates.
    pub weld_m: f64,
}

/// How a point cloud gets its surface. Meshes have one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceSettings {
    /// Radius of the widest empty circle that a triangle may span, in spacings of the points around it, 0.7 to 3. Wider
    /// gaps stay open.
    pub gap_spacings: f64,
}

impl Default for SurfaceSettings {
    fn default() -> Self {
        SurfaceSettings { gap_spacings: 2.0 }
    }
}

/// How the published method computes curvature (Rheinwalt et al. 2025, eq. 1 and 2); `valleys` does not ask.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CurvatureSettings {
    /// Triangle normals averaged at each of the six stencil points, count, 1 to 256.
    pub neighbours: usize,
    /// Distance of the stencil points from the vertex, in mean vertex-to-nearest-triangle distances.
    pub stencil_spacings: f64,
}

impl Default for CurvatureSettings {
    fn default() -> Self {
        CurvatureSettings { neighbours: 25, stencil_spacings: 2.0 }
    }
}

/// How stones are told apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Along valleys of the surface: keys of `[valleys]`.
    #[default]
    Valleys,
    /// By curvature, after Rheinwalt, Purinton & Bookhagen (2025): keys of `[curvature]` and the further ones of
    /// `[segment]`. With the limits as published: `--config rheinwalt2025`.
    Rheinwalt2025,
}

/// How the smallest grain is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum AreaRule {
    /// Summed triangle area, m²: the same stone passes whatever the mesh density.
    #[default]
    Area,
    /// Number of triangles, the area divided by the survey's mean triangle area (the authors' program).
    TriangleCount,
}

/// How the three vertices of a triangle decide that it is concave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum ConcaveRule {
    /// One concave vertex is enough (the authors' program).
    #[default]
    Min,
    /// The mean of the three (the paper's text).
    Mean,
}

/// What makes a grain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentSettings {
    /// How stones are told apart.
    pub method: Method,
    /// Widest grain, metres (longer side of its box in plan, before it grows into valleys); 0 for no limit. Wider bodies are no
    /// grains; the published method reports them as oversize. Decides how far a tile must look beyond its core.
    pub max_grain_m: f64,
    /// Smallest grain, m² of visible surface.
    pub min_grain_area_m2: f64,
    /// Smallest grain, triangles: raises `min_grain_area_m2` on coarse meshes to this many mean triangles.
    pub min_grain_triangles: f64,
    /// Whether the two limits above are held against areas or against triangle counts.
    pub area_rule: AreaRule,
    /// From here on of the published method. How three vertices decide that a triangle is concave.
    pub concave_rule: ConcaveRule,
    /// Divergence below which the surface is concave, in 1 per mean edge length; 0 as published.
    pub concave_below: f64,
    /// Triangles taller than this are removed, metres; 0 for none.
    pub max_triangle_height_m: f64,
    /// Rings of triangles taken off before grains are told apart; 0 for none.
    pub erosion_iterations: u32,
    /// Convex-hull sphericity below which a body is no grain, 0 to 1; 0 for none.
    pub min_sphericity: f64,
    /// Rings of triangles given back afterwards; 0 for none.
    pub dilation_iterations: u32,
    /// Whether a concave pocket that touches one grain only is filled.
    pub fill_holes: bool,
    /// Whether such a pocket is filled even where it is open at an edge of the mesh.
    pub fill_edge_holes: bool,
}

impl Default for SegmentSettings {
    fn default() -> Self {
        SegmentSettings {
            method: Method::Valleys,
            max_grain_m: 2.0,
            min_grain_area_m2: 1e-4,
            min_grain_triangles: 50.0,
            area_rule: AreaRule::Area,
            concave_rule: ConcaveRule::Min,
            concave_below: -0.05,
            max_triangle_height_m: 0.0,
            erosion_iterations: 1,
            min_sphericity: 0.5,
            dilation_iterations: 3,
            fill_holes: true,
            fill_edge_holes: false,
        }
    }
}

impl SegmentSettings {
    /// How far the steps of the published method look beyond a body, mean edge lengths: a ring of triangles is up to
    /// three edges wide.
    pub fn reach_edges(&self) -> f64 {
        3.0 * f64::from(self.erosion_iterations + self.dilation_iterations + 2)
    }
}

impl Settings {
    /// How far the steps of the method look beyond a body, mean edge lengths.
    pub fn reach_edges(&self) -> f64 {
        match self.segment.method {
            Method::Valleys => self.valleys.reach_edges(),
            Method::Rheinwalt2025 => self.segment.reach_edges(),
        }
    }
}

/// When a measurement is flagged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureSettings {
    /// Grains of fewer triangles are flagged `few_triangles`.
    pub few_triangles: u64,
    /// Axis ratio (a/b or b/c) below which the attitude is flagged as undefined.
    pub equant_ratio: f64,
    /// Grains with a lower confidence are left out of all results, 0 to 1; 0 keeps all. Only the method `valleys` tells
    /// how sure it is.
    pub min_confidence: f64,
    /// Usual c/b of the stones, a median, 0.01 to 1: what a half buried one is expected to be.
    pub prior_c_over_b: f64,
    /// How far c/b varies from stone to stone: standard deviation of ln(c/b), 0.05 to 2. Large: trust the fit alone.
    pub prior_c_over_b_spread: f64,
    /// Usual b/a of the stones, a median, 0.01 to 1.
    pub prior_b_over_a: f64,
    /// Standard deviation of ln(b/a), 0.05 to 2.
    pub prior_b_over_a_spread: f64,
}

/// What is expected of the shape of stones before they are seen.
///
/// Ratios are medians; spreads are standard deviations of the ratio's natural logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapePrior {
    /// c/b.
    pub c_over_b: f64,
    /// Standard deviation of ln(c/b).
    pub c_over_b_spread: f64,
    /// b/a.
    pub b_over_a: f64,
    /// Standard deviation of ln(b/a).
    pub b_over_a_spread: f64,
}

impl ShapePrior {
    /// Mixed river gravel: wide enough for slates and for cubes.
    pub const RIVER_GRAVEL: ShapePrior =
        ShapePrior { c_over_b: 0.6, c_over_b_spread: 0.35, b_over_a: 0.75, b_over_a_spread: 0.2 };
}

impl Default for MeasureSettings {
    fn default() -> Self {
        let prior = ShapePrior::RIVER_GRAVEL;
        MeasureSettings {
            few_triangles: 100,
            equant_ratio: 1.1,
            min_confidence: 0.0,
            prior_c_over_b: prior.c_over_b,
            prior_c_over_b_spread: prior.c_over_b_spread,
            prior_b_over_a: prior.b_over_a,
            prior_b_over_a_spread: prior.b_over_a_spread,
        }
    }
}

impl MeasureSettings {
    /// What is expected of the shape of stones.
    pub fn shape_prior(&self) -> ShapePrior {
        ShapePrior {
            c_over_b: self.prior_c_over_b,
            c_over_b_spread: self.prior_c_over_b_spread,
            b_over_a: self.prior_b_over_a,
            b_over_a_spread: self.prior_b_over_a_spread,
        }
    }
}

/// The grain-size raster.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RasterSettings {
    /// Cell size, metres; 0 for ten times the D50, rounded up to 1, 2 or 5 times a power of ten.
    pub cell_m: f64,
    /// Cells with fewer grains carry no percentiles.
    pub min_grains: u32,
}

impl Default for RasterSettings {
    fn default() -> Self {
        RasterSettings { cell_m: 0.0, min_grains: 5 }
    }
}

/// How the work is cut and how much of the machine it takes; never changes a result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct WorkSettings {
    /// Side of a tile's core, metres; 0 to choose it from the memory budget.
    pub tile_size_m: f64,
    /// Compute threads; 0 for all cores.
    pub threads: usize,
    /// Memory for tiles in flight, as `2GiB`, `500MB` or bytes; empty for half of what is there.
    #[serde(deserialize_with = "load::size_text")]
    pub memory: String,
    /// Vector instructions for the curvature: `auto` for the fastest that the processor has.
    pub instructions: Instructions,
}

/// Vector instructions, as they are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Instructions {
    /// The fastest that the processor has.
    #[default]
    Auto,
    /// AVX-512.
    Avx512,
    /// AVX2.
    Avx2,
    /// None: plain Rust.
    Scalar,
}

/// Which optional files are written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct OutputSettings {
    /// Whether the input mesh, or the surface of a cloud, is written again with a `grain_id` for each face.
    pub labelled_mesh: bool,
    /// Whether the points of a cloud are written again with a `grain_id` for each.
    pub labelled_cloud: bool,
}
