//! LAS, LAZ and COPC become records in a scratch file, and are read from there like the vertices of a PLY file.
//!
//! All points are read, those of every level of a COPC file as well. Chunks are decoded on all threads; each point has
//! its place in the scratch file, so that the order of the file is kept whoever comes first.

use super::error::OpenError;
use super::las_crs::CloudCrs;
use super::las_header::LasFile;
use super::las_records::{Colors, Converter, Tally, element, record_bytes};
use super::laz_chunks::Chunk;
use super::mapped::MappedFile;
use super::ply_header::PlyHeader;
use super::progress::Progress;
use super::records::Source;
use super::warning::Warning;
use laz::DecompressionSelection;
use ply_rs_bw::ply::Encoding;
use rayon::prelude::*;
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Chunks, evenly spread, from which the kind of the colours is guessed.
const SAMPLED_CHUNKS: usize = 8;

/// The points of a LAS file.
#[derive(Debug)]
pub(super) struct LasPoints {
    /// Their records.
    pub(super) bytes: MappedFile,
    /// What they are: one element `vertex` with `x`, `y`, `z`, colours if there are any, `classification`, and
    /// `skipped`, which is 1 for noise and for points that the file takes for deleted.
    pub(super) header: PlyHeader,
    /// Points of classes 7 and 18.
    pub(super) noise: u64,
    /// Points with the flag `withheld`.
    pub(super) withheld: u64,
    /// Such as `LAZ 1.4, point format 7`.
    pub(super) format: String,
    pub(super) crs: CloudCrs,
    /// Steps of the coordinates.
    pub(super) scale: [f64; 3],
    /// Lowest and highest coordinates of the points. Those that the header states are often wrong, and not used.
    pub(super) bounds: ([f64; 3], [f64; 3]),
    /// Bytes behind the last point that nothing declares.
    pub(super) trailing_bytes: u64,
    pub(super) warnings: Vec<Warning>,
}

/// Reads all points into a scratch file in the system's folder for such files.
///
/// # Errors
/// The file is no LAS, of a version or point format that nobody knows, damaged or cut off, or the scratch file cannot
/// be written.
pub(super) fn decode(path: &str, source: &MappedFile, progress: &Progress<'_>) -> Result<LasPoints, OpenError> {
    let file = LasFile::parse(Source { path, bytes: source })?;
    let mut warnings = Vec::new();
    // Nearly always right, and checked against every point.
    let guess = guess_colors(&file)?;
    let (mut scratch, mut tally) = decode_as(&file, guess, progress)?;
    let colors = tally.colors();
    if colors != guess {
        (scratch, tally) = decode_as(&file, colors, progress)?;
    }
    if file.format.has_color && colors == Colors::None {
        warnings.push(Warning::ColorsAllZero { path: path.to_owned() });
    }
    source.check_not_rewritten(Path::new(path))?;
    let bytes = MappedFile::of_scratch(&scratch, source.stamp()).map_err(|e| unwritten(&file, e))?;
    let header = PlyHeader {
        encoding: Encoding::BinaryLittleEndian,
        elements: vec![element(file.points, colors)],
        comments: Vec::new(),
        payload: 0,
        lines: 0,
        skipped: Vec::new(),
    };
    let axes = file.transforms();
    let axes = [axes.x, axes.y, axes.z];
    let corner = |raw: [i32; 3]| [0, 1, 2].map(|axis| axes[axis].direct(raw[axis]));
    let (one, other) = (corner(tally.lowest), corner(tally.highest));
    // A negative scale turns an axis around.
    let bounds = ([0, 1, 2].map(|i| one[i].min(other[i])), [0, 1, 2].map(|i| one[i].max(other[i])));
    Ok(LasPoints {
        bytes,
        header,
        noise: tally.noise,
        withheld: tally.withheld,
        format: file.format_name(),
        crs: file.crs(),
        scale: axes.map(|axis| axis.scale),
        bounds,
        trailing_bytes: file.trailing_bytes,
        warnings,
    })
}

/// The fields that are kept: layers of others are not unpacked.
fn fields() -> DecompressionSelection {
    DecompressionSelection::xy_returns_channel()
        .decompress_z()
        .decompress_classification()
        .decompress_flags()
        .decompress_rgb()
}

fn unwritten(file: &LasFile<'_>, source: std::io::Error) -> OpenError {
    let folder = std::env::temp_dir().display().to_string();
    OpenError::Scratch { path: file.source.path.to_owned(), folder, source }
}

/// Looks at the first points of a few chunks.
fn guess_colors(file: &LasFile<'_>) -> Result<Colors, OpenError> {
    let mut converter = Converter::new(file, Colors::None);
    let mut unused = Vec::new();
    for chunk in file.chunks.iter().step_by(file.chunks.len().div_ceil(SAMPLED_CHUNKS).max(1)) {
        if !file.format.has_color {
            break;
        }
        let mut seen = false;
        let looked = file.each_slab(chunk, fields(), |_, slab| {
            if seen {
                return Err(Stop::Enough);
            }
            seen = true;
            converter.convert(slab, &mut unused);
            Ok(())
        });
        if let Err(Stop::Failed(error)) = looked {
            return Err(error);
        }
    }
    Ok(converter.tally.colors())
}

/// Why a look at a chunk ended early.
enum Stop {
    Enough,
    Failed(OpenError),
}

impl From<OpenError> for Stop {
    fn from(error: OpenError) -> Stop {
        Stop::Failed(error)
    }
}

/// Writes the records of all points. Of several damaged chunks the first is told, whichever thread comes first.
fn decode_as(file: &LasFile<'_>, colors: Colors, progress: &Progress<'_>) -> Result<(File, Tally), OpenError> {
    let scratch = Mutex::new(tempfile::tempfile().map_err(|e| unwritten(file, e))?);
    let first_failed = AtomicUsize::new(usize::MAX);
    let work = |(index, chunk): (usize, &Chunk)| {
        if index > first_failed.load(Ordering::Relaxed) {
            return Ok(Tally::default());
        }
        let tally = decode_chunk(file, chunk, colors, &scratch);
        if tally.is_err() {
            first_failed.fetch_min(index, Ordering::Relaxed);
        }
        file.source.passed(progress, chunk.bytes.len() as u64);
        tally
    };
    let tallies: Vec<Result<Tally, OpenError>> = file.chunks.par_iter().enumerate().map(work).collect();
    let mut whole = Tally::default();
    for tally in tallies {
        whole.add(&tally?);
    }
    Ok((scratch.into_inner().unwrap_or_else(PoisonError::into_inner), whole))
}

fn decode_chunk(file: &LasFile<'_>, chunk: &Chunk, colors: Colors, scratch: &Mutex<File>) -> Result<Tally, OpenError> {
    let mut converter = Converter::new(file, colors);
    let mut records = Vec::new();
    file.each_slab(chunk, fields(), |first, slab| {
        converter.convert(slab, &mut records);
        let mut to = scratch.lock().unwrap_or_else(PoisonError::into_inner);
        let written =
            to.seek(SeekFrom::Start(first * record_bytes(colors) as u64)).and_then(|_| to.write_all(&records));
        written.map_err(|e| unwritten(file, e))
    })?;
    Ok(converter.tally)
}
