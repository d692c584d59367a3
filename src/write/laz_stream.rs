//! A LAZ file that is written point by point, with a label behind each record.

use super::atomic::Pending;
use super::{WriteError, extra_bytes::with_grain_id};
use crate::open::{LASZIP_RECORD, MINOR_VERSION_AT, laz_items};
use las::point::Format;
use las::raw;
use laz::{LazItemRecordBuilder, LazVlrBuilder, ParLasZipCompressor};
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};

/// Bytes of a label.
const LABEL_BYTES: u16 = 4;
/// Points that are packed as one chunk, as LASzip has it.
const CHUNK_POINTS: u32 = 50_000;
/// What a compressed file has in the byte of its point format.
const COMPRESSED: u8 = 0x80;
/// The record that describes extra bytes.
pub(super) const EXTRA_BYTES_RECORD: (&str, u16) = ("LASF_Spec", 4);
/// Longest record of variable length.
const LONGEST_RECORD: usize = u16::MAX as usize;
/// Places of the counts of points by return.
const RETURNS: usize = 15;

/// What is to be written besides the points.
pub(super) struct Declared<'a> {
    /// Header of the points as they come in; counts, bounds and lengths are found out.
    pub(super) header: raw::Header,
    pub(super) minor: u8,
    /// Format of the points as they come in.
    pub(super) format: Format,
    /// Records of variable length that are kept, with their heads.
    pub(super) records: Vec<&'a [u8]>,
    /// Descriptions of the extra bytes that come in.
    pub(super) described: &'a [u8],
}

/// What was seen among the points.
struct Seen {
    points: u64,
    by_return: [u64; RETURNS],
    lowest: [i32; 3],
    highest: [i32; 3],
}

/// A file being written.
pub(super) struct LazStream<'a> {
    file: &'a Pending,
    to: ParLasZipCompressor<BufWriter<File>>,
    header: raw::Header,
    minor: u8,
    extended: bool,
    number: u8,
    waiting: Vec<u8>,
    enough: usize,
    seen: Seen,
}

impl<'a> LazStream<'a> {
    /// Writes everything before the points.
    pub(super) fn begin(file: &'a Pending, declared: Declared<'_>) -> Result<LazStream<'a>, WriteError> {
        let Declared { mut header, minor, mut format, records, described } = declared;
        let failed = |source| file.error("write the labelled cloud", source);
        let bytes = header.point_data_record_length;
        let too_long = || WriteError::CloudRecord { path: file.target.clone(), bytes };
        let record_bytes = bytes.checked_add(LABEL_BYTES).ok_or_else(too_long)?;
        // Descriptions that do not fit the points are of no use to anybody.
        let extra = usize::from(format.extra_bytes);
        let described = with_grain_id(described, extra).or_else(|| with_grain_id(&[], extra));
        let described = described.filter(|d| d.len() <= LONGEST_RECORD).ok_or_else(too_long)?;
        let number = header.point_data_record_format & !COMPRESSED;
        format.extra_bytes += LABEL_BYTES;
        let mut items = LazItemRecordBuilder::new();
        for item in laz_items(&format) {
            items.add_item(item);
        }
        let laszip = LazVlrBuilder::new(items.build()).with_fixed_chunk_size(CHUNK_POINTS).build();
        let mut packing = Vec::new();
        laszip.write_to(&mut packing).map_err(failed)?;
        let mut all: Vec<u8> = records.concat();
        all.extend(variable_record(EXTRA_BYTES_RECORD, "extra bytes of the points", &described));
        all.extend(variable_record(LASZIP_RECORD, "", &packing));
        if header.version.requires_point_data_start_signature() {
            all.extend(raw::POINT_DATA_START_SIGNATURE);
        }
        header.point_data_record_format = number | COMPRESSED;
        header.point_data_record_length = record_bytes;
        header.number_of_variable_length_records = records.len() as u32 + 2;
        let offset = u64::from(header.header_size) + all.len() as u64;
        header.offset_to_point_data = u32::try_from(offset).map_err(|_| too_long())?;
        header.evlr = None;
        header.start_of_waveform_data_packet_record = None;
        header.generating_software = [0; 32];
        let name = concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION"));
        header.generating_software.iter_mut().zip(name.bytes()).for_each(|(to, byte)| *to = byte);
        let mut to = BufWriter::with_capacity(1 << 20, File::create(&file.partial).map_err(failed)?);
        // Written once more at the end, when the counts are known.
        to.write_all(&header_bytes(&header, minor).map_err(failed)?).map_err(failed)?;
        to.write_all(&all).map_err(failed)?;
        let to = ParLasZipCompressor::new(to, laszip).map_err(|e| failed(io::Error::other(e.to_string())))?;
        // A chunk for each thread; the file does not depend on it, since chunks are packed one by one.
        let enough = rayon::current_num_threads() * CHUNK_POINTS as usize * usize::from(record_bytes);
        let seen = Seen { points: 0, by_return: [0; RETURNS], lowest: [i32::MAX; 3], highest: [i32::MIN; 3] };
        let extended = format.is_extended;
        Ok(LazStream { file, to, header, minor, extended, number, waiting: Vec::with_capacity(enough), enough, seen })
    }

    /// One more point.
    pub(super) fn put(&mut self, record: &[u8], label: i32) -> Result<(), WriteError> {
        let seen = &mut self.seen;
        seen.points += 1;
        for axis in 0..3 {
            let at = 4 * axis;
            let whole = i32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]]);
            seen.lowest[axis] = seen.lowest[axis].min(whole);
            seen.highest[axis] = seen.highest[axis].max(whole);
        }
        let of_return = usize::from(record[14] & if self.extended { 15 } else { 7 });
        if let Some(count) = of_return.checked_sub(1).and_then(|i| seen.by_return.get_mut(i)) {
            *count += 1;
        }
        self.waiting.extend_from_slice(record);
        self.waiting.extend(label.to_le_bytes());
        if self.waiting.len() >= self.enough { self.pack() } else { Ok(()) }
    }

    fn pack(&mut self) -> Result<(), WriteError> {
        let packed = self.to.compress_many(&self.waiting);
        self.waiting.clear();
        packed.map_err(|e| self.file.error("write the labelled cloud", e))
    }

    /// Writes what comes behind the points: extended records, of which one may hold waveforms. Then the header.
    pub(super) fn finish(mut self, extended: &[&[u8]], waveforms: Option<usize>) -> Result<(), WriteError> {
        self.pack()?;
        let LazStream { file, mut to, mut header, minor, seen, number, .. } = self;
        let failed = |source| file.error("write the labelled cloud", source);
        to.done().map_err(|e| failed(io::Error::other(e.to_string())))?;
        let mut to = to.into_inner();
        let mut at = to.stream_position().map_err(failed)?;
        let first = at;
        for (index, record) in extended.iter().enumerate() {
            if waveforms == Some(index) {
                header.start_of_waveform_data_packet_record = Some(at);
            }
            to.write_all(record).map_err(failed)?;
            at += record.len() as u64;
        }
        let listed = u32::try_from(extended.len()).unwrap_or(u32::MAX);
        if minor >= 4 && listed > 0 {
            header.evlr = Some(raw::header::Evlr { start_of_first_evlr: first, number_of_evlrs: listed });
        }
        seen.declare(&mut header, number);
        let header = header_bytes(&header, minor).map_err(failed)?;
        to.seek(SeekFrom::Start(0)).and_then(|_| to.write_all(&header)).and_then(|()| to.flush()).map_err(failed)
    }
}

impl Seen {
    fn declare(&self, header: &mut raw::Header, number: u8) {
        // Since 1.4 the narrow counts are for old readers, which do not know formats above 5.
        let narrow = number < 6 && self.points <= u64::from(u32::MAX);
        header.number_of_point_records = if narrow { self.points as u32 } else { 0 };
        for (narrow_count, &count) in header.number_of_points_by_return.iter_mut().zip(&self.by_return) {
            *narrow_count = if narrow { count as u32 } else { 0 };
        }
        if let Some(large) = &mut header.large_file {
            large.number_of_point_records = self.points;
            large.number_of_points_by_return = self.by_return;
        }
        let axis = |axis: usize, scale: f64, offset: f64| {
            let [a, b] = [self.lowest[axis], self.highest[axis]].map(|whole| f64::from(whole) * scale + offset);
            (a.min(b), a.max(b))
        };
        (header.min_x, header.max_x) = axis(0, header.x_scale_factor, header.x_offset);
        (header.min_y, header.max_y) = axis(1, header.y_scale_factor, header.y_offset);
        (header.min_z, header.max_z) = axis(2, header.z_scale_factor, header.z_offset);
    }
}

/// The header as it stands in a file. Version 1.5 is written as 1.4, of which it has all and a few bytes more.
fn header_bytes(header: &raw::Header, minor: u8) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    header.write_to(&mut bytes).map_err(|e| io::Error::other(e.to_string()))?;
    bytes[MINOR_VERSION_AT] = minor;
    Ok(bytes)
}

/// A record of variable length with its head.
pub(super) fn variable_record((user, number): (&str, u16), description: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; 54];
    bytes[2..2 + user.len()].copy_from_slice(user.as_bytes());
    bytes[18..20].copy_from_slice(&number.to_le_bytes());
    bytes[20..22].copy_from_slice(&(data.len() as u16).to_le_bytes());
    bytes[22..22 + description.len()].copy_from_slice(description.as_bytes());
    bytes.extend(data);
    bytes
}
