//! What can go wrong while results are written.

use crate::open::OpenError;
use crate::statistics::RasterError;
use std::path::PathBuf;

/// A result that could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A labelled cloud of meshes.
    #[error(
        "--labelled-cloud: the inputs are meshes, not point clouds\nhelp: give --labelled-mesh, which writes the mesh with a grain_id for each face"
    )]
    NoCloud,
    /// The output folder's name belongs to something else.
    #[error("{path}: is not a folder, so no results can go into it\nhelp: name another output folder", path = path.display())]
    NotAFolder {
        /// The path.
        path: PathBuf,
    },
    /// GDAL takes paths as text.
    #[error("{path}: the name of the output folder is not valid UTF-8\nhelp: name another output folder", path = path.display())]
    NotText {
        /// The path.
        path: PathBuf,
    },
    /// Another run holds the output folder.
    #[error("{path}: another run is writing its results here\nhelp: wait for it, or name another output folder", path = path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// A folder has the name of a result.
    #[error("{path}: is a folder, but a result has this name\nhelp: move it away, or name another output folder", path = path.display())]
    FolderInTheWay {
        /// The folder.
        path: PathBuf,
    },
    /// An input would be replaced by a result.
    #[error("{input}: would be replaced by the result {target}\nhelp: name another output folder", input = input.display(), target = target.display())]
    InputInTheWay {
        /// The input, as given.
        input: PathBuf,
        /// The result that has its place.
        target: PathBuf,
    },
    /// The output folder is not empty and nobody said that it may be overwritten.
    #[error(
        "{path}: holds files already ({found})\nhelp: name another folder, or use --force to replace the results in it; other files are left alone",
        path = path.display(), found = found(ours, *others)
    )]
    Occupied {
        /// The folder.
        path: PathBuf,
        /// Results of an earlier run that lie in it.
        ours: Vec<String>,
        /// Number of other entries.
        others: usize,
    },
    /// The output folder cannot be made or written to.
    #[error("{path}: cannot {action}: {source}\nhelp: check the path, its permissions and the free space on that disk", path = path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// Why it failed.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("{path}: cannot {action}: {source}\nhelp: check the permissions and the free space on that disk; results under their final names are complete; the same command with --resume goes on from what was found", path = path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// Why it failed.
        source: std::io::Error,
    },
    /// GDAL reports a failure.
    #[error("{path}: {step} failed: {message}\nhelp: is the disk full? With more room the same command with --resume goes on from what was found. Otherwise check the GDAL installation with `gdalinfo --formats` and `projinfo EPSG:4326`", path = path.display())]
    Gdal {
        /// The file.
        path: PathBuf,
        /// What was being done, with the layer or band.
        step: String,
        /// What GDAL says.
        message: String,
    },
    /// A layer holds something else than what was put into it.
    #[error("{path}: layer {layer} holds {found} {what}, but {expected} were written\nhelp: is the disk full? With more room the same command with --resume goes on from what was found", path = path.display())]
    IncompleteLayer {
        /// The file.
        path: PathBuf,
        /// The layer.
        layer: String,
        /// Features or rows of the spatial index.
        what: &'static str,
        /// How many there should be.
        expected: u64,
        /// How many there are.
        found: u64,
    },
    /// A raster band reads back differently from what was put into it.
    #[error("{path}: band {band} does not read back as it was written\nhelp: is the disk full? With more room the same command with --resume goes on from what was found", path = path.display())]
    IncompleteBand {
        /// The file.
        path: PathBuf,
        /// The band.
        band: &'static str,
    },
    /// The grain-size raster cannot be laid out.
    #[error(transparent)]
    Raster(#[from] RasterError),
    /// The input cloud cannot be read again.
    #[error(transparent)]
    Cloud(Box<OpenError>),
    /// A point of the labelled cloud would be longer than LAS allows, or could not be described.
    #[error("{path}: points of {bytes} bytes, as the input has them, leave no room for a described grain_id (65535 bytes in all)\nhelp: run without the labelled cloud, or drop extra dimensions of the input", path = path.display())]
    CloudRecord {
        /// The file.
        path: PathBuf,
        /// Bytes of a point of the input.
        bytes: u16,
    },
    /// The labelled mesh cannot number this many grains.
    #[error("{grains} grains: a labelled mesh numbers its grains with 32-bit integers, {most} at most\nhelp: run without the labelled mesh, or cut the survey", most = i32::MAX)]
    TooManyGrains {
        /// Number of grains.
        grains: u64,
    },
    /// The labelled mesh cannot index this many vertices.
    #[error("{vertices} vertices: the faces of a PLY file index {most} at most\nhelp: run without the labelled mesh, or cut the survey", most = u32::MAX)]
    TooManyVertices {
        /// Number of vertices.
        vertices: u64,
    },
    /// The labels of the labelled mesh do not fit into memory.
    #[error(
        "the labels of {items} {what} do not fit into memory ({bytes} bytes)\nhelp: run without the labelled mesh, or on a machine with more memory"
    )]
    LabelMemory {
        /// Number of elements.
        items: u64,
        /// Triangles or vertices.
        what: &'static str,
        /// Bytes that were asked for.
        bytes: u64,
    },
    /// A face of the mesh that is being labelled refers to a vertex that does not exist.
    #[error(
        "face {face} refers to vertex {vertex}, but the mesh has {vertices} vertices\nhelp: the input changed while it was read, or is damaged"
    )]
    CornerOutOfRange {
        /// The face.
        face: u64,
        /// The vertex.
        vertex: u64,
        /// Number of vertices.
        vertices: u64,
    },
    /// The triangles of the mesh do not follow its faces.
    #[error(
        "triangle {triangle} belongs to face {face}, but the mesh has {faces} faces and triangle order follows face order\nhelp: this is a fault of the mesh reader; please report it"
    )]
    TriangleOutOfOrder {
        /// The triangle.
        triangle: u64,
        /// Its face.
        face: u64,
        /// Number of faces.
        faces: u64,
    },
    /// A grain names a triangle that the mesh does not have.
    #[error(
        "grain {grain_id} holds triangle {triangle}, but the mesh has {triangles} triangles\nhelp: the input changed between the runs"
    )]
    UnknownTriangle {
        /// The grain.
        grain_id: u64,
        /// The triangle.
        triangle: u64,
        /// Number of triangles.
        triangles: u64,
    },
    /// A vertex property of a type that PLY does not know.
    #[error(
        "vertex property {name} is of type {ply_type:?}, which PLY does not know\nhelp: this is a fault of the mesh reader; please report it"
    )]
    PropertyType {
        /// The property.
        name: String,
        /// The type.
        ply_type: String,
    },
    /// A vertex record of another length than its properties.
    #[error(
        "vertex {vertex} has a record of {found} bytes, but its properties take {expected}\nhelp: this is a fault of the mesh reader; please report it"
    )]
    RecordLength {
        /// The vertex.
        vertex: u64,
        /// Bytes of the properties.
        expected: usize,
        /// Bytes of the record.
        found: usize,
    },
}

impl From<OpenError> for WriteError {
    fn from(error: OpenError) -> WriteError {
        WriteError::Cloud(Box::new(error))
    }
}

fn found(ours: &[String], others: usize) -> String {
    match (ours.is_empty(), others) {
        (false, 0) => format!("results of an earlier run: {}", ours.join(", ")),
        (false, n) => format!("results of an earlier run: {}; and {n} others", ours.join(", ")),
        (true, n) => format!("{n}, none of them a result of this program"),
    }
}
