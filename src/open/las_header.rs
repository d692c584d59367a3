//! What a LAS or LAZ file declares, held against its length before anything is believed.
//!
//! LAS 1.0 to 1.5, ASPRS. Version 1.5 only adds 18 bytes behind the header of 1.4. Nothing is allocated by a length
//! that the file declares: records of variable length are slices of the file.

use super::error::OpenError;
use super::las_crs::CloudCrs;
use super::laz_chunks::{Chunk, Compression};
use super::mapped::MappedFile;
use super::records::Source;
use las::point::Format;
use las::{Transform, Vector, Version, raw};
use std::ops::Range;
use std::path::Path;

/// The four bytes that every LAS file starts with.
pub(super) const SIGNATURE: &[u8] = b"LASF";
/// Bytes of the fixed part that tells the version and the length of the header.
const PREFIX_BYTES: usize = 227;
/// Bytes before the data of a record of variable length, and of an extended one.
const VLR_BYTES: usize = 54;
const EVLR_BYTES: usize = 60;
/// Where a header has its minor version.
pub(crate) const MINOR_VERSION_AT: usize = 25;
/// Bits of the point format byte that hold its number.
const FORMAT_BITS: u8 = 0x3f;
/// The last point format there is.
const LAST_FORMAT: u8 = 10;
/// The `laszip encoded` record that says how points are compressed.
pub(crate) const LASZIP_RECORD: (&str, u16) = ("laszip encoded", 22204);

/// Who defined the records of an octree, and the one that makes a LAZ file a cloud-optimised one.
pub(crate) const COPC_USER: &str = "copc";
const COPC_INFO: (&str, u16) = (COPC_USER, 1);
/// The record of waveforms.
const WAVEFORMS: (&str, u16) = ("LASF_Spec", 65535);

/// A LAS or LAZ file that is mapped and not yet looked at.
#[derive(Debug)]
pub(crate) struct LasInput {
    path: String,
    bytes: MappedFile,
}

impl LasInput {
    /// Maps the file.
    ///
    /// # Errors
    /// It cannot be read.
    pub(crate) fn open(path: &Path) -> Result<LasInput, OpenError> {
        Ok(LasInput { path: path.display().to_string(), bytes: MappedFile::open(path)? })
    }

    /// What it declares.
    ///
    /// # Errors
    /// As [`LasFile::parse`].
    pub(crate) fn parse(&self) -> Result<LasFile<'_>, OpenError> {
        LasFile::parse(Source { path: &self.path, bytes: &self.bytes })
    }
}

/// A record of variable length: who it is for, and its bytes in the file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VariableRecord<'a> {
    /// Byte of the file at which it starts.
    pub(crate) at: usize,
    /// Who defined it, without the zeros behind.
    pub(crate) user: &'a [u8],
    pub(crate) number: u16,
    pub(crate) data: &'a [u8],
    /// Head and data, as they stand in the file.
    pub(crate) whole: &'a [u8],
}

impl VariableRecord<'_> {
    /// Whether it is the record of this user and number. Writers differ in upper and lower case.
    pub(crate) fn is(&self, (user, number): (&str, u16)) -> bool {
        self.number == number && self.is_of(user)
    }

    /// Whether this user defined it.
    pub(crate) fn is_of(&self, user: &str) -> bool {
        self.user.eq_ignore_ascii_case(user.as_bytes())
    }
}

/// A file whose declarations agree with its length.
pub(crate) struct LasFile<'a> {
    pub(super) source: Source<'a>,
    /// The header; version 1.5 reads as 1.4 here.
    pub(crate) header: raw::Header,
    /// Minor version as the file has it.
    pub(crate) minor: u8,
    /// Point format, 0 to 10.
    pub(crate) number: u8,
    pub(crate) format: Format,
    pub(crate) points: u64,
    pub(crate) records: Vec<VariableRecord<'a>>,
    pub(crate) extended: Vec<VariableRecord<'a>>,
    /// Runs of points that are read one by one.
    pub(crate) chunks: Vec<Chunk>,
    pub(super) compression: Option<Compression>,
    /// Bytes behind the last point that nothing declares.
    pub(super) trailing_bytes: u64,
}

impl<'a> LasFile<'a> {
    /// Reads the header, the records of variable length and, for LAZ, where its chunks lie.
    ///
    /// # Errors
    /// No LAS, an unknown version or point format, a header or a chunk table that contradicts the file, points that
    /// are not there.
    pub(super) fn parse(source: Source<'a>) -> Result<LasFile<'a>, OpenError> {
        let damaged = |reason: String| OpenError::LasHeader { path: source.path.to_owned(), reason };
        let (header, minor) = fixed_header(source)?;
        let (number, format) = point_format(source, &header)?;
        check_transforms(source, &header)?;
        let bytes: &'a [u8] = source.bytes;
        let start = u64::from(header.offset_to_point_data);
        if start < u64::from(header.header_size) || start > bytes.len() as u64 {
            return Err(damaged(format!(
                "the points start at byte {start}, but the header ends at byte {} and the file at byte {}",
                header.header_size,
                bytes.len()
            )));
        }
        let records = read_records(
            bytes,
            usize::from(header.header_size)..start as usize,
            header.number_of_variable_length_records,
            false,
        )
        .map_err(&damaged)?;
        let extended = match header.evlr {
            None => Vec::new(),
            Some(evlr) => {
                let first = usize::try_from(evlr.start_of_first_evlr).unwrap_or(usize::MAX).min(bytes.len());
                read_records(bytes, first..bytes.len(), evlr.number_of_evlrs, true).map_err(&damaged)?
            }
        };
        let mut file = LasFile {
            points: declared_points(&header),
            source,
            header,
            minor,
            number,
            format,
            records,
            extended,
            chunks: Vec::new(),
            compression: None,
            trailing_bytes: 0,
        };
        if format.is_compressed {
            let laszip = file.records.iter().find(|r| r.is(LASZIP_RECORD));
            let laszip = laszip.ok_or_else(|| damaged("it says LAZ, but has no record `laszip encoded`".to_owned()))?;
            let compression = Compression::parse(&file, laszip.data)?;
            file.chunks = compression.locate(&file)?;
            file.compression = Some(compression);
        } else {
            file.trailing_bytes = file.check_length()?;
            file.chunks = Chunk::plain(start, file.record_bytes() as u64, file.points);
        }
        if file.points == 0 {
            return Err(OpenError::NoVertices { path: source.path.to_owned() });
        }
        Ok(file)
    }

    /// Name of the format, version and point format.
    pub(crate) fn format_name(&self) -> String {
        let kind = if self.format.is_compressed { "LAZ" } else { "LAS" };
        let copc = if self.records.iter().any(|r| r.is(COPC_INFO)) { " (COPC)" } else { "" };
        format!("{kind} 1.{}{copc}, point format {}", self.minor, self.number)
    }

    /// Bytes of a point record.
    pub(crate) fn record_bytes(&self) -> usize {
        usize::from(self.header.point_data_record_length)
    }

    /// The CRS as the file states it.
    pub(crate) fn crs(&self) -> CloudCrs {
        CloudCrs::of(self)
    }

    /// The record of waveforms, where they lie in the same file. Version 1.3 does not list it.
    pub(crate) fn waveforms(&self) -> Option<VariableRecord<'a>> {
        let bytes: &'a [u8] = self.source.bytes;
        let at = usize::try_from(self.header.start_of_waveform_data_packet_record?).ok()?.min(bytes.len());
        read_records(bytes, at..bytes.len(), 1, true).ok()?.pop().filter(|r| r.is(WAVEFORMS))
    }

    /// How whole numbers become coordinates.
    pub(crate) fn transforms(&self) -> Vector<Transform> {
        let h = &self.header;
        let axis = |scale, offset| Transform { scale, offset };
        Vector {
            x: axis(h.x_scale_factor, h.x_offset),
            y: axis(h.y_scale_factor, h.y_offset),
            z: axis(h.z_scale_factor, h.z_offset),
        }
    }

    /// The error that the points of the file are not those that its header declares.
    pub(super) fn miscounted(&self, found: u64) -> OpenError {
        let (path, bytes) = (self.source.path.to_owned(), self.source.bytes.len() as u64);
        OpenError::LasCount { path, bytes, declared: self.points, found }
    }

    /// Holds the number of uncompressed points against the length of the file. Returns how many bytes lie behind them.
    fn check_length(&self) -> Result<u64, OpenError> {
        let (start, record) = (u64::from(self.header.offset_to_point_data), self.record_bytes() as u64);
        let behind = self.header.evlr.map(|e| e.start_of_first_evlr);
        let waveforms = self.header.start_of_waveform_data_packet_record;
        let declared_end = [behind, waveforms].into_iter().flatten().filter(|&at| at > start).min();
        let room = declared_end.unwrap_or(u64::MAX).min(self.source.bytes.len() as u64) - start;
        let free = self.points.checked_mul(record).and_then(|taken| room.checked_sub(taken));
        match free {
            None => Err(self.miscounted(room / record)),
            // A writer that stopped early leaves whole points that it did not count.
            Some(free) if free > 0 && free % record == 0 && declared_end.is_none() => {
                Err(self.miscounted(room / record))
            }
            // Some padding is allowed before extended records.
            Some(free) if free < record || declared_end.is_some() => Ok(0),
            Some(free) => Ok(free),
        }
    }
}

/// The header by the grammar of the `las` crate, and the minor version.
fn fixed_header(source: Source<'_>) -> Result<(raw::Header, u8), OpenError> {
    let (path, bytes) = (source.path, source.bytes);
    let damaged = |reason: String| OpenError::LasHeader { path: path.to_owned(), reason };
    if !bytes.starts_with(SIGNATURE) {
        let start = String::from_utf8_lossy(&bytes[..bytes.len().min(SIGNATURE.len())]);
        return Err(OpenError::NotLas { path: path.to_owned(), start: printable(&start) });
    }
    if bytes.len() < PREFIX_BYTES {
        return Err(damaged(format!("the file ends at byte {}, within it", bytes.len())));
    }
    let (major, minor) = (bytes[MINOR_VERSION_AT - 1], bytes[MINOR_VERSION_AT]);
    if major != 1 || minor > 5 {
        return Err(OpenError::LasVersion { path: path.to_owned(), major, minor });
    }
    let length = usize::from(u16::from_le_bytes([bytes[94], bytes[95]]));
    let least = usize::from(Version::new(1, minor.min(4)).header_size());
    if length < least || length > bytes.len() {
        return Err(damaged(format!(
            "it says that it has {length} bytes, but version 1.{minor} needs {least}, and the file has {}",
            bytes.len()
        )));
    }
    let mut copy = bytes[..length].to_vec();
    copy[MINOR_VERSION_AT] = minor.min(4);
    let header = raw::Header::read_from(copy.as_slice()).map_err(|e| damaged(printable(&e.to_string())))?;
    Ok((header, minor))
}

/// Points of the file. The older, narrower count may be 0 since version 1.4, and is not kept up by every writer.
fn declared_points(header: &raw::Header) -> u64 {
    let narrow = u64::from(header.number_of_point_records);
    header.large_file.map(|l| l.number_of_point_records).filter(|&n| n > 0).unwrap_or(narrow)
}

fn point_format(source: Source<'_>, header: &raw::Header) -> Result<(u8, Format), OpenError> {
    let path = || source.path.to_owned();
    let (declared, length) = (header.point_data_record_format, header.point_data_record_length);
    let number = declared & FORMAT_BITS;
    let unknown = || OpenError::LasFormat { path: path(), number: declared };
    if number > LAST_FORMAT {
        return Err(unknown());
    }
    let mut format = Format::new(number).map_err(|_| unknown())?;
    format.is_compressed = declared & !FORMAT_BITS != 0;
    let Some(extra) = length.checked_sub(format.len()) else {
        return Err(OpenError::LasHeader {
            path: path(),
            reason: format!("its points have {length} bytes, but those of format {number} have {}", format.len()),
        });
    };
    format.extra_bytes = extra;
    Ok((number, format))
}

/// Scales and offsets that make a finite number of every whole one.
fn check_transforms(source: Source<'_>, header: &raw::Header) -> Result<(), OpenError> {
    let axes = [
        ('x', header.x_scale_factor, header.x_offset),
        ('y', header.y_scale_factor, header.y_offset),
        ('z', header.z_scale_factor, header.z_offset),
    ];
    for (axis, scale, offset) in axes {
        let far = |raw: i32| (f64::from(raw) * scale + offset).is_finite();
        // Steps may be finer than doubles are there, as writers choose that scale to the full range of their counts.
        let lost = offset + scale * FINE_STEPS == offset;
        if !scale.is_normal() || lost || !far(i32::MIN) || !far(i32::MAX) {
            return Err(OpenError::LasTransform { path: source.path.to_owned(), axis, scale, offset });
        }
    }
    Ok(())
}

/// So many steps of the scale must make a difference.
const FINE_STEPS: f64 = 65_536.0;

/// Records of variable length, one behind the other.
fn read_records(
    bytes: &[u8],
    within: Range<usize>,
    count: u32,
    extended: bool,
) -> Result<Vec<VariableRecord<'_>>, String> {
    let (kind, head) = if extended { ("extended record", EVLR_BYTES) } else { ("record", VLR_BYTES) };
    let (mut records, mut at) = (Vec::new(), within.start);
    for index in 0..count {
        let room = within.end - at;
        let cut = || format!("{kind} {index} of {count} at byte {at} does not end before byte {}", within.end);
        let start = bytes.get(at..at + head.min(room)).filter(|s| s.len() == head).ok_or_else(cut)?;
        let mut length = [0; 8];
        let length_bytes = if extended { 8 } else { 2 };
        length[..length_bytes].copy_from_slice(&start[20..20 + length_bytes]);
        let length = usize::try_from(u64::from_le_bytes(length)).ok().filter(|&l| l <= room - head);
        let whole = &bytes[at..at + head + length.ok_or_else(cut)?];
        let user = &start[2..18];
        let user = &user[..user.iter().position(|&b| b == 0).unwrap_or(user.len())];
        records.push(VariableRecord {
            at,
            user,
            number: u16::from_le_bytes([start[18], start[19]]),
            data: &whole[head..],
            whole,
        });
        at += whole.len();
    }
    Ok(records)
}

/// Text of a file or of a crate, fit for a message: it may hold any bytes.
pub(super) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() || c == char::REPLACEMENT_CHARACTER { '?' } else { c }).take(120).collect()
}
