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
/// Largest core of the grain pass, triangles: more only makes the last tile wait for longer.
const LARGEST_CORE: f64 = 1.6e7;
/// Largest core of the curvature pass, triangles.
const LARGEST_CURVATURE_CORE: f64 = 2e6;
/// Triangles of a core with its first halo, for each of the core.
const WITH_HALO: f64 = 1.3;

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

/// Memory in which the index is built.
///
/// # Errors
/// The budget is too small.
pub fn room(reach: &Reach, memory: u64) -> Result<BuildRoom, ForecastError> {
    let needed = fixed_bytes(reach) + LEAST_BYTES;
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

/// The size of cores, as the settings have it or as the memory allows.
pub struct CoreSizes {
    /// In the passes that store one number for each vertex.
    pub curvature: CoreSize,
    /// In the grain pass.
    pub grains: CoreSize,
}

/// How large cores may be if `threads` tiles are worked at once in `memory` bytes.
pub fn core_sizes(index: &Index, settings: &Settings, threads: usize, memory: u64) -> CoreSizes {
    if settings.work.tile_size_m > 0.0 {
        let square = CoreSize::square(index, settings.work.tile_size_m);
        return CoreSizes { curvature: square, grains: square };
    }
    let triangles = index.scale.triangles as f64;
    let shared = triangles / threads as f64;
    let size = |bytes: u64, least: f64, most: f64| {
        let fit = memory as f64 / threads as f64 / bytes as f64 / WITH_HALO;
        CoreSize::holding(index, fit.min(shared.max(least)).min(most), threads)
    };
    CoreSizes {
        curvature: size(NormalField::footprint_bytes(1), 2.5e5, LARGEST_CURVATURE_CORE),
        grains: size(TileMesh::footprint_bytes(1), 1e6, LARGEST_CORE),
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
