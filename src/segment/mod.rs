//! Segmentation: which triangles of a tile form which grain, and what of that is certain.
//!
//! Two methods, by `segment.method`: the default is in `valleys`; the other files are the published recipe (Rheinwalt,
//! Purinton & Bookhagen 2025), each step a function of the surface and of the survey's scale only:
//!
//! | step | file | looks around |
//! |---|---|---|
//! | remove concave triangles | [`concave`] | the triangle |
//! | give back small concave dents | [`concave`] | a concave component |
//! | erode | [`morphology`] | one ring of vertices each |
//! | drop small bodies, set oversize ones apart | [`bodies`] | a body, at most `max_grain_m` |
//! | drop flat bodies | [`flat`] | a body |
//! | dilate | [`morphology`] | one ring of vertices each |
//! | fill pockets inside one body | [`holes`] | a pocket, at most `max_grain_m` |
//! | drop small bodies again | [`settle`] | a body |
//!
//! **Certainty.** A tile sees the survey only out to its halo. Every step carries three values (kept,
//! removed, unknown), and decides as soon as the part that is seen decides it. A grain none of whose
//! triangles, nor anything joined to it, is unknown is *settled*: exactly the grain of the untiled run.
//! When something that touches the core is still unknown, the tile is worked again with a wider halo.

pub mod adjacency;
pub mod bands;
pub mod bodies;
pub mod components;
pub mod concave;
mod edges;
pub mod flat;
pub mod holes;
pub mod morphology;
pub mod settle;
pub mod state;
pub mod valleys;

pub use settle::{Evidence, OversizePiece, Segment, Settled};

use crate::index::Scale;
use crate::settings::{AreaRule, SegmentSettings};
use crate::tile::TileMesh;
use adjacency::Adjacency;
use bands::Bands;
use state::{NONE, State};

/// The size of a triangle, in a unit that adds up exactly, and the smallest grain in that unit.
pub struct Sizes {
    /// The unit, m²; none if triangles are counted.
    unit_m2: Option<f64>,
    /// Components below this size are no grains, and no gaps between grains.
    pub smallest: u64,
}

impl Sizes {
    /// Parts of a mean triangle's area that are counted by [`AreaRule::Area`].
    const PARTS: f64 = 1_048_576.0;

    /// Sizes by the rule of the settings.
    pub fn new(scale: &Scale, settings: &SegmentSettings) -> Sizes {
        let triangles = smallest_grain_area_m2(scale, settings) / scale.mean_triangle_area_m2;
        match settings.area_rule {
            AreaRule::TriangleCount => Sizes { unit_m2: None, smallest: triangles as u64 },
            AreaRule::Area => Sizes {
                unit_m2: Some(scale.mean_triangle_area_m2 / Self::PARTS),
                smallest: (triangles * Self::PARTS).round() as u64,
            },
        }
    }

    /// Size of one triangle.
    pub fn of(&self, mesh: &TileMesh, triangle: u32) -> u64 {
        self.unit_m2.map_or(1, |unit_m2| (mesh.area_m2(triangle) / unit_m2).round() as u64)
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
    let bands = Bands::of(mesh);
    let adjacency = Adjacency::of(&bands);
    let sizes = Sizes::new(scale, settings);
    let tall = concave::too_tall(mesh, settings);
    let mut state = concave::remove_concave(mesh, divergence, scale.mean_edge_m, settings);
    tall.iter().for_each(|&t| state[t as usize] = State::Removed);
    watch(Step::Concave, &state);
    concave::give_back_dents(mesh, &adjacency, &sizes, &mut state);
    watch(Step::Dents, &state);
    for _ in 0..settings.erosion_iterations {
        morphology::erode(&bands, &mut state);
    }
    watch(Step::Erosion, &state);
    let mut labels = bodies::tell_apart(mesh, &adjacency, &sizes, state, settings);
    watch(Step::SmallBodies, &labels.state);
    flat::drop_flat(&bands, &mut labels, settings.min_sphericity);
    watch(Step::FlatBodies, &labels.state);
    let oversize = settle::oversize_pieces(mesh, &adjacency, &labels);
    for ring in 1..=settings.dilation_iterations {
        morphology::dilate(&bands, &mut labels);
        for &t in &tall {
            labels.state[t as usize] = State::Removed;
            labels.label[t as usize] = NONE;
        }
        watch(Step::Dilation(ring), &labels.state);
    }
    if settings.fill_holes {
        holes::fill_holes(&bands, &adjacency, settings, &mut labels);
    }
    watch(Step::Holes, &labels.state);
    settle::settle(mesh, &adjacency, &sizes, &labels, oversize)
}
