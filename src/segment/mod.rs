//! Segmentation: which triangles of a tile form which grain, and what of that is certain.
//!
//! The published recipe (Rheinwalt, Purinton & Bookhagen 2025), each step a function of the surface and
//! of the survey's scale only:
//!
//! | step | file | looks around |
//! |---|---|---|
//! | remove concave triangles | [`concave`] | the triangle |
//! | give back small concave dents | [`concave`] | a concave component |
//! | erode | [`morphology`] | one ring of vertices each |
//! | drop small bodies, set oversize ones apart | [`bodies`] | a body, at most `max_grain_m` |
//! | drop flat bodies | [`bodies`] | a body |
//! | dilate | [`morphology`] | one ring of vertices each |
//! | fill pockets inside one body | [`holes`] | a pocket, at most `max_grain_m` |
//! | drop small bodies again | [`settle`] | a body |
//!
//! **Certainty.** A tile sees the survey only out to its halo. Every step carries three values (kept,
//! removed, unknown), and decides as soon as the part that is seen decides it. A grain none of whose
//! triangles, nor anything joined to it, is unknown is *settled*: exactly the grain of the untiled run.
//! When something that touches the core is still unknown, the tile is worked again with a wider halo.

pub mod bodies;
pub mod components;
pub mod concave;
pub mod edges;
pub mod holes;
pub mod morphology;
pub mod settle;
pub mod state;

pub use settle::{OversizePiece, Segment, Settled};

use crate::index::Scale;
use crate::settings::{AreaRule, SegmentSettings};
use crate::tile::TileMesh;
use edges::Edges;
use state::{Labels, NONE, State};

/// The size of every triangle, in a unit that adds up exactly, and the smallest grain in that unit.
pub struct Sizes {
    /// Size of each triangle.
    pub of: Vec<u64>,
    /// Components below this size are no grains, and no gaps between grains.
    pub smallest: u64,
}

impl Sizes {
    /// Parts of a mean triangle's area that are counted by [`AreaRule::Area`].
    const PARTS: f64 = 1_048_576.0;

    /// Sizes of a tile's triangles by the rule of the settings.
    pub fn new(mesh: &TileMesh, scale: &Scale, settings: &SegmentSettings) -> Sizes {
        let triangles = smallest_grain_area_m2(scale, settings) / scale.mean_triangle_area_m2;
        match settings.area_rule {
            AreaRule::TriangleCount => Sizes { of: vec![1; mesh.triangles.len()], smallest: triangles as u64 },
            AreaRule::Area => {
                let unit = scale.mean_triangle_area_m2 / Self::PARTS;
                Sizes {
                    of: (0..mesh.triangles.len() as u32).map(|t| (mesh.area_m2(t) / unit).round() as u64).collect(),
                    smallest: (triangles * Self::PARTS).round() as u64,
                }
            }
        }
    }
}

/// Smallest grain of a survey, m² of visible surface: the setting, raised on coarse meshes.
pub fn smallest_grain_area_m2(scale: &Scale, settings: &SegmentSettings) -> f64 {
    settings.min_grain_area_m2.max(settings.min_grain_triangles * scale.mean_triangle_area_m2)
}

/// The steps after which a watcher of [`segment`] is shown the states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Concave triangles removed.
    Concave,
    /// Small concave dents given back.
    Dents,
    /// Eroded.
    Erosion,
    /// Small bodies dropped.
    SmallBodies,
    /// Flat bodies dropped.
    FlatBodies,
    /// Dilated by one more ring.
    Dilation(u32),
    /// Pockets filled.
    Holes,
}

/// Segments a tile.
///
/// `divergence` is that of every local vertex, 1/m. `watch` sees the states after every step: tests hold
/// them against the authors' program.
pub fn segment(
    mesh: &TileMesh,
    divergence: &[f64],
    scale: &Scale,
    settings: &SegmentSettings,
    watch: &mut dyn FnMut(Step, &[State]),
) -> Settled {
    let edges = Edges::of(&mesh.triangles, mesh.positions.len());
    let sizes = Sizes::new(mesh, scale, settings);
    let mut state = concave::remove_concave(mesh, divergence, scale.mean_edge_m, settings);
    watch(Step::Concave, &state);
    concave::give_back_dents(mesh, &edges, &sizes, &mut state);
    watch(Step::Dents, &state);
    for _ in 0..settings.erosion_iterations {
        morphology::erode(mesh, &mut state);
    }
    watch(Step::Erosion, &state);
    let mut labels = bodies::tell_apart(mesh, &edges, &sizes, state, settings);
    watch(Step::SmallBodies, &labels.state);
    bodies::drop_flat(mesh, &mut labels, settings.min_sphericity);
    watch(Step::FlatBodies, &labels.state);
    let oversize = settle::oversize_pieces(mesh, &edges, &labels);
    for ring in 1..=settings.dilation_iterations {
        morphology::dilate(mesh, &mut labels);
        remove_tall(mesh, &mut labels, settings);
        watch(Step::Dilation(ring), &labels.state);
    }
    if settings.fill_holes {
        holes::fill_holes(mesh, &edges, &sizes, settings, &mut labels);
    }
    watch(Step::Holes, &labels.state);
    settle::settle(mesh, &edges, &sizes, &labels, oversize)
}

fn remove_tall(mesh: &TileMesh, labels: &mut Labels, settings: &SegmentSettings) {
    if settings.max_triangle_height_m > 0.0 {
        for t in (0..mesh.triangles.len()).filter(|&t| concave::too_tall(mesh, t, settings)) {
            labels.state[t] = State::Removed;
            labels.label[t] = NONE;
        }
    }
}
