//! What a run will take: how the survey is cut, and how much memory and disk that needs.

use crate::index::{BuildRoom, Index, disk_bytes};
use crate::open::Reach;
use crate::passes::Survey;
use crate::settings::Settings;
use crate::tile::{CoreSize, NormalField, TileMesh};

/// Memory of the program itself, of GDAL and of buffers, bytes.
const BASE_BYTES: u64 = 64 << 20;
/// Memory for tiles, or for sorting, without which a run makes no sense, bytes.
const LEAST_BYTES: u64 = 16 << 20;
/// Largest core of the curvature pass, triangles. With larger ones every tile takes new pages from the system; with
/// smaller ones halos weigh more.
const LARGEST_CURVATURE_CORE: f64 = 5e5;
/// Triangles of a curvature core with its halo, for each of the core.
const WITH_HALO: f64 = 1.1;
/// Widths of a grain that are worked once more along a border between two cores, halos and second looks together.
/// Measured on beds of 10 and 100 million triangles, in 2 to 21 tiles.
const WIDTHS_AT_BORDER: f64 = 7.0;
/// Work in halos, for each triangle of the survey, up to which it is cut into more tiles than memory asks for. The
/// loops within a tile run on all threads as well, so that more would be gained for the clock alone.
const WORTH_A_CUT: f64 = 0.2;
/// Survey that is not cut for the sake of threads, triangles: to look how wide its grains are would cost too much.
const LEAST_TO_CUT: u64 = 8_000_000;

/// A run that needs more than there is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ForecastError {
    /// The memory budget is too small.
    #[error(
        "{what} needs {} MiB of memory, and --memory is {} MiB\nhelp: give at least --memory {}MiB, or {}",
        mebibytes(*needed),
        memory >> 20,
        mebibytes(*needed),
        otherwise
    )]
    Memory {
        /// What needs it.
        what: &'static str,
        /// All that is needed, bytes.
        needed: u64,
        /// The budget, bytes.
        memory: u64,
        /// What else would help.
        otherwise: &'static str,
    },
    /// The disk is too small.
    #[error(
        "the index needs {} MiB in {folder}, where {} MiB are free\nhelp: free some space, or name a folder on another disk with --work-dir",
        mebibytes(*needed),
        free >> 20
    )]
    Disk {
        /// The work folder.
        folder: String,
        /// What is needed, bytes.
        needed: u64,
        /// What is free, bytes.
        free: u64,
    },
}

fn mebibytes(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}

/// Memory that is not free for tiles: the program, a bit for each vertex while the index is made, 16 bytes for
/// each cell.
pub fn fixed_bytes(reach: &Reach) -> u64 {
    BASE_BYTES + reach.vertices() / 8 + reach.triangles() / 2
}

/// The smallest memory budget with which a survey can be run, bytes.
pub fn least_bytes(reach: &Reach) -> u64 {
    fixed_bytes(reach) + LEAST_BYTES
}

/// The memory with which a survey is worked in one piece, bytes.
pub fn whole_bytes(reach: &Reach) -> u64 {
    least_bytes(reach).max(fixed_bytes(reach) + TileMesh::footprint_bytes(reach.triangles()))
}

/// Memory in which the index is built.
///
/// # Errors
/// The budget is too small.
pub fn room(reach: &Reach, memory: u64) -> Result<BuildRoom, ForecastError> {
    let needed = least_bytes(reach);
    if needed > memory {
        let otherwise = "run on a machine with more";
        return Err(ForecastError::Memory { what: "this survey", needed, memory, otherwise });
    }
    Ok(BuildRoom { bytes: memory - fixed_bytes(reach), ..BuildRoom::default() })
}

/// Bytes that the work folder will take.
///
/// # Errors
/// The disk has less.
pub fn disk(reach: &Reach, folder: &str, free: Option<u64>) -> Result<u64, ForecastError> {
    let needed = disk_bytes(reach.vertices(), reach.triangles(), reach.full_color());
    match free {
        Some(free) if free < needed => Err(ForecastError::Disk { folder: folder.to_owned(), needed, free }),
        _ => Ok(needed),
    }
}

/// The size of cores in the passes that store one number for each vertex, if `threads` tiles are worked at once in
/// `memory` bytes.
pub fn curvature_core(index: &Index, settings: &Settings, threads: usize, memory: u64) -> CoreSize {
    if settings.work.tile_size_m > 0.0 {
        return CoreSize::square(index, settings.work.tile_size_m);
    }
    let fit = memory as f64 / threads as f64 / NormalField::footprint_bytes(1) as f64 / WITH_HALO;
    let shared = index.scale.triangles as f64 / threads as f64;
    CoreSize::holding(index, fit.min(shared.max(2.5e5)).min(LARGEST_CURVATURE_CORE), threads)
}

/// How large the cores of the grain pass may be.
#[derive(Debug, Clone, Copy)]
pub struct GrainCores {
    /// The largest that memory allows.
    pub largest: CoreSize,
    /// Whether they may be smaller, if grains are narrow enough, so that every thread has tiles.
    pub divisible: bool,
}

/// The largest cores of the grain pass that fit into `memory` bytes while up to `threads` tiles are worked at once.
pub fn grain_cores(index: &Index, settings: &Settings, threads: usize, memory: u64) -> GrainCores {
    if settings.work.tile_size_m > 0.0 {
        return GrainCores { largest: CoreSize::square(index, settings.work.tile_size_m), divisible: false };
    }
    let triangles = index.scale.triangles;
    let all = TileMesh::footprint_bytes(triangles) as f64;
    // Halos of usual width, which no core has that is all.
    let fits = |tiles: f64| {
        let halo = if tiles > 1.0 { 1.3 } else { 1.0 };
        all * halo / tiles * tiles.min(threads as f64) <= memory as f64
    };
    let least = (1..=threads).map(|tiles| tiles as f64).find(|&tiles| fits(tiles));
    let least = least.unwrap_or(all * 1.3 * threads as f64 / memory as f64);
    let largest = CoreSize::holding(index, triangles as f64 / least, threads);
    GrainCores { largest, divisible: threads > 1 && triangles >= LEAST_TO_CUT && fits(threads as f64) }
}

impl GrainCores {
    /// The size of cores where most grains are not wider than `usual_width_m`: as small as gives every thread a tile,
    /// if what is then worked in halos is little.
    pub fn size(&self, index: &Index, threads: usize, usual_width_m: Option<f64>) -> CoreSize {
        let Some(width_m) = usual_width_m.filter(|_| self.divisible) else { return self.largest };
        let width_cells = width_m / index.grid.cell_m;
        let triangles = index.scale.triangles as f64;
        (2..=threads)
            .rev()
            .map(|tiles| CoreSize::holding(index, triangles / tiles as f64, threads))
            .filter(|size| size.columns <= self.largest.columns && size.rows <= self.largest.rows)
            .find(|size| WIDTHS_AT_BORDER * width_cells * size.border(&index.grid) <= WORTH_A_CUT)
            .unwrap_or(self.largest)
    }
}

/// What the tiles in flight take at most, bytes, if none has to look further than usual.
///
/// # Errors
/// One of them alone takes more than `memory`.
pub fn tiles_bytes(survey: &Survey, settings: &Settings, threads: usize, memory: u64) -> Result<u64, ForecastError> {
    let largest = survey.largest_bytes(&settings.segment);
    if largest > memory {
        let otherwise = "a smaller --tile-size";
        return Err(ForecastError::Memory { what: "the largest tile", needed: largest, memory, otherwise });
    }
    Ok((largest * threads.min(survey.plan.tiles.len()) as u64).min(memory))
}
