//! PLY meshes and point clouds.

use super::error::OpenError;
use super::faces::Faces;
use super::mapped::MappedFile;
use super::ply_header::PlyHeader;
use super::progress::Progress;
use super::records::{Source, locate};
use super::survey_file::Fingerprint;
use super::transcode::{Transcoded, is_needed, transcode};
use super::vertices::Vertices;
use ply_rs_bw::ply::Encoding;

/// A validated PLY mesh, or a point cloud, which has no faces: no later read of a vertex or triangle below the counts
/// can fail.
#[derive(Debug)]
pub(super) struct PlyMesh {
    /// The records: of the file itself, or of what it was transcoded to.
    bytes: MappedFile,
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
}

impl PlyMesh {
    /// Reads the header and validates every vertex and face.
    ///
    /// # Errors
    /// Everything that [`OpenError`] says about PLY files.
    pub(super) fn open(path: &str, bytes: MappedFile, progress: &Progress<'_>) -> Result<PlyMesh, OpenError> {
        let header = PlyHeader::parse(path, &bytes)?;
        check_has_vertices(path, &header)?;
        let fingerprint = Fingerprint::of(&bytes, bytes.modified_s());
        if !is_needed(&header) {
            return PlyMesh::records(path, (bytes, fingerprint), header, progress);
        }
        let encoding = header.encoding;
        let source = Source { path, bytes: &bytes };
        let Transcoded { bytes, header, trailing_bytes } = transcode(source, &header, progress)?;
        check_has_vertices(path, &header)?;
        let mesh = PlyMesh::records(path, (bytes, fingerprint), header, progress)?;
        Ok(PlyMesh { encoding, trailing_bytes, ..mesh })
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
        Ok(PlyMesh { bytes, fingerprint, encoding, header, vertices, faces, bounds, trailing_bytes })
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
