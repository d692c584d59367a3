//! PLY in other encodings becomes little-endian records in a scratch file, and is read from there.
//!
//! Text, big-endian numbers, vertices with lists before their coordinates, and triangle strips have no record that can
//! be found by counting. They are read once, from front to back, and written as what nearly every mesh is anyway: the
//! numbers of each vertex, then a list of corners for each face. No list is ever held in memory, whatever it says of its
//! length. The scratch file has no name, so that it goes with the process whatever happens. Everything behind this sees
//! one kind of file.

use super::error::OpenError;
use super::face_label::may_be_label;
use super::faces::{Corners, STRIPS, check_corners, find_corners};
use super::mapped::MappedFile;
use super::numbers::{BigEndian, LittleEndian, Numbers, Text};
use super::ply_header::{Element, Kind, PlyHeader, Property};
use super::printed::PrintedDigits;
use super::progress::Progress;
use super::records::{CHUNK, Source};
use super::scalar::Scalar;
use super::vertices::AXES;
use ply_rs_bw::ply::Encoding;
use std::cell::{Cell, RefCell};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Whether a file must be transcoded before its records can be found.
pub(super) fn is_needed(header: &PlyHeader) -> bool {
    let number_after_list = |e: &Element| {
        let list = e.properties.iter().position(|p| matches!(p.kind, Kind::List { .. }));
        list.is_some_and(|list| e.properties[list..].iter().any(|p| matches!(p.kind, Kind::Number(_))))
    };
    header.encoding != Encoding::BinaryLittleEndian
        || header.element("vertex").is_some_and(number_after_list)
        || header.element("face").is_none_or(|face| face.count == 0)
            && header.element(STRIPS).is_some_and(|strips| strips.count > 0)
}

/// What a file became.
pub(super) struct Transcoded {
    /// The records.
    pub(super) bytes: MappedFile,
    /// What they are.
    pub(super) header: PlyHeader,
    /// Bytes of the original behind its last element.
    pub(super) trailing_bytes: u64,
    /// How finely a text prints the coordinates.
    pub(super) printed: Option<PrintedDigits>,
}

/// Writes vertices and faces to a scratch file in the system's folder for such files.
///
/// # Errors
/// The file ends too early, or holds something that is no number, or the scratch file cannot be written.
pub(super) fn transcode(
    source: Source<'_>,
    header: &PlyHeader,
    progress: &Progress<'_>,
) -> Result<Transcoded, OpenError> {
    let payload = &source.bytes[header.payload as usize..];
    let header = &with_all_digits(header);
    let job = Job { source, header, progress, printed: RefCell::default(), told: Cell::new(0) };
    let (scratch, elements, read) = match header.encoding {
        Encoding::Ascii => job.work(Text::new(payload))?,
        Encoding::BinaryBigEndian => job.work(BigEndian::new(payload))?,
        Encoding::BinaryLittleEndian => job.work(LittleEndian::new(payload))?,
    };
    source.bytes.check_not_rewritten(Path::new(source.path))?;
    let bytes = MappedFile::of_scratch(&scratch, source.bytes.stamp()).map_err(|error| OpenError::Scratch {
        path: source.path.to_owned(),
        folder: folder(),
        source: error,
    })?;
    let printed = (header.encoding == Encoding::Ascii).then(|| job.printed.take());
    let header = PlyHeader { elements, payload: 0, ..header.clone() };
    Ok(Transcoded { bytes, header, trailing_bytes: (payload.len() - read) as u64, printed })
}

/// The header with double coordinates, if they are text: their digits may say more than their type holds.
fn with_all_digits(header: &PlyHeader) -> PlyHeader {
    let mut header = header.clone();
    let is_text = header.encoding == Encoding::Ascii;
    for element in header.elements.iter_mut().filter(|e| is_text && e.name == "vertex") {
        for property in element.properties.iter_mut().filter(|p| AXES.contains(&p.name.as_str())) {
            if let Kind::Number(scalar @ Scalar::F32) = &mut property.kind {
                *scalar = Scalar::F64;
            }
        }
    }
    header
}

fn folder() -> String {
    std::env::temp_dir().display().to_string()
}

struct Job<'a> {
    source: Source<'a>,
    header: &'a PlyHeader,
    progress: &'a Progress<'a>,
    printed: RefCell<PrintedDigits>,
    /// Bytes of the payload that were told of.
    told: Cell<usize>,
}

impl Job<'_> {
    /// Goes through the payload. Returns what was written, what that is, and how many bytes of the payload were read.
    fn work(&self, mut numbers: impl Numbers) -> Result<(std::fs::File, Vec<Element>, usize), OpenError> {
        let scratch = tempfile::tempfile().map_err(|e| self.unwritten(e))?;
        let mut to = BufWriter::with_capacity(1 << 18, scratch);
        let mut elements = Vec::new();
        let strips = self.header.element("face").is_none_or(|face| face.count == 0);
        for element in &self.header.elements {
            let written = match element.name.as_str() {
                "vertex" => Some(self.vertices(element, &mut numbers, &mut to)?),
                "face" if !strips => Some(self.corners(element, &mut numbers, &mut to)?),
                STRIPS if strips => Some(self.corners(element, &mut numbers, &mut to)?),
                _ => {
                    self.each_record(element, &mut numbers, |index, numbers| {
                        let mut properties = element.properties.iter();
                        properties.try_for_each(|property| self.skip(Place { element, index, property }, numbers))
                    })?;
                    None
                }
            };
            elements.extend(written);
        }
        let scratch = to.into_inner().map_err(|e| self.unwritten(e.into_error()))?;
        Ok((scratch, elements, numbers.read()))
    }

    fn unwritten(&self, source: std::io::Error) -> OpenError {
        OpenError::Scratch { path: self.source.path.to_owned(), folder: folder(), source }
    }

    /// Goes through the records of an element; `take` reads one.
    fn each_record<N: Numbers>(
        &self,
        element: &Element,
        numbers: &mut N,
        mut take: impl FnMut(u64, &mut N) -> Result<(), OpenError>,
    ) -> Result<(), OpenError> {
        // Records of nothing take no bytes, however many are declared.
        if element.properties.is_empty() {
            return Ok(());
        }
        for index in 0..element.count {
            take(index, numbers)?;
            if index % CHUNK == CHUNK - 1 {
                self.tell(numbers);
            }
        }
        Ok(())
    }

    /// Says how far the payload is read, and lets go of what was.
    fn tell(&self, numbers: &impl Numbers) {
        let read = numbers.read();
        self.source.passed(self.progress, (read - self.told.replace(read)) as u64);
    }

    /// Reads the number of entries of a list, and tells the byte at which it stands.
    fn entries(&self, at: Place<'_>, length: Scalar, numbers: &mut impl Numbers) -> Result<(u64, u64), OpenError> {
        let byte = self.header.payload + numbers.read() as u64;
        let entries = self.next(at, length, numbers)?.whole();
        let entries = u64::try_from(entries).map_err(|_| self.flaw(at, Flaw::Length { entries, byte }))?;
        Ok((entries, byte))
    }

    fn next(&self, at: Place<'_>, scalar: Scalar, numbers: &mut impl Numbers) -> Result<Value, OpenError> {
        numbers.next(scalar).map_err(|flaw| self.flaw(at, flaw))
    }

    /// Passes over what is not needed.
    fn skip(&self, at: Place<'_>, numbers: &mut impl Numbers) -> Result<(), OpenError> {
        let (scalar, count) = match at.property.kind {
            Kind::Number(scalar) => (scalar, 1),
            Kind::List { length, entry } => (entry, self.entries(at, length, numbers)?.0),
        };
        numbers.skip(scalar, count).map_err(|flaw| self.flaw(at, flaw))
    }

    fn flaw(&self, at: Place<'_>, flaw: Flaw) -> OpenError {
        let Place { element, index, property } = at;
        let (path, name, property) = (self.source.path.to_owned(), element.name.clone(), property.name.clone());
        match flaw {
            Flaw::End => {
                let bytes = self.source.bytes.len() as u64;
                OpenError::Truncated { path, bytes, element: name, index, count: element.count }
            }
            Flaw::Length { entries, byte } => {
                OpenError::ListLength { path, element: name, index, property, length: entries, byte }
            }
            Flaw::Text { line, text } => {
                let line = line + self.header.lines;
                OpenError::NoNumber { path, line, element: name, index, property, text }
            }
        }
    }

    /// All numbers of each vertex; lists are left out.
    fn vertices(
        &self,
        element: &Element,
        numbers: &mut impl Numbers,
        to: &mut impl Write,
    ) -> Result<Element, OpenError> {
        let axis_of = |property: &Property| AXES.iter().position(|name| property.name == *name);
        self.each_record(element, numbers, |index, numbers| {
            element.properties.iter().try_for_each(|property| {
                let at = Place { element, index, property };
                let Kind::Number(scalar) = property.kind else { return self.skip(at, numbers) };
                let value = self.next(at, scalar, numbers)?;
                if let (Value::Printed { real, decimals }, Some(axis)) = (&value, axis_of(property)) {
                    self.printed.borrow_mut().see(axis, *real, *decimals);
                }
                value.write(scalar, to).map_err(|e| self.unwritten(e))
            })
        })?;
        let is_number = |p: &&Property| matches!(p.kind, Kind::Number(_));
        let properties = element.properties.iter().filter(is_number).cloned().collect();
        Ok(Element { name: element.name.clone(), count: element.count, properties })
    }

    /// The corners of each face, with the numbers that may be its label, or of each triangle of each strip; everything
    /// else is left out.
    fn corners(
        &self,
        element: &Element,
        numbers: &mut impl Numbers,
        to: &mut impl Write,
    ) -> Result<Element, OpenError> {
        let Corners { property: place, length, index: entry } = find_corners(self.source.path, element)?;
        let is_kept = |property: &Property| element.name != STRIPS && may_be_label(property);
        let mut faces = 0;
        self.each_record(element, numbers, |index, numbers| {
            for (i, property) in element.properties.iter().enumerate() {
                let at = Place { element, index, property };
                match property.kind {
                    Kind::Number(scalar) if is_kept(property) => {
                        let label = self.next(at, scalar, numbers)?;
                        label.write(scalar, to).map_err(|e| self.unwritten(e))?;
                        continue;
                    }
                    _ if i != place => {
                        self.skip(at, numbers)?;
                        continue;
                    }
                    _ => {}
                }
                let (corners, byte) = self.entries(at, length, numbers)?;
                faces += if element.name == STRIPS {
                    self.strips(at, (corners, entry), numbers, to)?
                } else {
                    check_corners(self.source.path, index, corners, byte)?;
                    self.face(at, (corners, entry), numbers, to)?
                };
            }
            Ok(())
        })?;
        let mut properties = element.properties.clone();
        properties[place].kind = Kind::List { length: Scalar::U32, entry };
        let kept = |(i, property): (usize, Property)| (i == place || is_kept(&property)).then_some(property);
        let properties = properties.into_iter().enumerate().filter_map(kept).collect();
        Ok(Element { name: "face".to_owned(), count: faces, properties })
    }

    fn face(
        &self,
        at: Place<'_>,
        (corners, entry): (u64, Scalar),
        numbers: &mut impl Numbers,
        to: &mut impl Write,
    ) -> Result<u64, OpenError> {
        to.write_all(&(corners as u32).to_le_bytes()).map_err(|e| self.unwritten(e))?;
        for _ in 0..corners {
            self.next(at, entry, numbers)?.write(entry, to).map_err(|e| self.unwritten(e))?;
        }
        Ok(1)
    }

    /// Every corner but the first two of a strip makes a triangle with the two before it, turned over every other time;
    /// -1 begins a new strip. Triangles that name a vertex twice only lead on. All strips may be one list, so no more
    /// of it is held than two corners.
    fn strips(
        &self,
        at: Place<'_>,
        (corners, entry): (u64, Scalar),
        numbers: &mut impl Numbers,
        to: &mut impl Write,
    ) -> Result<u64, OpenError> {
        let (mut triangles, mut before, mut in_strip) = (0, [Value::Whole(0); 2], 0u64);
        for i in 0..corners {
            let corner = self.next(at, entry, numbers)?;
            if i % CHUNK == CHUNK - 1 {
                self.tell(numbers);
            }
            if corner.whole() == -1 {
                in_strip = 0;
                continue;
            }
            if in_strip >= 2 {
                let turned = (in_strip % 2) as usize;
                let [a, b, c] = [before[turned], before[1 - turned], corner];
                if a.whole() != b.whole() && b.whole() != c.whole() && c.whole() != a.whole() {
                    let triangle = to.write_all(&3u32.to_le_bytes());
                    let triangle = triangle.and_then(|()| [a, b, c].iter().try_for_each(|v| v.write(entry, to)));
                    triangle.map_err(|e| self.unwritten(e))?;
                    triangles += 1;
                }
            }
            before = [before[1], corner];
            in_strip += 1;
        }
        Ok(triangles)
    }
}

/// Where something stands, for messages.
#[derive(Clone, Copy)]
struct Place<'a> {
    element: &'a Element,
    index: u64,
    property: &'a Property,
}

/// A number of any type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value {
    Whole(i64),
    Real(f64),
    /// With so many decimals.
    Printed {
        real: f64,
        decimals: i32,
    },
}

impl Value {
    fn whole(self) -> i64 {
        match self {
            Value::Whole(n) => n,
            Value::Real(x) | Value::Printed { real: x, .. } => x as i64,
        }
    }

    fn write(self, scalar: Scalar, to: &mut (impl Write + ?Sized)) -> std::io::Result<()> {
        let real = match self {
            Value::Whole(n) => n as f64,
            Value::Real(x) | Value::Printed { real: x, .. } => x,
        };
        let whole = self.whole().to_le_bytes();
        match scalar {
            // What was read as this type fits it: its low bytes are all there is.
            Scalar::F32 => to.write_all(&(real as f32).to_le_bytes()),
            Scalar::F64 => to.write_all(&real.to_le_bytes()),
            _ => to.write_all(&whole[..scalar.size()]),
        }
    }
}

/// What is wrong with a number.
pub(super) enum Flaw {
    /// The file ends before it.
    End,
    /// A list cannot be so long.
    Length { entries: i64, byte: u64 },
    /// Something else stands there, on this line of the payload.
    Text { line: u64, text: String },
}
