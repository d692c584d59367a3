//! The vertices of a PLY file: places, colours, and the other numbers of a record.

use super::error::OpenError;
use super::ply_header::{Element, Kind};
use super::progress::Progress;
use super::records::{CHUNK, Records, Source, locate};
use super::scalar::Scalar;
use rayon::prelude::*;
use std::ops::Range;

/// Names under which colours are written.
const COLOR_NAMES: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]];
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];
/// The byte of a decoded cloud that is not 0 for points that are to be left out.
pub(crate) const SKIPPED: &str = "gravelometer_skipped";

/// A number of a vertex record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScalarProperty {
    /// The property's name.
    pub name: String,
    /// Its type.
    pub scalar: Scalar,
    /// Its first byte within the record.
    pub offset: usize,
}

/// Where x, y and z lie in a record.
#[derive(Debug, Clone, Copy)]
enum Place {
    /// Three floats side by side.
    Floats(usize),
    /// Three doubles side by side.
    Doubles(usize),
    /// Anything else.
    Any([(Scalar, usize); 3]),
}

/// Where a colour lies in a record, and its value for full intensity.
#[derive(Debug, Clone, Copy)]
struct Color {
    scalar: Scalar,
    offsets: [usize; 3],
    full: f64,
    /// Whether the type holds more than 0 to `full`, so that every value must be looked at.
    is_wider: bool,
}

/// The vertices of a PLY file.
#[derive(Debug)]
pub(super) struct Vertices {
    pub(super) count: u64,
    records: Records,
    place: Place,
    pub(super) axis_types: [Scalar; 3],
    color: Option<Color>,
    /// Why colours that the header declares are not read.
    pub(super) color_refused: Option<String>,
    /// The numbers before the first list, which is all of them where there is none.
    pub(super) scalars: Vec<ScalarProperty>,
    scalars_bytes: usize,
    /// Where a record says that it is to be left out.
    skipped: Option<usize>,
}

/// What a look at every vertex gives.
#[derive(Debug, Clone, Copy)]
pub(super) struct VertexBounds {
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
    /// The lowest vertex with a coordinate that is no number, and the axis.
    not_finite: Option<(u64, usize)>,
    /// The lowest vertex with a colour outside 0 to full.
    odd_color: Option<u64>,
}

impl VertexBounds {
    const EMPTY: VertexBounds =
        VertexBounds { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3], not_finite: None, odd_color: None };

    fn merge(self, other: VertexBounds) -> VertexBounds {
        let lower = |a: Option<u64>, b: Option<u64>| a.into_iter().chain(b).min();
        VertexBounds {
            min: std::array::from_fn(|i| self.min[i].min(other.min[i])),
            max: std::array::from_fn(|i| self.max[i].max(other.max[i])),
            not_finite: self.not_finite.into_iter().chain(other.not_finite).min(),
            odd_color: lower(self.odd_color, other.odd_color),
        }
    }
}

impl Vertices {
    /// Finds the vertices, whose element starts at byte `start`, and the byte behind them.
    ///
    /// # Errors
    /// x, y or z missing, a list, or behind a list; the file ends too early.
    pub(super) fn locate(
        source: Source<'_>,
        element: &Element,
        start: u64,
        progress: &Progress<'_>,
    ) -> Result<(Vertices, u64), OpenError> {
        let (scalars, scalars_bytes) = leading_scalars(element);
        let axis = |name| find_axis(source.path, element, &scalars, name);
        let axes = [axis(AXES[0])?, axis(AXES[1])?, axis(AXES[2])?];
        let place = match axes {
            [(s, a), (t, b), (u, c)] if s == t && t == u && b == a + s.size() && c == b + s.size() => match s {
                Scalar::F32 => Place::Floats(a),
                Scalar::F64 => Place::Doubles(a),
                _ => Place::Any(axes),
            },
            _ => Place::Any(axes),
        };
        let (color, color_refused) = find_color(element, &scalars);
        let (records, end) = locate(source, element, start, true, progress)?;
        let is_mark = |p: &&ScalarProperty| p.name == SKIPPED && p.scalar == Scalar::U8;
        let skipped = scalars.iter().find(is_mark).map(|p| p.offset);
        let vertices = Vertices {
            count: element.count,
            records,
            place,
            axis_types: axes.map(|(scalar, _)| scalar),
            color,
            color_refused,
            scalars,
            scalars_bytes,
            skipped,
        };
        Ok((vertices, end))
    }

    /// Looks at every vertex: bounds, and whether coordinates are finite.
    ///
    /// # Errors
    /// The first coordinate that is no number.
    pub(super) fn validate(
        &mut self,
        source: Source<'_>,
        progress: &Progress<'_>,
    ) -> Result<([f64; 3], [f64; 3]), OpenError> {
        let chunks = self.count.div_ceil(CHUNK);
        let bounds = (0..chunks)
            .into_par_iter()
            .map(|chunk| {
                let (first, last) = (chunk * CHUNK, ((chunk + 1) * CHUNK).min(self.count));
                let bounds = self.plain_bounds(source.bytes, first..last);
                let bounds = bounds
                    .unwrap_or_else(|| (first..last).fold(VertexBounds::EMPTY, |b, v| self.look(source.bytes, b, v)));
                source.passed(progress, (self.records.at(last - 1) - self.records.at(first)) as u64);
                bounds
            })
            .reduce(|| VertexBounds::EMPTY, VertexBounds::merge);
        if let Some((vertex, axis)) = bounds.not_finite {
            let value = self.position(source.bytes, vertex)[axis];
            return Err(OpenError::NotFinite { path: source.path.to_owned(), vertex, property: AXES[axis], value });
        }
        if let (Some(vertex), Some(color)) = (bounds.odd_color, self.color) {
            self.color = None;
            let (kind, full) = (color.scalar.ply_name(), color.full);
            self.color_refused = Some(format!("vertex {vertex} has a {kind} colour outside 0 to {full}"));
        }
        Ok((bounds.min, bounds.max))
    }

    /// Bounds of vertices of which nothing else need be told; none if something must.
    fn plain_bounds(&self, bytes: &[u8], vertices: Range<u64>) -> Option<VertexBounds> {
        if self.color.is_some_and(|c| c.is_wider) {
            return None;
        }
        let (mut bounds, mut finite) = (VertexBounds::EMPTY, true);
        self.each_position(bytes, vertices, |p| {
            for (axis, &value) in p.iter().enumerate() {
                bounds.min[axis] = bounds.min[axis].min(value);
                bounds.max[axis] = bounds.max[axis].max(value);
                finite &= value.is_finite();
            }
        });
        finite.then_some(bounds)
    }

    #[inline]
    fn look(&self, bytes: &[u8], mut bounds: VertexBounds, vertex: u64) -> VertexBounds {
        let p = self.position(bytes, vertex);
        for (axis, &value) in p.iter().enumerate() {
            bounds.min[axis] = bounds.min[axis].min(value);
            bounds.max[axis] = bounds.max[axis].max(value);
            if !value.is_finite() && bounds.not_finite.is_none() {
                bounds.not_finite = Some((vertex, axis));
            }
        }
        if let Some(color) = self.color
            && color.is_wider
            && bounds.odd_color.is_none()
            && !self.color(bytes, vertex).is_some_and(|c| c.iter().all(|v| (0.0..=1.0).contains(v)))
        {
            bounds.odd_color = Some(vertex);
        }
        bounds
    }

    /// x, y, z of a vertex, input units.
    #[inline]
    pub(super) fn position(&self, bytes: &[u8], vertex: u64) -> [f64; 3] {
        let record = &bytes[self.records.at(vertex)..];
        match self.place {
            Place::Floats(at) => {
                let record = &record[at..at + 12];
                [0, 4, 8].map(|i| Scalar::F32.number(&record[i..]))
            }
            Place::Doubles(at) => {
                let record = &record[at..at + 24];
                [0, 8, 16].map(|i| Scalar::F64.number(&record[i..]))
            }
            Place::Any(axes) => axes.map(|(scalar, at)| scalar.number(&record[at..])),
        }
    }

    /// Hands x, y, z of a range of vertices to `take`, input units.
    #[inline]
    pub(super) fn each_position(&self, bytes: &[u8], vertices: Range<u64>, mut take: impl FnMut([f64; 3])) {
        match (&self.records, self.place) {
            // Nearly every mesh: plain reads, one stride apart.
            (Records::Fixed { stride, .. }, Place::Floats(at)) if !vertices.is_empty() => {
                let first = self.records.at(vertices.start) + at;
                for i in 0..vertices.end - vertices.start {
                    let place = first + (i * stride) as usize;
                    let place = &bytes[place..place + 12];
                    take([0, 4, 8].map(|i| Scalar::F32.number(&place[i..])));
                }
            }
            _ => vertices.for_each(|v| take(self.position(bytes, v))),
        }
    }

    /// Type of the colours, if they are read.
    pub(super) fn color_type(&self) -> Option<Scalar> {
        self.color.map(|c| c.scalar)
    }

    /// Red, green and blue of a vertex, 0 to 1.
    #[inline]
    pub(super) fn color(&self, bytes: &[u8], vertex: u64) -> Option<[f64; 3]> {
        let color = self.color?;
        let record = &bytes[self.records.at(vertex)..];
        Some(color.offsets.map(|at| color.scalar.number(&record[at..]) / color.full))
    }

    /// Red, green and blue of a vertex, 0 to `full`. Bytes that are to be of 255 parts stay what they are: 255 times a
    /// 255th rounds to one.
    #[inline]
    pub(super) fn color_in(&self, bytes: &[u8], vertex: u64, full: f64) -> Option<[f32; 3]> {
        let color = self.color?;
        let record = &bytes[self.records.at(vertex)..];
        if color.scalar == Scalar::U8 && full == color.full {
            return Some(color.offsets.map(|at| f32::from(record[at])));
        }
        Some(color.offsets.map(|at| (color.scalar.number(&record[at..]) / color.full * full) as f32))
    }

    /// Whether a point is noise or withheld: only decoded clouds say so.
    #[inline]
    pub(super) fn is_skipped(&self, bytes: &[u8], vertex: u64) -> bool {
        self.skipped.is_some_and(|offset| bytes[self.records.at(vertex) + offset] != 0)
    }

    /// The bytes of a vertex's numbers, as [`Vertices::scalars`] lists them.
    pub(super) fn record<'b>(&self, bytes: &'b [u8], vertex: u64) -> &'b [u8] {
        let at = self.records.at(vertex);
        &bytes[at..at + self.scalars_bytes]
    }
}

/// The numbers before the first list, and their length in bytes. Behind it there are none: see [`super::transcode`].
fn leading_scalars(element: &Element) -> (Vec<ScalarProperty>, usize) {
    let (mut scalars, mut offset) = (Vec::new(), 0);
    for property in &element.properties {
        let Kind::Number(scalar) = property.kind else { break };
        scalars.push(ScalarProperty { name: property.name.clone(), scalar, offset });
        offset += scalar.size();
    }
    (scalars, offset)
}

fn find_axis(
    path: &str,
    element: &Element,
    scalars: &[ScalarProperty],
    name: &'static str,
) -> Result<(Scalar, usize), OpenError> {
    if let Some(found) = scalars.iter().find(|s| s.name == name) {
        return Ok((found.scalar, found.offset));
    }
    let path = path.to_owned();
    match element.properties.iter().find(|p| p.name == name) {
        None => {
            Err(OpenError::PropertyMissing { path, element: "vertex", property: name, found: element.property_names() })
        }
        Some(property) => Err(OpenError::PropertyKind {
            path,
            element: "vertex".into(),
            property: name.into(),
            kind: property.kind.to_string(),
            expected: "a number",
        }),
    }
}

/// The colour properties, or why those that are there are not read.
fn find_color(element: &Element, scalars: &[ScalarProperty]) -> (Option<Color>, Option<String>) {
    let declared = |names: &&[&str; 3]| names.iter().all(|n| element.properties.iter().any(|p| p.name == *n));
    let Some(names) = COLOR_NAMES.iter().find(declared) else { return (None, None) };
    let found: Vec<&ScalarProperty> =
        names.iter().filter_map(|name| scalars.iter().find(|s| s.name == *name)).collect();
    let &[red, green, blue] = found.as_slice() else {
        return (None, Some(format!("`{}` is a list or follows one", names.join("`, `"))));
    };
    let (full, is_wider) = match red.scalar {
        Scalar::U8 => (255.0, false),
        Scalar::U16 => (65535.0, false),
        Scalar::F32 | Scalar::F64 => (1.0, true),
        // Bytes in a wider type, as programs write them that know no other whole numbers.
        Scalar::I16 | Scalar::I32 | Scalar::U32 | Scalar::I64 | Scalar::U64 => (255.0, true),
        Scalar::I8 => return (None, Some(format!("`{}` is of type char", red.name))),
    };
    if green.scalar != red.scalar || blue.scalar != red.scalar {
        return (None, Some(format!("`{}` are of different types", names.join("`, `"))));
    }
    (Some(Color { scalar: red.scalar, offsets: [red.offset, green.offset, blue.offset], full, is_wider }), None)
}
