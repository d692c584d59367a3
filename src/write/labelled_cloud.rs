//! `labelled_cloud.laz`: the input points again, in their order, with the grain of each.
//!
//! Points of LAS and LAZ keep everything: point format, scale, offset, CRS, all records of variable length and all
//! fields, bit for bit; `grain_id` (int, -1 in no grain) comes behind them as a described extra dimension. Only what a
//! COPC file says of its octree goes, since points of other order and length make no octree. Points of other inputs
//! become LAZ 1.4 in map coordinates.

use super::atomic::Pending;
use super::labelled_mesh::{triangle_labels, vertex_labels};
use super::laz_stream::{Declared, EXTRA_BYTES_RECORD, LazStream, variable_record};
use super::{MeshSource, Results, WriteError};
use crate::open::{COPC_USER, Frame, LASZIP_RECORD, LasInput, Reach, VariableRecord};
use las::point::Format;
use las::raw;
use laz::DecompressionSelection;
use std::ops::Range;
use std::path::Path;

/// No grain.
const NONE: i32 = -1;
/// The record that holds WKT, and the bit of the global encoding that says so.
const WKT_RECORD: (&str, u16) = ("LASF_Projection", 2112);
const WKT_BIT: u16 = 16;
/// Finest step of the coordinates of other inputs, map units. A survey too wide for it gets the next power of ten.
const FINEST_STEP: f64 = 1e-5;

/// What was written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LabelledCloud {
    /// Points.
    pub(crate) points: u64,
    /// Points with a grain.
    pub(crate) in_grains: u64,
    /// Steps of the coordinates.
    pub(crate) scale: [f64; 3],
}

/// Writes the points of the survey again: those of a single LAS or LAZ file with all that the file holds, others in map
/// coordinates, all files in one.
pub(super) fn write(file: &Pending, results: &Results, mesh: &dyn MeshSource) -> Result<(), WriteError> {
    let Some(reach) = results.cloud else { return Ok(()) };
    let (labels, _) = vertex_labels(mesh, &triangle_labels(results, mesh)?)?;
    let label = |point: u64| labels[point as usize];
    match reach.files() {
        [only] if only.is_las() => {
            let label = |point: u64| labels.get(point as usize).copied().unwrap_or(NONE);
            let written = write_las(file, only.path(), &label)?;
            if written.points == reach.vertices() { Ok(written) } else { Err(changed(file)) }
        }
        _ => write_vertices(file, reach, 0..reach.vertices(), &label),
    }
    .map(|_| ())
}

fn changed(file: &Pending) -> WriteError {
    file.error("write the labelled cloud", std::io::Error::other("the input has other points than when the run began"))
}

/// Writes the points of a LAS or LAZ file again. `label` gives the grain of a point by its number in the file, or -1.
/// A few chunks of points are in memory at once.
///
/// # Errors
/// The input cannot be read any more, its points have no room for a label, or the file cannot be written.
pub(crate) fn write_las(file: &Pending, input: &Path, label: &dyn Fn(u64) -> i32) -> Result<LabelledCloud, WriteError> {
    let input = LasInput::open(input)?;
    let source = input.parse()?;
    let all = || source.records.iter().chain(&source.extended);
    let described = all().find(|r| r.is(EXTRA_BYTES_RECORD)).map_or(&[][..], |r| r.data);
    let kept = |r: &&VariableRecord<'_>| !r.is(EXTRA_BYTES_RECORD) && !r.is(LASZIP_RECORD) && !r.is_of(COPC_USER);
    let records = source.records.iter().filter(kept).map(|r| r.whole).collect();
    let mut to = LazStream::begin(
        file,
        Declared { header: source.header.clone(), minor: source.minor, format: source.format, records, described },
    )?;
    let mut in_grains = 0;
    for chunk in &source.chunks {
        source.each_slab(chunk, DecompressionSelection::all(), |first, slab| -> Result<(), WriteError> {
            for (record, point) in slab.chunks_exact(source.record_bytes()).zip(first..) {
                let label = label(point);
                in_grains += u64::from(label != NONE);
                to.put(record, label)?;
            }
            Ok(())
        })?;
    }
    let mut extended: Vec<&VariableRecord<'_>> = source.extended.iter().filter(kept).collect();
    let waveforms = source.waveforms();
    if let Some(waveforms) = &waveforms
        && extended.iter().all(|r| r.at != waveforms.at)
    {
        extended.push(waveforms);
    }
    let place = waveforms.and_then(|waveforms| extended.iter().position(|r| r.at == waveforms.at));
    let extended: Vec<&[u8]> = extended.iter().map(|r| r.whole).collect();
    to.finish(&extended, place)?;
    let scale = [source.header.x_scale_factor, source.header.y_scale_factor, source.header.z_scale_factor];
    Ok(LabelledCloud { points: source.points, in_grains, scale })
}

/// Writes vertices of a survey as points in map coordinates, with their colours. `label` gives the grain of a vertex of
/// the survey, or -1. Coordinates step by 1e-5 map units, or by the least power of ten that lets 32 bits span them.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write_vertices(
    file: &Pending,
    reach: &Reach,
    vertices: Range<u64>,
    label: &dyn Fn(u64) -> i32,
) -> Result<LabelledCloud, WriteError> {
    let frame = reach.frame();
    let (lowest, highest) = reach.input_bounds();
    let [low, high] = [lowest, highest].map(|corner| frame.position(frame.local(corner)));
    let origin = low.map(f64::floor);
    let extent = (0..3).map(|axis| high[axis] - origin[axis]).fold(0.0, f64::max);
    let step = step_for(extent);
    let number = if reach.has_colors() { 7 } else { 6 };
    let format = Format::new(number)
        .map_err(|e| file.error("write the labelled cloud", std::io::Error::other(e.to_string())))?;
    // A longer text has no room in a record.
    let crs = frame.crs.as_ref().filter(|crs| crs.wkt.len() < usize::from(u16::MAX));
    let wkt = crs.map(|crs| variable_record(WKT_RECORD, "", format!("{}\0", crs.wkt).as_bytes()));
    let records = wkt.iter().map(Vec::as_slice).collect();
    let header = header(frame, origin, step, format.len(), number);
    let mut to = LazStream::begin(file, Declared { header, minor: 4, format, records, described: &[] })?;
    let mut written = LabelledCloud { points: vertices.end - vertices.start, in_grains: 0, scale: [step; 3] };
    let mut record = Vec::new();
    for vertex in vertices {
        let place = frame.position(reach.position(vertex));
        record.clear();
        record.extend((0..3).flat_map(|i| (((place[i] - origin[i]) / step).round() as i32).to_le_bytes()));
        // The first of one return, and nothing else.
        record.extend([0, 0, 0b0001_0001]);
        record.resize(30, 0);
        if let Some(color) = reach.color(vertex) {
            record.extend(color.iter().flat_map(|&share| ((share * 65_535.0).round() as u16).to_le_bytes()));
        }
        let label = label(vertex);
        written.in_grains += u64::from(label != NONE);
        to.put(&record, label)?;
    }
    to.finish(&[], None)?;
    Ok(written)
}

/// The finest step in which 32 bits span an extent.
fn step_for(extent: f64) -> f64 {
    let mut step = FINEST_STEP;
    while extent / step >= f64::from(i32::MAX) {
        step *= 10.0;
    }
    step
}

fn header(frame: &Frame, origin: [f64; 3], step: f64, record_bytes: u16, number: u8) -> raw::Header {
    raw::Header {
        version: (1, 4).into(),
        header_size: las::Version::new(1, 4).header_size(),
        global_encoding: if frame.crs.is_some() { WKT_BIT } else { 0 },
        point_data_record_format: number,
        point_data_record_length: record_bytes,
        x_scale_factor: step,
        y_scale_factor: step,
        z_scale_factor: step,
        x_offset: origin[0],
        y_offset: origin[1],
        z_offset: origin[2],
        large_file: Some(raw::header::LargeFile::default()),
        ..raw::Header::default()
    }
}
