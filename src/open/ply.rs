//! PLY meshes and point clouds, and LAS point clouds, which become the same records.

use super::declared::check_length;
use super::error::OpenError;
use super::faces::Faces;
use super::las::{LasPoints, decode};
use super::las_crs::CloudCrs;
use super::mapped::MappedFile;
use super::ply_header::PlyHeader;
use super::printed::PrintedDigits;
use super::progress::Progress;
use super::reach::TOLERATED_TRAILING_BYTES;
use super::records::{Source, locate};
use super::survey_file::Fingerprint;
use super::transcode::{Transcoded, is_needed, transcode};
use super::vertices::Vertices;
use super::warning::Warning;
use ply_rs_bw::ply::Encoding;

/// A validated PLY mesh, or a point cloud, which has no faces: no later read of a vertex or triangle below the counts
/// can fail.
#[derive(Debug)]
pub(super) struct PlyMesh {
    /// The records: of the file itself, or of what it was transcoded to.
    pub(super) bytes: MappedFile,
    /// Of the file itself.
    pub(super) fingerprint: Fingerprint,
    /// Of the file itself.
    pub(super) encoding: Encoding,
    pub(super) header: PlyHeader,
    pub(super) vertices: Vertices,
    pub(super) faces: Faces,
    /// Lowest and highest coordinates, input units.
    pub(super) bounds: ([f64; 3], [f64; 3]),
    /// Bytes behind the last element.
    pub(super) trailing_bytes: u64,
    /// How finely a text prints the coordinates.
    pub(super) printed: Option<PrintedDigits>,
    /// What a LAS file says beside its points.
    pub(super) las: Option<LasFacts>,
}

/// What a LAS file says beside its points.
#[derive(Debug)]
pub(super) struct LasFacts {
    /// Such as `LAZ 1.4, point format 7`.
    pub(super) format: String,
    pub(super) crs: CloudCrs,
    /// Steps of the coordinates, input units.
    pub(super) scale: [f64; 3],
    /// Points of classes 7 and 18.
    pub(super) noise: u64,
    /// Points with the flag `withheld`.
    pub(super) withheld: u64,
    pub(super) warnings: Vec<Warning>,
}

/// How LAS and LAZ files begin.
const LAS_SIGNATURE: &[u8] = b"LASF";

impl PlyMesh {
    /// Reads the header and validates every vertex and face.
    ///
    /// # Errors
    /// Everything that [`OpenError`] says about PLY files.
    pub(super) fn open(path: &str, bytes: MappedFile, progress: &Progress<'_>) -> Result<PlyMesh, OpenError> {
        if bytes.starts_with(LAS_SIGNATURE) {
            return PlyMesh::of_las(path, &bytes, progress);
        }
        let header = PlyHeader::parse(path, &bytes)?;
        check_has_vertices(path, &header)?;
        check_length(Source { path, bytes: &bytes }, &header)?;
        let skipped = header.skipped.first().cloned();
        let mesh = PlyMesh::of_header(path, bytes, header, progress);
        match skipped {
            None => mesh,
            Some((line, text)) => refuse_misread(mesh, path, line, text),
        }
    }

    /// Decodes the points of a LAS, LAZ or COPC file.
    fn of_las(path: &str, bytes: &MappedFile, progress: &Progress<'_>) -> Result<PlyMesh, OpenError> {
        let fingerprint = Fingerprint::of(bytes, bytes.stamp().modified_s());
        let points = decode(path, bytes, progress)?;
        let LasPoints { format, crs, scale, noise, withheld, warnings, bounds, trailing_bytes, .. } = points;
        let las = Some(LasFacts { format, crs, scale, noise, withheld, warnings });
        check_has_vertices(path, &points.header)?;
        let cloud = PlyMesh::records(path, (points.bytes, fingerprint), points.header, progress)?;
        Ok(PlyMesh { bounds, trailing_bytes, las, ..cloud })
    }

    /// Validates every vertex and face that the header declares.
    fn of_header(
        path: &str,
        bytes: MappedFile,
        header: PlyHeader,
        progress: &Progress<'_>,
    ) -> Result<PlyMesh, OpenError> {
        let fingerprint = Fingerprint::of(&bytes, bytes.stamp().modified_s());
        if !is_needed(&header) {
            return PlyMesh::records(path, (bytes, fingerprint), header, progress);
        }
        let encoding = header.encoding;
        let source = Source { path, bytes: &bytes };
        let Transcoded { bytes, header, trailing_bytes, printed } = transcode(source, &header, progress)?;
        check_has_vertices(path, &header)?;
        let mesh = PlyMesh::records(path, (bytes, fingerprint), header, progress)?;
        Ok(PlyMesh { encoding, trailing_bytes, printed, ..mesh })
    }

    /// Finds and validates records of little-endian numbers.
    fn records(
        path: &str,
        (bytes, fingerprint): (MappedFile, Fingerprint),
        header: PlyHeader,
        progress: &Progress<'_>,
    ) -> Result<PlyMesh, OpenError> {
        let source = Source { path, bytes: &bytes };
        let vertex_count = header.element("vertex").map_or(0, |e| e.count);
        let (mut vertices, mut faces, mut at) = (None, None, header.payload);
        for element in &header.elements {
            at = match element.name.as_str() {
                "vertex" => {
                    let (found, end) = Vertices::locate(source, element, at, progress)?;
                    vertices = Some(found);
                    end
                }
                "face" => {
                    let (found, end) = Faces::read(source, element, at, vertex_count, progress)?;
                    faces = Some(found);
                    end
                }
                _ => locate(source, element, at, false, progress)?.1,
            };
        }
        let Some(mut vertices) = vertices else { return Err(OpenError::NoVertices { path: path.to_owned() }) };
        let faces = faces.unwrap_or_else(Faces::none);
        let bounds = vertices.validate(source, progress)?;
        let trailing_bytes = bytes.len() as u64 - at;
        let encoding = header.encoding;
        Ok(PlyMesh {
            bytes,
            fingerprint,
            encoding,
            header,
            vertices,
            faces,
            bounds,
            trailing_bytes,
            printed: None,
            las: None,
        })
    }

    /// The file's bytes.
    #[inline]
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Lets go of the file's pages.
    pub(super) fn release(&self) {
        self.bytes.release();
    }

    /// Lets go of the file's pages, if they are more than may be kept.
    pub(super) fn release_if_large(&self) {
        self.bytes.release_if_large();
    }
}

/// A header line that is no PLY may only be skipped if the data are whole without it: not a byte more or less.
fn refuse_misread(mesh: Result<PlyMesh, OpenError>, path: &str, line: u64, text: String) -> Result<PlyMesh, OpenError> {
    let without = match &mesh {
        Ok(whole) if whole.trailing_bytes <= TOLERATED_TRAILING_BYTES => return mesh,
        Ok(longer) => format!("{} bytes are left over", longer.trailing_bytes),
        Err(error) => {
            let message = error.to_string();
            let first = message.lines().next().unwrap_or_default();
            first.strip_prefix(path).map_or(first, |rest| rest.trim_start_matches(": ")).to_owned()
        }
    };
    let reason = format!("it begins with no PLY keyword, and without it the data do not fit: {without}");
    Err(OpenError::HeaderLine { path: path.to_owned(), line, text, reason })
}

/// Whether the header declares vertices at all: told before anything about encodings, which would send people off to
/// convert a file that is no survey.
fn check_has_vertices(path: &str, header: &PlyHeader) -> Result<(), OpenError> {
    let path = || path.to_owned();
    let Some(vertex) = header.element("vertex") else {
        let found: Vec<&str> = header.elements.iter().map(|e| e.name.as_str()).collect();
        let found = if found.is_empty() { "nothing".to_owned() } else { found.join(", ") };
        return Err(OpenError::NoVertexElement { path: path(), found });
    };
    if vertex.count == 0 { Err(OpenError::NoVertices { path: path() }) } else { Ok(()) }
}
