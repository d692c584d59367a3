//! A probe: how wide grains are, so that tiles look neither too far nor too near at first.

use super::grains::Recipe;
use super::{Survey, TileError};
use crate::geometry::PlanBox;
use crate::index::CellBlock;
use crate::tile::Owned;

/// Triangles that are looked at.
const TRIANGLES: f64 = 2.5e5;
/// Fewer grains say nothing.
const LEAST_GRAINS: usize = 4;
/// Share of grains that are not wider.
const SHARE: f64 = 0.8;

/// What a probe found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Probe {
    /// Width in plan that most grains do not exceed, metres; none where there were too few to say.
    pub usual_width_m: Option<f64>,
    /// Triangles that were segmented for it.
    pub segmented: u64,
}

impl Survey<'_> {
    /// Segments a small block around the middle triangle of the survey.
    ///
    /// # Errors
    /// The index cannot be read.
    pub fn probe(&self, recipe: &Recipe) -> Result<Probe, TileError> {
        let (cell, _) = self.index.triangles.cell_of(self.index.scale.triangles / 2);
        let [column, row] = self.index.grid.place(cell);
        let per_cell = self.index.scale.triangles as f64 / self.index.triangles.occupied_cells().max(1) as f64;
        let middle = CellBlock { columns: column..column + 1, rows: row..row + 1 };
        let mut half = ((TRIANGLES / per_cell).sqrt() / 2.0) as u32;
        // It may be denser there than elsewhere.
        while half > 0 && self.triangles_in(&self.index.grid.grown(&middle, half)) as f64 > 2.0 * TRIANGLES {
            half /= 2;
        }
        let block = self.index.grid.grown(&middle, half);
        let (mesh, found) = self.segmented(Owned::Cells(&block), &block, recipe)?;
        let width_m = |triangles: &[u32]| {
            let mut bounds = PlanBox::EMPTY;
            triangles.iter().flat_map(|&t| mesh.corners(t)).for_each(|c| bounds.include(c));
            bounds.width_m()
        };
        let mut widths_m: Vec<f64> = found.grains.iter().map(|g| width_m(&g.triangles)).collect();
        widths_m.sort_unstable_by(f64::total_cmp);
        let usual = widths_m.get((SHARE * widths_m.len() as f64) as usize).copied();
        Ok(Probe {
            usual_width_m: usual.filter(|_| widths_m.len() >= LEAST_GRAINS),
            segmented: mesh.triangles.len() as u64,
        })
    }
}
