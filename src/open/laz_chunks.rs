//! LAZ: where the chunks of a file lie, and the points of one of them.
//!
//! Chunks are compressed one by one, so that each thread reads one of its own. The table that says where they lie, and
//! the lengths of the layers within each, are held against the file before a decoder sees them: it would allocate
//! whatever they say.

use super::error::OpenError;
use super::las_header::{LasFile, printable};
use super::quiet::catch_quietly;
use las::point::Format;
use laz::laszip::ChunkTable;
use laz::record::{LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor};
use laz::{DecompressionSelection, LazItemType, LazVlr};
use std::io::Cursor;
use std::ops::Range;

/// Points that are decoded at once.
pub(crate) const SLAB_POINTS: u64 = 1 << 14;
/// Points of a run of an uncompressed file.
const PLAIN_POINTS: u64 = 1 << 16;
/// Bytes before the first chunk that say where the table is.
const TABLE_OFFSET_BYTES: u64 = 8;

/// A run of points that can be read without any other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Chunk {
    pub(crate) first_point: u64,
    pub(crate) points: u64,
    pub(crate) bytes: Range<usize>,
}

impl Chunk {
    /// Runs of an uncompressed file, whose length was checked.
    pub(super) fn plain(start: u64, record: u64, points: u64) -> Vec<Chunk> {
        let firsts = (0..points).step_by(PLAIN_POINTS as usize);
        let chunk = |first_point| {
            let count = PLAIN_POINTS.min(points - first_point);
            let at = |point| (start + point * record) as usize;
            Chunk { first_point, points: count, bytes: at(first_point)..at(first_point + count) }
        };
        firsts.map(chunk).collect()
    }
}

/// How the chunks of a file hang together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    /// One stream of all points (LASzip 1).
    Stream,
    /// Chunks of points one behind the other (LASzip 2).
    Points,
    /// Chunks of layers, one for each kind of field (LASzip 3).
    Layers,
}

/// The `laszip encoded` record.
pub(super) struct Compression {
    record: LazVlr,
    layout: Layout,
    layers: usize,
}

impl Compression {
    /// Reads the record, and sees that it packs points of the file's format.
    pub(super) fn parse(file: &LasFile<'_>, data: &[u8]) -> Result<Compression, OpenError> {
        let refused = |reason: String| OpenError::LazTable { path: file.source.path.to_owned(), reason };
        let record = LazVlr::from_buffer(data).map_err(|e| refused(printable(&e.to_string())))?;
        let layout = match u16::from_le_bytes([data[0], data[1]]) {
            1 => Layout::Stream,
            2 => Layout::Points,
            3 => Layout::Layers,
            other => return Err(refused(format!("the points are packed in way {other}; 1 to 3 are known"))),
        };
        let packed: Vec<LazItemType> = record.items().iter().map(laz::LazItem::item_type).collect();
        let expected = laz_items(&file.format);
        let versions = if layout == Layout::Layers { 3..=4 } else { 1..=2 };
        if packed != expected || !record.items().iter().all(|item| versions.contains(&item.version())) {
            return Err(refused(format!(
                "points of format {} of {} bytes are packed as {expected:?}, but the record `laszip encoded` says {}",
                file.number,
                file.record_bytes(),
                printable(&format!("{packed:?}"))
            )));
        }
        let layers = packed.iter().map(|&item| layers_of(item)).sum();
        Ok(Compression { record, layout, layers })
    }

    /// Finds the chunks.
    pub(super) fn locate(&self, file: &LasFile<'_>) -> Result<Vec<Chunk>, OpenError> {
        let bytes: &[u8] = file.source.bytes;
        let start = u64::from(file.header.offset_to_point_data);
        if self.layout == Layout::Stream {
            return Ok(vec![Chunk { first_point: 0, points: file.points, bytes: start as usize..bytes.len() }]);
        }
        let refused = |reason: String| OpenError::LazTable { path: file.source.path.to_owned(), reason };
        let table_at = table_place(bytes, start).map_err(refused)?;
        let mut reader = Cursor::new(bytes);
        reader.set_position(start);
        let table = ChunkTable::read_from(&mut reader, &self.record).map_err(|e| refused(printable(&e.to_string())))?;
        let entries: &[_] = table.as_ref();
        let (mut chunks, mut at, mut first_point) =
            (Vec::with_capacity(entries.len()), start + TABLE_OFFSET_BYTES, 0u64);
        for (index, entry) in entries.iter().enumerate() {
            let end = at.checked_add(entry.byte_count).filter(|&end| end <= table_at);
            let end = end.ok_or_else(|| {
                refused(format!(
                    "chunk {index} of {} starts at byte {at} and has {} bytes, but the table starts at byte {table_at}",
                    entries.len(),
                    entry.byte_count
                ))
            })?;
            let last = index + 1 == entries.len();
            let left = file.points.saturating_sub(first_point);
            // The table does not say how full the last of chunks of one size is.
            let fixed = !self.record.uses_variable_size_chunks();
            let points = if fixed && last { left.min(entry.point_count) } else { entry.point_count };
            if points > 0 {
                chunks.push(Chunk { first_point, points, bytes: at as usize..end as usize });
            }
            at = end;
            first_point = first_point.saturating_add(points);
        }
        if first_point != file.points {
            return Err(file.miscounted(first_point));
        }
        Ok(chunks)
    }

    /// Sees that the layers of a chunk are not longer than the chunk, and that it holds the points that it should.
    fn check_layers(&self, record: usize, chunk: &Chunk, bytes: &[u8]) -> Result<(), String> {
        if self.layout != Layout::Layers {
            return Ok(());
        }
        let word = |at: usize| {
            let four = bytes.get(at..at + 4).and_then(|four| four.try_into().ok());
            four.map(u32::from_le_bytes).ok_or_else(|| format!("it has only {} bytes", bytes.len()))
        };
        let count = u64::from(word(record)?);
        if count != chunk.points {
            return Err(format!("it says that it holds {count} points, but must hold {}", chunk.points));
        }
        let head = record + 4 + 4 * self.layers;
        let mut needed = head as u64;
        for layer in 0..self.layers {
            needed += u64::from(word(record + 4 + 4 * layer)?);
        }
        if needed > bytes.len() as u64 {
            return Err(format!("its layers need {needed} bytes, but it has {}", bytes.len()));
        }
        Ok(())
    }

    fn decoder<'a>(&self, bytes: &'a [u8], fields: DecompressionSelection) -> laz::Result<Decoder<'a>> {
        let cursor = Cursor::new(bytes);
        let mut decoder: Decoder<'a> = match self.layout {
            Layout::Layers => Box::new(LayeredPointRecordDecompressor::new(cursor)),
            Layout::Stream | Layout::Points => Box::new(SequentialPointRecordDecompressor::new(cursor)),
        };
        decoder.set_fields_from(self.record.items())?;
        decoder.set_selection(fields);
        Ok(decoder)
    }
}

type Decoder<'a> = Box<dyn RecordDecompressor<Cursor<&'a [u8]>> + 'a>;

impl LasFile<'_> {
    /// Hands over the records of a chunk, some at a time, with the number of the first. `fields` are those that are
    /// needed: layers of others are not decoded, and their bytes are of no meaning.
    ///
    /// # Errors
    /// The chunk is damaged, or `take` fails.
    pub(crate) fn each_slab<E: From<OpenError>>(
        &self,
        chunk: &Chunk,
        fields: DecompressionSelection,
        mut take: impl FnMut(u64, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let (bytes, record) = (&self.source.bytes[chunk.bytes.clone()], self.record_bytes());
        let Some(compression) = &self.compression else {
            let slabs = bytes.chunks(SLAB_POINTS as usize * record).enumerate();
            return slabs.into_iter().try_for_each(|(i, slab)| take(chunk.first_point + i as u64 * SLAB_POINTS, slab));
        };
        let damaged = |reason: &str| OpenError::LazChunk {
            path: self.source.path.to_owned(),
            first: chunk.first_point,
            last: chunk.first_point + chunk.points - 1,
            byte: chunk.bytes.start as u64,
            reason: printable(reason),
        };
        compression.check_layers(record, chunk, bytes).map_err(|reason| damaged(&reason))?;
        let mut decoder = compression.decoder(bytes, fields).map_err(|e| damaged(&e.to_string()))?;
        let mut slab = Vec::new();
        for first in (0..chunk.points).step_by(SLAB_POINTS as usize) {
            let points = SLAB_POINTS.min(chunk.points - first) as usize;
            slab.resize(points * record, 0);
            // The decoder indexes tables by what it reads and divides by it: on damaged bytes it may panic. It holds
            // nothing but its own state, which nobody looks at afterwards.
            match catch_quietly(|| decoder.decompress_many(&mut slab)) {
                Some(Ok(())) => take(chunk.first_point + first, &slab)?,
                Some(Err(error)) => return Err(damaged(&error.to_string()).into()),
                None => return Err(damaged("the packed bytes make no sense").into()),
            }
        }
        Ok(())
    }
}

/// Where the table of chunks starts: the first bytes of the points say so, or the last of the file where the writer
/// could not go back. The number of chunks that it declares is held against the bytes of the points.
fn table_place(bytes: &[u8], start: u64) -> Result<u64, String> {
    let long = |at: u64| {
        let at = usize::try_from(at).ok()?;
        let eight = bytes.get(at..at.checked_add(8)?)?.try_into().ok()?;
        Some(i64::from_le_bytes(eight))
    };
    let behind = |place: i64| u64::try_from(place).ok().filter(|&place| place >= start + TABLE_OFFSET_BYTES);
    let place = long(start).filter(|&place| place > start as i64).or_else(|| long(bytes.len() as u64 - 8));
    let place = place.and_then(behind).filter(|&place| place + 8 <= bytes.len() as u64);
    let place = place.ok_or_else(|| format!("no table of chunks lies within the {} bytes of the file", bytes.len()))?;
    // Behind four bytes of version.
    let count = long(place).unwrap_or(0).cast_unsigned() >> 32;
    let most = (place - start) / SMALLEST_RECORD_BYTES + 1;
    if count > most {
        return Err(format!(
            "the table at byte {place} declares {count} chunks, more than {} bytes can hold",
            place - start
        ));
    }
    Ok(place)
}

/// Each chunk begins with a whole point.
const SMALLEST_RECORD_BYTES: u64 = 20;

/// What points of a format are packed as.
pub(crate) fn laz_items(format: &Format) -> Vec<LazItemType> {
    use LazItemType::{Byte, Byte14, GpsTime, Point10, Point14, RGB12, RGB14, RGBNIR14, WavePacket13, WavePacket14};
    let extra = (format.extra_bytes > 0).then_some(format.extra_bytes);
    let when = |there: bool, item| there.then_some(item);
    let items = if format.is_extended {
        let colours = when(format.has_color, if format.has_nir { RGBNIR14 } else { RGB14 });
        [Some(Point14), colours, when(format.has_waveform, WavePacket14), extra.map(Byte14), None]
    } else {
        let (time, colours) = (when(format.has_gps_time, GpsTime), when(format.has_color, RGB12));
        [Some(Point10), time, colours, when(format.has_waveform, WavePacket13), extra.map(Byte)]
    };
    items.into_iter().flatten().collect()
}

/// Layers that a kind of field has in a chunk.
fn layers_of(item: LazItemType) -> usize {
    match item {
        LazItemType::Point14 => 9,
        LazItemType::RGB14 | LazItemType::WavePacket14 => 1,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(bytes) => usize::from(bytes),
        _ => 0,
    }
}
