//! One file of a survey, as others see it.

use super::ply::PlyMesh;
use super::precision::{coarsest_step, printed_step};
use super::scalar::Scalar;
use super::vertices::ScalarProperty;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What tells a file from another version of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Fingerprint {
    /// Length, bytes.
    pub bytes: u64,
    /// Time of the last change, seconds since 1970.
    pub modified_s: i64,
    /// FNV-1a (64 bit) of the first and the last 64 KiB, and of 4 KiB at each of 128 places between.
    pub samples_fnv1a64: u64,
}

/// Length of each end that goes into a fingerprint, bytes.
const END_BYTES: usize = 64 << 10;
/// Places between the ends, and what is taken at each, bytes: an export made anew within a second has other coordinates there.
const SAMPLES: usize = 128;
const SAMPLE_BYTES: usize = 4 << 10;

impl Fingerprint {
    pub(super) fn of(bytes: &[u8], modified_s: i64) -> Fingerprint {
        let end = bytes.len().min(END_BYTES);
        let (first, last) = (&bytes[..end], &bytes[bytes.len() - end..]);
        let sample = |i: usize| {
            let at = (bytes.len() as u128 * (1 + i as u128) / (1 + SAMPLES as u128)) as usize;
            &bytes[at..bytes.len().min(at + SAMPLE_BYTES)]
        };
        let hash = [first, last].into_iter().chain((0..SAMPLES).map(sample)).fold(FNV_BASIS, fnv1a64);
        Fingerprint { bytes: bytes.len() as u64, modified_s, samples_fnv1a64: hash }
    }
}

const FNV_BASIS: u64 = 0xcbf2_9ce4_8422_2325;

fn fnv1a64(start: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(start, |hash, &b| (hash ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}

/// One validated file of a survey. Vertices, faces and triangles count from 0 in each file; the survey's
/// numbers are these plus `first_vertex`, `first_face`, `first_triangle`.
#[derive(Debug)]
pub struct SurveyFile {
    pub(super) path: PathBuf,
    pub(super) mesh: PlyMesh,
    pub(super) first_vertex: u64,
    pub(super) first_face: u64,
    pub(super) first_triangle: u64,
    pub(super) fingerprint: Fingerprint,
}

impl SurveyFile {
    pub(super) fn new(path: &Path, mesh: PlyMesh, before: Option<&SurveyFile>) -> SurveyFile {
        SurveyFile {
            path: path.to_owned(),
            fingerprint: mesh.fingerprint,
            mesh,
            first_vertex: before.map_or(0, |f| f.first_vertex + f.vertices()),
            first_face: before.map_or(0, |f| f.first_face + f.faces()),
            first_triangle: before.map_or(0, |f| f.first_triangle + f.triangles()),
        }
    }

    /// The path as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Length, bytes.
    pub fn bytes(&self) -> u64 {
        self.fingerprint.bytes
    }

    /// Number of vertices, unused ones included.
    pub fn vertices(&self) -> u64 {
        self.mesh.vertices.count
    }

    /// Number of faces as the file has them.
    pub fn faces(&self) -> u64 {
        self.mesh.faces.count
    }

    /// Number of triangles into which the faces are cut.
    pub fn triangles(&self) -> u64 {
        self.mesh.faces.triangles
    }

    /// Survey number of the file's first vertex.
    pub fn first_vertex(&self) -> u64 {
        self.first_vertex
    }

    /// Survey number of the file's first face.
    pub fn first_face(&self) -> u64 {
        self.first_face
    }

    /// Survey number of the file's first triangle.
    pub fn first_triangle(&self) -> u64 {
        self.first_triangle
    }

    /// What tells the file from another version of itself.
    pub fn fingerprint(&self) -> Fingerprint {
        self.fingerprint
    }

    /// Format and encoding, such as `PLY binary_little_endian`.
    pub fn format(&self) -> String {
        match &self.mesh.las {
            Some(las) => las.format.clone(),
            None => format!("PLY {}", self.mesh.encoding),
        }
    }

    /// Points of a cloud that are noise, and points that are withheld. Neither are used.
    pub fn noise_and_withheld(&self) -> [u64; 2] {
        self.mesh.las.as_ref().map_or([0; 2], |las| [las.noise, las.withheld])
    }

    /// Whether it is a LAS, LAZ or COPC file.
    pub fn is_las(&self) -> bool {
        self.mesh.las.is_some()
    }

    /// Types of x, y and z.
    pub fn axis_types(&self) -> [Scalar; 3] {
        self.mesh.vertices.axis_types
    }

    /// Type of the colours, if the file has any that are read.
    pub fn color_type(&self) -> Option<Scalar> {
        self.mesh.vertices.color_type()
    }

    /// The header's `comment` and `obj_info` texts.
    pub fn comments(&self) -> &[String] {
        &self.mesh.header.comments
    }

    /// Lowest and highest coordinates, input units.
    pub fn input_bounds(&self) -> ([f64; 3], [f64; 3]) {
        self.mesh.bounds
    }

    /// Coarsest distance between neighbouring values of the file's coordinates at their largest, input
    /// units; `None` if all are whole numbers.
    pub fn coordinate_step(&self) -> Option<f64> {
        if let Some(las) = &self.mesh.las {
            return las.scale.into_iter().map(f64::abs).reduce(f64::max);
        }
        let printed = self.mesh.printed.as_ref();
        let held = coarsest_step(self.axis_types(), self.input_bounds(), printed).map(|(step, _)| step);
        let printed = printed.and_then(|printed| printed_step(printed, self.input_bounds())).map(|(step, _)| step);
        held.into_iter().chain(printed).reduce(f64::max)
    }

    /// The numbers of a vertex record: those before its first list, if it has lists.
    pub fn vertex_properties(&self) -> &[ScalarProperty] {
        &self.mesh.vertices.scalars
    }

    /// The bytes of those numbers, little endian, for a vertex of this file.
    ///
    /// # Panics
    /// Above the file's last vertex.
    pub fn vertex_record(&self, vertex: u64) -> &[u8] {
        self.mesh.vertices.record(self.mesh.bytes(), vertex)
    }

    /// Name and type of the number that says to which instance (grain, segment) a face belongs, one of
    /// [`super::LABEL_NAMES`].
    pub fn face_label(&self) -> Option<(&'static str, Scalar)> {
        self.mesh.faces.label.as_ref().map(|label| (label.name, label.scalar))
    }

    /// That number of a face of this file.
    ///
    /// # Panics
    /// Above the file's last face.
    #[inline]
    pub fn face_label_of(&self, face: u64) -> Option<f64> {
        self.mesh.faces.label_of(self.mesh.bytes(), face)
    }

    /// The corners of a face as the file has them: vertices of this file.
    ///
    /// # Panics
    /// Above the file's last face.
    pub fn face_corners(&self, face: u64) -> impl ExactSizeIterator<Item = u64> + '_ {
        self.mesh.faces.corners(self.mesh.bytes(), face)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_fnv1a_with_64_bits() {
        assert_eq!(fnv1a64(FNV_BASIS, b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a64(FNV_BASIS, b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a64(FNV_BASIS, b"foobar"), 0x8594_4171_f739_67e8);
    }
}
