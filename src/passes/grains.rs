//! Grains: every tile is segmented with a narrow halo, and what that leaves open is looked at again.

use super::again::clusters;
use super::{Survey, TileError};
use crate::index::{CellBlock, Colors};
use crate::measure::{Grain, Wanted, measure};
use crate::pipeline::{Crew, LostJob, Reservation, Stages, Stopped, over_jobs};
use crate::progress::{Progress, Unit};
use crate::segment::valleys::segment_along_valleys;
use crate::segment::{OversizePiece, Settled, segment};
use crate::settings::{SegmentSettings, Settings, ValleySettings};
use crate::stitch::{TileFinding, TileReport};
use crate::store::{Column, StoreError, panic_point};
use crate::tile::{Owned, TileMesh, read_of};
use rayon::prelude::*;

/// What the grain pass applies to every tile.
#[derive(Clone, Copy)]
pub struct Recipe<'a> {
    /// What makes a grain.
    pub settings: &'a SegmentSettings,
    /// How stones are told apart.
    pub method: Telling<'a>,
    /// What to measure.
    pub wanted: Wanted,
    /// How wide most grains are in plan, metres, if that is known: how far a tile looks at first. Never changes
    /// a result.
    pub usual_width_m: Option<f64>,
}

impl Recipe<'_> {
    /// How far the steps look beyond a body, mean edge lengths.
    fn reach_edges(&self) -> f64 {
        match self.method {
            Telling::Valleys(settings) => settings.reach_edges(),
            Telling::Rheinwalt2025(_) => self.settings.reach_edges(),
        }
    }
}

/// How stones are told apart, with what that takes.
#[derive(Clone, Copy)]
pub enum Telling<'a> {
    /// Along valleys.
    Valleys(&'a ValleySettings),
    /// As published, from the divergence of every vertex of the survey, 1/m.
    Rheinwalt2025(&'a Column<f64>),
}

/// Threads that a large tile of the grain pass keeps busy by itself. Two were measured: 1.9 times one.
const THREADS_OF_A_TILE: usize = 4;
/// Triangles of a core below which a tile has too little work to share out.
const SMALL_TILE: u64 = 1_000_000;

/// Large tiles of the grain pass that keep so many threads busy. Fewer tiles are larger ones, which repeat less in their
/// halos.
pub fn tiles_at_once(threads: usize) -> usize {
    threads.div_ceil(THREADS_OF_A_TILE)
}

/// How far an attempt looks beyond a block, cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Halo {
    south: u32,
    beside: u32,
    north: u32,
}

/// Part of a core's width that grains are taken to be wide where nothing is known.
const UNKNOWN_WIDTH: f64 = 0.1;
/// How far a tile looks to the north, in widths of a grain. A grain belongs to the tile of its southernmost
/// triangles, so that most of it may lie beyond the core, and its neighbours must be seen whole as well.
const NORTH_WIDTHS: f64 = 1.5;
/// How far it looks elsewhere: what reaches into the core must be seen whole.
const OTHER_WIDTHS: f64 = 1.0;
/// How much further each attempt looks than the one before.
const FURTHER: f64 = 1.6;

/// What was found in a tile so far.
#[derive(Default)]
struct Found {
    grains: Vec<Grain>,
    oversize: Vec<OversizePiece>,
    segmented: u64,
    attempts: u32,
}

impl Survey<'_> {
    /// Grains, oversize bodies and a report from each tile of `jobs`, handed to `collect` in this order.
    ///
    /// # Errors
    /// When interrupted, or when `collect` fails.
    pub fn grains<C>(
        &self,
        crew: &Crew,
        jobs: &[usize],
        recipe: &Recipe,
        progress: &dyn Progress,
        mut collect: impl FnMut(usize, TileFinding) -> Result<(), C>,
    ) -> Result<Vec<LostJob>, Stopped<C>> {
        let threads = crew.pool.current_num_threads();
        let small = jobs.iter().all(|&job| self.triangles_in(self.core(job)) < SMALL_TILE);
        let stages = Stages {
            at_once: if small { threads } else { tiles_at_once(threads) },
            footprint_bytes: |job| TileMesh::footprint_bytes(self.triangles_in(&self.first_block(job, recipe))),
            work: |job, reservation: &mut Reservation| self.tile(job, recipe, reservation),
        };
        let triangles = jobs.iter().map(|&job| self.triangles_in(self.core(job))).sum();
        progress.begin("grains", triangles, Unit::Triangles);
        let lost = over_jobs(crew, jobs, &stages, |job, finding: TileFinding| {
            progress.advance(finding.report.core_triangles);
            collect(job, finding)
        });
        progress.end();
        lost
    }

    /// Bytes that the largest tile takes at first.
    pub fn largest_bytes(&self, settings: &Settings) -> u64 {
        let reach_edges = settings.reach_edges();
        let block =
            |job| self.grown(self.core(job), self.halo(self.core(job), &settings.segment, (reach_edges, None), 0));
        let triangles = |job| self.triangles_in(&block(job));
        TileMesh::footprint_bytes((0..self.plan.tiles.len()).map(triangles).max().unwrap_or(0))
    }

    /// How far a tile looks in its first attempt, the second, and so on.
    fn halo(
        &self,
        core: &CellBlock,
        settings: &SegmentSettings,
        (reach_edges, usual_width_m): (f64, Option<f64>),
        attempt: i32,
    ) -> Halo {
        let cell_m = self.index.grid.cell_m;
        let reach = reach_edges * self.index.scale.mean_edge_m / cell_m;
        let core_width = f64::from((core.columns.end - core.columns.start).max(core.rows.end - core.rows.start));
        let widest = if settings.max_grain_m > 0.0 { settings.max_grain_m / cell_m } else { f64::MAX };
        let width = usual_width_m.map_or(UNKNOWN_WIDTH * core_width, |m| m / cell_m).min(widest);
        let cells = |widths: f64, attempt: i32| ((reach + widths * width) * FURTHER.powi(attempt.max(0))).ceil() as u32;
        // What is open after the first attempt mostly went on to the north.
        let (other, north) = (cells(OTHER_WIDTHS, attempt - 1), cells(NORTH_WIDTHS, attempt));
        Halo { south: other, beside: other, north }
    }

    fn first_block(&self, job: usize, recipe: &Recipe) -> CellBlock {
        let core = self.core(job);
        self.grown(core, self.halo(core, recipe.settings, (recipe.reach_edges(), recipe.usual_width_m), 0))
    }

    fn grown(&self, block: &CellBlock, halo: Halo) -> CellBlock {
        let mut grown = self.index.grid.grown(block, halo.north.max(halo.beside));
        grown.rows.start = grown.rows.start.max(block.rows.start.saturating_sub(halo.south));
        grown.rows.end = grown.rows.end.min(block.rows.end.saturating_add(halo.north));
        grown.columns.start = grown.columns.start.max(block.columns.start.saturating_sub(halo.beside));
        grown.columns.end = grown.columns.end.min(block.columns.end.saturating_add(halo.beside));
        grown
    }

    fn tile(&self, job: usize, recipe: &Recipe, reservation: &mut Reservation) -> Result<TileFinding, TileError> {
        panic_point("grains", self.plan.tiles[job].id);
        let core = self.core(job);
        let first = self.first_block(job, recipe);
        let mut found = Found::default();
        let mut open = self.attempt(Owned::Cells(core), &first, recipe, &mut found)?;
        // From here on small blocks around what is open are worked, and wider ones each time.
        let mut attempt = 1;
        while !open.is_empty() {
            let mut still_open = Vec::new();
            let halo = self.halo(core, recipe.settings, (recipe.reach_edges(), recipe.usual_width_m), attempt);
            for cluster in clusters(self.index, &open, halo.beside) {
                let block = self.grown(&cluster.cells, halo);
                let triangles = self.triangles_in(&block);
                let halo_m = f64::from(halo.north) * self.index.grid.cell_m;
                reservation
                    .change_to(TileMesh::footprint_bytes(triangles))
                    .map_err(|over| TileError::TooWide { halo_m, over })?;
                let left = self.attempt(Owned::Triangles(&cluster.triangles), &block, recipe, &mut found)?;
                let whole = triangles == self.index.scale.triangles;
                assert!(left.is_empty() || !whole, "{} triangles are unknown though all are loaded", left.len());
                still_open.extend(left);
            }
            still_open.sort_unstable();
            open = still_open;
            attempt += 1;
        }
        Ok(self.finding(job, found))
    }

    /// Segments a block, adds what it settles of what is owned, and returns the owned triangles that it does not
    /// settle, ascending.
    fn attempt(
        &self,
        owned: Owned,
        block: &CellBlock,
        recipe: &Recipe,
        found: &mut Found,
    ) -> Result<Vec<u64>, TileError> {
        let (mesh, settled) = self.segmented(owned, block, recipe)?;
        found.segmented += mesh.triangles.len() as u64;
        found.attempts += 1;
        let Settled { grains, oversize, unsettled } = settled;
        let colors = self.colors(&mesh)?;
        let color = |v: u32| colors.as_ref().map(|(full, colors)| colors[v as usize].map(|c| f64::from(c) / full));
        let mut measured: Vec<Grain> =
            grains.par_iter().map(|segment| measure(&mesh, segment, recipe.wanted, &color)).collect();
        if recipe.wanted.triangle_ids {
            self.name_by_input(&mesh, &mut measured)?;
        }
        found.grains.extend(measured);
        found.oversize.extend(oversize);
        Ok(unsettled.into_iter().map(|t| mesh.triangle_id(t)).collect())
    }

    /// Loads and segments a block.
    pub(super) fn segmented(
        &self,
        owned: Owned,
        block: &CellBlock,
        recipe: &Recipe,
    ) -> Result<(TileMesh, Settled), TileError> {
        let mesh = TileMesh::load(self.index, owned, block)?;
        let scale = &self.index.scale;
        let settled = match recipe.method {
            Telling::Valleys(settings) => segment_along_valleys(&mesh, scale, recipe.settings, settings),
            Telling::Rheinwalt2025(divergence) => {
                let divergence = read_of(divergence, &mesh.vertex_runs)?;
                segment(&mesh, &divergence, scale, recipe.settings, &mut |_, _| {})
            }
        };
        Ok((mesh, settled))
    }

    /// Colours of a tile's vertices, and what stands for full colour.
    #[allow(clippy::type_complexity, reason = "used once, and named where it is used")]
    fn colors(&self, mesh: &TileMesh) -> Result<Option<(f64, Vec<[f32; 3]>)>, StoreError> {
        let Some(kept) = self.index.colors() else { return Ok(None) };
        let colors = match kept {
            Colors::Bytes(column) => {
                read_of(column, &mesh.vertex_runs)?.into_iter().map(|c| c.map(f32::from)).collect()
            }
            Colors::Floats(_, column) => read_of(column, &mesh.vertex_runs)?,
        };
        Ok(Some((kept.full(), colors)))
    }

    /// Puts the input's numbers, ascending, in place of the survey's: labels go back onto the input.
    fn name_by_input(&self, mesh: &TileMesh, grains: &mut [Grain]) -> Result<(), StoreError> {
        let mut inputs = Vec::with_capacity(mesh.triangles.len());
        for range in mesh.triangle_runs.ranges() {
            inputs.extend(self.index.triangle_inputs(range.clone())?);
        }
        for grain in grains {
            for t in &mut grain.triangle_ids {
                *t = mesh.triangle_runs.local(*t).map_or(u64::MAX, |local| inputs[local as usize]);
            }
            grain.triangle_ids.sort_unstable();
        }
        Ok(())
    }

    fn finding(&self, job: usize, found: Found) -> TileFinding {
        let core = self.core(job);
        TileFinding {
            report: TileReport {
                tile: self.plan.tiles[job].id,
                core: self.index.grid.outline(core),
                core_triangles: self.triangles_in(core),
                segmented_triangles: found.segmented,
                attempts: found.attempts,
                grains: found.grains.len() as u64,
            },
            grains: found.grains,
            oversize: found.oversize,
        }
    }
}
