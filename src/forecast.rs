//! What a run will take of memory and disk.

use crate::cuts::LARGEST_CORE;
use crate::index::{BuildRoom, disk_bytes};
use crate::open::Reach;
use crate::passes::Survey;
use crate::settings::Settings;
use crate::surfaces::triangles_to_expect;
use crate::tile::TileMesh;

/// Memory of the program itself, of GDAL and of buffers, bytes.
const BASE_BYTES: u64 = 64 << 20;
/// Memory for tiles, or for sorting, without which a run makes no sense, bytes.
const LEAST_BYTES: u64 = 16 << 20;

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

/// Bytes on disk for each point of a cloud while it gets its surface: the point in each block that needs it, about
/// one and a half, and two triangles.
const SURFACE_DISK_BYTES: u64 = 48 + 24;

fn mebibytes(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}

/// Memory that is not free for tiles: the program, a bit for each vertex while the index is made, 16 bytes for
/// each cell.
pub fn fixed_bytes(reach: &Reach) -> u64 {
    BASE_BYTES + reach.vertices() / 8 + triangles_to_expect(reach) / 2
}

/// The smallest memory budget with which a survey can be run, bytes.
pub fn least_bytes(reach: &Reach) -> u64 {
    fixed_bytes(reach) + LEAST_BYTES
}

/// The memory with which a survey is worked in one piece, bytes.
pub fn whole_bytes(reach: &Reach) -> u64 {
    least_bytes(reach)
        .max(fixed_bytes(reach) + TileMesh::footprint_bytes(triangles_to_expect(reach).min(LARGEST_CORE as u64)))
}

/// Memory in which files are welded, bytes, where `room` is that for the index: nothing else is there yet.
pub fn weld_bytes(reach: &Reach, room: u64) -> u64 {
    room + fixed_bytes(reach) - BASE_BYTES
}

/// Memory in which the index is built, and tiles are worked.
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

/// What of this memory is left for the index while the aliases of welded vertices are there as well.
///
/// # Errors
/// Too little.
pub fn index_room(reach: &Reach, room: BuildRoom, welded_bytes: u64) -> Result<BuildRoom, ForecastError> {
    let (needed, memory) = (least_bytes(reach) + welded_bytes, fixed_bytes(reach) + room.bytes);
    if needed > memory {
        let (what, otherwise) = ("this survey of several files", "join them into one");
        return Err(ForecastError::Memory { what, needed, memory, otherwise });
    }
    Ok(BuildRoom { bytes: room.bytes - welded_bytes, ..room })
}

/// Bytes that the index takes on disk if it is made in so much memory, and of a cloud its surface.
pub fn work_disk_bytes(reach: &Reach, room_bytes: u64) -> u64 {
    let surface = if reach.is_cloud() { reach.vertices() * SURFACE_DISK_BYTES } else { 0 };
    disk_bytes(reach.vertices(), triangles_to_expect(reach), reach.full_color(), room_bytes) + surface
}

/// Bytes that the work folder will take.
///
/// # Errors
/// The disk has less.
pub fn disk(reach: &Reach, room: BuildRoom, folder: &str, free: Option<u64>) -> Result<u64, ForecastError> {
    let needed = work_disk_bytes(reach, room.bytes);
    match free {
        Some(free) if free < needed => Err(ForecastError::Disk { folder: folder.to_owned(), needed, free }),
        _ => Ok(needed),
    }
}

/// What the tiles in flight take at most, bytes, if none has to look further than usual.
///
/// Beside them, `fixed` bytes are taken by what is no tile.
///
/// # Errors
/// One of them alone takes more than `memory`.
pub fn tiles_bytes(
    survey: &Survey,
    settings: &Settings,
    threads: usize,
    (memory, fixed): (u64, u64),
) -> Result<u64, ForecastError> {
    let largest = survey.largest_bytes(settings);
    if largest > memory {
        let (what, otherwise) = ("the run, with its largest tile,", "a smaller --tile-size");
        return Err(ForecastError::Memory { what, needed: largest + fixed, memory: memory + fixed, otherwise });
    }
    // As many as there are threads where they are small.
    Ok((largest * threads.min(survey.plan.tiles.len()) as u64).min(memory))
}
