//! PLY in other encodings becomes little-endian records in a scratch file, and is read from there.
//!
//! Text, big-endian numbers, vertices with lists before their coordinates, and triangle strips have no record that can
//! be found by counting. They are read once, from front to back, and written as what nearly every mesh is anyway: the
//! numbers of each vertex, then a list of corners for each face. The scratch file has no name, so that it goes with
//! the process whatever happens. Everything behind this sees one kind of file.

use super::error::OpenError;
use super::faces::CORNER_NAMES;
use super::mapped::MappedFile;
use super::numbers::{BigEndian, LittleEndian, Numbers, Text};
use super::ply_header::{Element, Kind, PlyHeader, Property};
use super::progress::Progress;
use super::records::{CHUNK, Source};
use super::scalar::Scalar;
use ply_rs_bw::ply::Encoding;
use std::io::{BufWriter, Write};

const STRIPS: &str = "tristrips";

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
    let job = Job { source, header, progress };
    let (scratch, elements, read) = match header.encoding {
        Encoding::Ascii => job.work(Text::new(payload))?,
        Encoding::BinaryBigEndian => job.work(BigEndian::new(payload))?,
        Encoding::BinaryLittleEndian => job.work(LittleEndian::new(payload))?,
    };
    let bytes = MappedFile::of_scratch(&scratch, source.bytes.modified_s()).map_err(|error| OpenError::Scratch {
        path: source.path.to_owned(),
        folder: folder(),
        source: error,
    })?;
    let header = PlyHeader { elements, payload: 0, ..header.clone() };
    Ok(Transcoded { bytes, header, trailing_bytes: (payload.len() - read) as u64 })
}

fn folder() -> String {
    std::env::temp_dir().display().to_string()
}

struct Job<'a> {
    source: Source<'a>,
    header: &'a PlyHeader,
    progress: &'a Progress<'a>,
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
                "face" if !strips => Some(self.corners(element, &mut numbers, &mut to, Self::face)?),
                STRIPS if strips => Some(self.corners(element, &mut numbers, &mut to, Self::strip)?),
                _ => {
                    self.each_record(element, &mut numbers, |_, _| Ok(()))?;
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

    /// Reads the records of an element one by one. `take` gets all numbers of a record, entries of lists among them, and
    /// where those of each property start, with the end behind the last.
    fn each_record(
        &self,
        element: &Element,
        numbers: &mut impl Numbers,
        mut take: impl FnMut(&[Value], &[usize]) -> Result<(), OpenError>,
    ) -> Result<(), OpenError> {
        let (mut values, mut starts, mut told) = (Vec::new(), Vec::new(), numbers.read());
        for index in 0..element.count {
            values.clear();
            starts.clear();
            for property in &element.properties {
                let fails = |flaw| self.flaw(element, index, property, flaw);
                starts.push(values.len());
                match property.kind {
                    Kind::Number(scalar) => values.push(numbers.next(scalar).map_err(fails)?),
                    Kind::List { length, entry } => {
                        let entries = numbers.next(length).map_err(fails)?;
                        let entries = entries.whole();
                        if entries < 0 {
                            return Err(fails(Flaw::Length(entries)));
                        }
                        for _ in 0..entries {
                            values.push(numbers.next(entry).map_err(fails)?);
                        }
                    }
                }
            }
            starts.push(values.len());
            take(&values, &starts)?;
            if index % CHUNK == CHUNK - 1 {
                self.source.passed(self.progress, (numbers.read() - told) as u64);
                told = numbers.read();
            }
        }
        Ok(())
    }

    fn flaw(&self, element: &Element, index: u64, property: &Property, flaw: Flaw) -> OpenError {
        let (path, name, property) = (self.source.path.to_owned(), element.name.clone(), property.name.clone());
        match flaw {
            Flaw::End => {
                let bytes = self.source.bytes.len() as u64;
                OpenError::Truncated { path, bytes, element: name, index, count: element.count }
            }
            Flaw::Length(length) => {
                OpenError::ListLength { path, element: name, index, property, length, byte: self.header.payload }
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
        let scalar = |p: &Property| if let Kind::Number(scalar) = p.kind { Some(scalar) } else { None };
        let kept: Vec<(usize, Scalar)> =
            element.properties.iter().enumerate().filter_map(|(i, p)| Some((i, scalar(p)?))).collect();
        self.each_record(element, numbers, |values, starts| {
            kept.iter().try_for_each(|&(i, scalar)| values[starts[i]].write(scalar, to)).map_err(|e| self.unwritten(e))
        })?;
        let properties = kept.iter().map(|&(i, _)| element.properties[i].clone()).collect();
        Ok(Element { name: element.name.clone(), count: element.count, properties })
    }

    /// The list of corners of each face; everything else is left out.
    fn corners(
        &self,
        element: &Element,
        numbers: &mut impl Numbers,
        to: &mut impl Write,
        put: impl Fn(&[Value], Scalar, &mut dyn Write) -> std::io::Result<u64>,
    ) -> Result<Element, OpenError> {
        let found = CORNER_NAMES.iter().find_map(|name| element.properties.iter().position(|p| p.name == *name));
        let place =
            found.filter(|&i| matches!(element.properties[i].kind, Kind::List { entry, .. } if entry.is_integer()));
        let mut faces = 0;
        let mut kind = Kind::List { length: Scalar::U32, entry: Scalar::I32 };
        self.each_record(element, numbers, |values, starts| {
            let Some(i) = place else { return Ok(()) };
            let Kind::List { entry, .. } = element.properties[i].kind else { return Ok(()) };
            kind = Kind::List { length: Scalar::U32, entry };
            faces += put(&values[starts[i]..starts[i + 1]], entry, to).map_err(|e| self.unwritten(e))?;
            Ok(())
        })?;
        // A face without a usable list of corners is refused by its names, as in any other file.
        let properties = match place {
            Some(i) => vec![Property { name: element.properties[i].name.clone(), kind }],
            None => element.properties.clone(),
        };
        Ok(Element { name: "face".to_owned(), count: if place.is_some() { faces } else { element.count }, properties })
    }

    fn face(corners: &[Value], entry: Scalar, to: &mut dyn Write) -> std::io::Result<u64> {
        to.write_all(&(corners.len() as u32).to_le_bytes())?;
        corners.iter().try_for_each(|corner| corner.write(entry, to)).map(|()| 1)
    }

    /// Every corner but the first two of a strip makes a triangle with the two before it, turned over every other time;
    /// -1 begins a new strip. Triangles that name a vertex twice only lead on.
    fn strip(corners: &[Value], entry: Scalar, to: &mut dyn Write) -> std::io::Result<u64> {
        let mut triangles = 0;
        for strip in corners.split(|corner| corner.whole() == -1) {
            for (i, three) in strip.windows(3).enumerate() {
                let [a, b, c] = [three[i % 2], three[1 - i % 2], three[2]];
                if a.whole() != b.whole() && b.whole() != c.whole() && c.whole() != a.whole() {
                    triangles += Self::face(&[a, b, c], entry, to)?;
                }
            }
        }
        Ok(triangles)
    }
}

/// A number of any type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value {
    Whole(i64),
    Real(f64),
}

impl Value {
    fn whole(self) -> i64 {
        match self {
            Value::Whole(n) => n,
            Value::Real(x) => x as i64,
        }
    }

    fn write(self, scalar: Scalar, to: &mut (impl Write + ?Sized)) -> std::io::Result<()> {
        let real = match self {
            Value::Whole(n) => n as f64,
            Value::Real(x) => x,
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
    Length(i64),
    /// Something else stands there, on this line of the payload.
    Text { line: u64, text: String },
}
