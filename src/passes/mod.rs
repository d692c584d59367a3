//! The passes over all tiles: spacing, curvature, grains.
//!
//! Each works every tile's core with a halo, and looks further where the cut could have mattered. The first two
//! look a few triangles around and store one number for each vertex, so that the third, which looks as far as a
//! grain is wide, need not compute curvature again in every halo.

mod again;
mod grains;
mod per_vertex;
mod probe;

pub use grains::{Recipe, Telling, tiles_at_once};
pub use per_vertex::CoreValues;
pub use probe::Probe;

use crate::curvature::InstructionSet;
use crate::index::{CellBlock, Index};
use crate::pipeline::OverBudget;
use crate::store::StoreError;
use crate::tile::Plan;

/// The survey as the passes see it.
#[derive(Clone, Copy)]
pub struct Survey<'a> {
    /// Where everything is.
    pub index: &'a Index,
    /// How it is cut into tiles.
    pub plan: &'a Plan,
    /// Vector instructions for the curvature; never change a result.
    pub instructions: InstructionSet,
}

/// Why a tile is lost.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TileError {
    /// The index cannot be read, or the result not be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// It would have to see more at once than memory holds.
    #[error(
        "to see what is cut off {halo_m:.3} m beyond its core it {over}\nhelp: raise --memory by {more_mib} MiB or more, or lower --max-grain: wider bodies are then told apart from grains without seeing them whole",
        more_mib = (over.needed.saturating_sub(over.total) >> 20) + 1
    )]
    TooWide {
        /// How far it looked, metres.
        halo_m: f64,
        /// By how much.
        over: OverBudget,
    },
}

impl Survey<'_> {
    /// The block with a margin of at least so many metres on every side, whole cells.
    fn with_halo(&self, block: &CellBlock, halo_m: f64) -> CellBlock {
        let cells = (halo_m / self.index.grid.cell_m).ceil().clamp(0.0, f64::from(u32::MAX));
        self.index.grid.grown(block, cells as u32)
    }

    fn triangles_in(&self, block: &CellBlock) -> u64 {
        self.index.triangles.count(&self.index.grid, block)
    }

    /// Triangles that a tile owns.
    pub fn owned_triangles(&self, job: usize) -> u64 {
        self.triangles_in(self.core(job))
    }

    fn core(&self, job: usize) -> &CellBlock {
        &self.plan.tiles[job].core
    }
}
