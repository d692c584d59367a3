//! The faces of a PLY file, cut into triangles.
//!
//! A file of triangles whose records all have the same length needs no table at all: that is checked for
//! every record, in parallel. Anything else is walked once, record by record, and tabulated.

use super::error::OpenError;
use super::face_label::FaceLabel;
use super::ply_header::{Element, Kind};
use super::progress::Progress;
use super::records::{CHUNK, Source, Walk};
use super::scalar::Scalar;
use rayon::prelude::*;
use std::ops::Range;

/// Names under which the corners of a face, or of a strip of triangles, are written.
pub(super) const CORNER_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// The element that holds strips of triangles.
pub(super) const STRIPS: &str = "tristrips";

/// A polygon of more corners is none, and a list so long is damage: memory must not grow with what a list says.
pub(super) const MOST_CORNERS: u64 = 1 << 16;

/// The faces of a PLY file. Polygons are fans of triangles about their first corner, in file order.
#[derive(Debug)]
pub(super) struct Faces {
    pub(super) count: u64,
    pub(super) triangles: u64,
    length: Scalar,
    index: Scalar,
    shape: Shape,
    /// Where a face says to which instance it belongs.
    pub(super) label: Option<FaceLabel>,
}

#[derive(Debug)]
enum Shape {
    /// Triangles only; list `i` starts at `first_list + i * stride`.
    Fixed { first_list: u64, stride: u64 },
    /// Triangles only; list `i` starts at entry `i`.
    Triangles(Vec<u64>),
    /// Polygons among them.
    Polygons { list_at: Vec<u64>, first_triangle: Vec<u64>, face_of: Vec<u32> },
}

/// The list of corners within a face record.
#[derive(Clone, Copy)]
pub(super) struct Corners {
    pub(super) property: usize,
    pub(super) length: Scalar,
    pub(super) index: Scalar,
}

enum Flaw {
    /// The list at this byte has another length than 3.
    NotATriangle,
    Index(i64),
}

impl Faces {
    /// Those of a point cloud.
    pub(super) fn none() -> Faces {
        let shape = Shape::Fixed { first_list: 0, stride: 0 };
        Faces { count: 0, triangles: 0, length: Scalar::U8, index: Scalar::U32, shape, label: None }
    }

    /// Finds and validates the faces, whose element starts at byte `start`, and the byte behind them.
    ///
    /// # Errors
    /// No usable list of corners, fewer than 3 corners, a vertex that is not there, the file ends too early.
    pub(super) fn read(
        source: Source<'_>,
        element: &Element,
        start: u64,
        vertices: u64,
        progress: &Progress<'_>,
    ) -> Result<(Faces, u64), OpenError> {
        let corners = find_corners(source.path, element)?;
        let (mut faces, end) = match read_fixed(source, element, start, (corners, vertices), progress)? {
            Some(found) => found,
            None => read_walking(source, element, start, (corners, vertices), progress)?,
        };
        faces.label = FaceLabel::find(element, corners.property);
        Ok((faces, end))
    }

    /// The number that says to which instance a face belongs, if the file has one.
    #[inline]
    pub(super) fn label_of(&self, bytes: &[u8], face: u64) -> Option<f64> {
        let label = self.label.as_ref()?;
        let list = self.list_at(face);
        let list_bytes = self.length.size() + self.length.integer(&bytes[list..]) as usize * self.index.size();
        Some(label.number(bytes, list, list_bytes))
    }

    /// Byte at which the list of a face starts.
    fn list_at(&self, face: u64) -> usize {
        match &self.shape {
            Shape::Fixed { first_list, stride } => (first_list + face * stride) as usize,
            Shape::Triangles(list_at) | Shape::Polygons { list_at, .. } => list_at[face as usize] as usize,
        }
    }

    /// The corners of a triangle, vertex numbers of this file.
    #[inline]
    pub(super) fn triangle(&self, bytes: &[u8], triangle: u64) -> [u64; 3] {
        let (list, k) = match &self.shape {
            Shape::Fixed { first_list, stride } => ((first_list + triangle * stride) as usize, 0),
            Shape::Triangles(list_at) => (list_at[triangle as usize] as usize, 0),
            Shape::Polygons { list_at, first_triangle, face_of } => {
                let face = face_of[triangle as usize] as usize;
                (list_at[face] as usize, (triangle - first_triangle[face]) as usize)
            }
        };
        let (first, size) = (list + self.length.size(), self.index.size());
        if self.has_plain_index() {
            return [0, k + 1, k + 2].map(|corner| plain_index(&bytes[first + corner * 4..]));
        }
        // Validated to lie in 0..vertices, so the sign is gone.
        [0, k + 1, k + 2].map(|corner| self.index.integer(&bytes[first + corner * size..]) as u64)
    }

    /// Hands the corners of a range of triangles to `take`, vertex numbers of this file.
    #[inline]
    pub(super) fn each_triangle(&self, bytes: &[u8], triangles: Range<u64>, mut take: impl FnMut([u64; 3])) {
        match self.shape {
            Shape::Fixed { first_list, stride } if self.has_plain_index() => {
                let first = (first_list + triangles.start * stride) as usize + self.length.size();
                for i in 0..triangles.end.saturating_sub(triangles.start) {
                    let at = first + (i * stride) as usize;
                    let list = &bytes[at..at + 12];
                    take([0, 4, 8].map(|i| plain_index(&list[i..])));
                }
            }
            _ => triangles.for_each(|t| take(self.triangle(bytes, t))),
        }
    }

    /// Whether corners are of 32 bits, as in nearly every mesh. Validated ones have no sign.
    #[inline]
    fn has_plain_index(&self) -> bool {
        matches!(self.index, Scalar::I32 | Scalar::U32)
    }

    /// The face that a triangle is part of.
    #[inline]
    pub(super) fn face_of(&self, triangle: u64) -> u64 {
        match &self.shape {
            Shape::Polygons { face_of, .. } => u64::from(face_of[triangle as usize]),
            _ => triangle,
        }
    }

    /// The corners of a face as the file has them, vertex numbers of this file.
    pub(super) fn corners<'b>(&self, bytes: &'b [u8], face: u64) -> impl ExactSizeIterator<Item = u64> + use<'b> {
        let list = self.list_at(face);
        let entries = self.length.integer(&bytes[list..]) as usize;
        let (first, index) = (list + self.length.size(), self.index);
        (0..entries).map(move |corner| index.integer(&bytes[first + corner * index.size()..]) as u64)
    }
}

#[inline]
fn plain_index(bytes: &[u8]) -> u64 {
    u64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
}

/// The list of corners of a face, or of a strip of triangles.
///
/// # Errors
/// There is none of a known name, or it is no list of whole numbers.
pub(super) fn find_corners(path: &str, element: &Element) -> Result<Corners, OpenError> {
    let found = CORNER_NAMES.iter().find_map(|name| element.properties.iter().position(|p| p.name == *name));
    let Some(property) = found else {
        return Err(OpenError::PropertyMissing {
            path: path.to_owned(),
            element: if element.name == STRIPS { STRIPS } else { "face" },
            property: CORNER_NAMES[0],
            found: element.property_names(),
        });
    };
    match element.properties[property].kind {
        Kind::List { length, entry } if entry.is_integer() => Ok(Corners { property, length, index: entry }),
        kind => Err(OpenError::PropertyKind {
            path: path.to_owned(),
            element: element.name.clone(),
            property: element.properties[property].name.clone(),
            kind: kind.to_string(),
            expected: "a list of an integer type",
        }),
    }
}

/// Reads faces that are all triangles with numbers around them; `None` if they are something else.
fn read_fixed(
    source: Source<'_>,
    element: &Element,
    start: u64,
    (corners, vertices): (Corners, u64),
    progress: &Progress<'_>,
) -> Result<Option<(Faces, u64)>, OpenError> {
    let Corners { property, length, index } = corners;
    let before = Walk::new(source, element, 0..property).stride();
    let after = Walk::new(source, element, property + 1..element.properties.len()).stride();
    let (Some(before), Some(after)) = (before, after) else { return Ok(None) };
    let stride = before + length.size() as u64 + 3 * index.size() as u64 + after;
    let room = (source.bytes.len() as u64).saturating_sub(start);
    // Where the faces do not fit as triangles the walk says which one is cut off.
    if element.count.checked_mul(stride).is_none_or(|bytes| bytes > room) {
        return Ok(None);
    }
    let first_list = start + before;
    let faces = Faces {
        count: element.count,
        triangles: element.count,
        length,
        index,
        shape: Shape::Fixed { first_list, stride },
        label: None,
    };
    let look = |face: u64| {
        let list = &source.bytes[(first_list + face * stride) as usize..];
        if length.integer(list) != 3 {
            return Some((face, Flaw::NotATriangle));
        }
        let list = &list[length.size()..];
        let index_at = |corner: usize| index.integer(&list[corner * index.size()..]);
        (0..3).map(index_at).find(|&i| i < 0 || i as u64 >= vertices).map(|i| (face, Flaw::Index(i)))
    };
    // In nearly every mesh nothing need be asked of each number but whether it is small enough.
    let plain = length.size() == 1 && faces.has_plain_index();
    let limit = vertices.min(if index == Scalar::I32 { 1 << 31 } else { 1 << 32 });
    let is_plain = |face: u64| {
        let list = (first_list + face * stride) as usize;
        let list = &source.bytes[list..list + 13];
        let below = |i: usize| plain_index(&list[i..]) < limit;
        (list[0] == 3) & below(1) & below(5) & below(9)
    };
    // The first flaw in file order decides: behind a polygon, fixed strides read nonsense.
    let flaw = (0..element.count.div_ceil(CHUNK)).into_par_iter().find_map_first(|chunk| {
        let (first, last) = (chunk * CHUNK, ((chunk + 1) * CHUNK).min(element.count));
        let flaw = if plain && (first..last).all(is_plain) { None } else { (first..last).find_map(look) };
        source.passed(progress, (last - first) * stride);
        flaw
    });
    match flaw {
        None => Ok(Some((faces, start + element.count * stride))),
        Some((_, Flaw::NotATriangle)) => Ok(None),
        Some((face, Flaw::Index(index))) => {
            Err(OpenError::VertexIndex { path: source.path.to_owned(), face, index, vertices })
        }
    }
}

/// Reads faces one behind the other.
fn read_walking(
    source: Source<'_>,
    element: &Element,
    start: u64,
    (corners, vertices): (Corners, u64),
    progress: &Progress<'_>,
) -> Result<(Faces, u64), OpenError> {
    let Corners { property, length, index } = corners;
    let before = Walk::new(source, element, 0..property);
    let list = Walk::new(source, element, property..property + 1);
    let after = Walk::new(source, element, property + 1..element.properties.len());
    // Grown while records are found, never reserved from the header's count.
    let (mut list_at, mut first_triangle, mut triangles) = (Vec::new(), Vec::new(), 0);
    let (mut at, mut told) = (start, start);
    for face in 0..element.count {
        let byte = before.end(at, face)?;
        let entries = list.list_length(length, byte, face, property)?;
        check_corners(source.path, face, entries, byte)?;
        let end = list.end(byte, face)?;
        for corner in source.bytes[byte as usize + length.size()..end as usize].chunks_exact(index.size()) {
            let index = index.integer(corner);
            if index < 0 || index as u64 >= vertices {
                return Err(OpenError::VertexIndex { path: source.path.to_owned(), face, index, vertices });
            }
        }
        list_at.push(byte);
        first_triangle.push(triangles);
        triangles += entries - 2;
        at = after.end(end, face)?;
        if face % CHUNK == CHUNK - 1 {
            source.passed(progress, at - told);
            told = at;
        }
    }
    let shape = if triangles == element.count {
        Shape::Triangles(list_at)
    } else {
        let face_of = faces_of_triangles(source.path, &first_triangle, triangles)?;
        Shape::Polygons { list_at, first_triangle, face_of }
    };
    Ok((Faces { count: element.count, triangles, length, index, shape, label: None }, at))
}

/// Refuses a list of corners, at this byte, that makes no polygon.
pub(super) fn check_corners(path: &str, face: u64, corners: u64, byte: u64) -> Result<(), OpenError> {
    if corners < 3 {
        return Err(OpenError::FewCorners { path: path.to_owned(), face, corners, byte });
    }
    if corners > MOST_CORNERS {
        return Err(OpenError::ManyCorners { path: path.to_owned(), face, corners, byte, most: MOST_CORNERS });
    }
    Ok(())
}

fn faces_of_triangles(path: &str, first_triangle: &[u64], triangles: u64) -> Result<Vec<u32>, OpenError> {
    let faces = first_triangle.len() as u64;
    if faces > u64::from(u32::MAX) {
        return Err(OpenError::TooManyPolygons { path: path.to_owned(), faces });
    }
    let ends = first_triangle.iter().skip(1).copied().chain([triangles]);
    Ok((0u32..)
        .zip(first_triangle.iter().zip(ends))
        .flat_map(|(face, (&first, end))| (first..end).map(move |_| face))
        .collect())
}
