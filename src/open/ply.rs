//! PLY meshes.

use super::error::OpenError;
use super::faces::Faces;
use super::mapped::MappedFile;
use super::ply_header::PlyHeader;
use super::progress::Progress;
use super::records::{Source, locate};
use super::vertices::Vertices;
use ply_rs_bw::ply::Encoding;

/// A validated PLY mesh: no later read of a vertex or triangle below the counts can fail.
#[derive(Debug)]
pub(super) struct PlyMesh {
    bytes: MappedFile,
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
        check_is_mesh(path, &header)?;
        match header.encoding {
            Encoding::BinaryLittleEndian => PlyMesh::little_endian(path, bytes, header, progress),
            other => Err(OpenError::Encoding { path: path.to_owned(), encoding: other.to_string() }),
        }
    }

    fn little_endian(
        path: &str,
        bytes: MappedFile,
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
        let (Some(mut vertices), Some(faces)) = (vertices, faces) else {
            return Err(OpenError::NoVertices { path: path.to_owned() });
        };
        let bounds = vertices.validate(source, progress)?;
        let trailing_bytes = bytes.len() as u64 - at;
        Ok(PlyMesh { bytes, header, vertices, faces, bounds, trailing_bytes })
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

    /// Time of the file's last change, seconds since 1970.
    pub(super) fn modified_s(&self) -> i64 {
        self.bytes.modified_s()
    }
}

/// Whether the header declares vertices and faces at all: told before anything about encodings, which would
/// send people off to convert a file that is no mesh.
fn check_is_mesh(path: &str, header: &PlyHeader) -> Result<(), OpenError> {
    let path = || path.to_owned();
    let Some(vertex) = header.element("vertex") else {
        let found: Vec<&str> = header.elements.iter().map(|e| e.name.as_str()).collect();
        let found = if found.is_empty() { "nothing".to_owned() } else { found.join(", ") };
        return Err(OpenError::NoVertexElement { path: path(), found });
    };
    if vertex.count == 0 {
        return Err(OpenError::NoVertices { path: path() });
    }
    if header.element("face").is_some_and(|face| face.count > 0) {
        return Ok(());
    }
    if header.element("tristrips").is_some() {
        return Err(OpenError::TriangleStrips { path: path() });
    }
    Err(OpenError::PointCloud { path: path(), vertices: vertex.count })
}
