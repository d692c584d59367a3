//! What can keep a run from being held against known stones.

use crate::open::OpenError;
use crate::picture::PictureError;
use crate::store::StoreError;
use std::path::PathBuf;

/// Why there is no score.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ValidateError {
    /// A file of the truth is not there.
    #[error(
        "{}: the known stones have no {file}\nhelp: TRUTH is a folder with mesh.ply, truth.npz and truth.csv; `gravelometer validate --help` says what they hold",
        folder.display()
    )]
    TruthMissing {
        /// The folder given.
        folder: PathBuf,
        /// What is missing.
        file: &'static str,
    },
    /// Run or label file is not there.
    #[error("{}: there is no such file or folder\nhelp: RUN is the output folder of `gravelometer run`, or a file of labels", path.display())]
    RunMissing {
        /// The path given.
        path: PathBuf,
    },
    /// The run was made without a labelled mesh.
    #[error(
        "{}: the run has no {file}, so that nobody can tell which triangle is in which grain\nhelp: run again with --labelled-mesh",
        folder.display()
    )]
    NoLabelledMesh {
        /// The folder given.
        folder: PathBuf,
        /// What is missing.
        file: &'static str,
    },
    /// A mesh cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The scene is a point cloud.
    #[error("{}: has points only, and stones are known by triangle\nhelp: give the mesh on which the truth was drawn", path.display())]
    NoTriangles {
        /// The file.
        path: PathBuf,
    },
    /// More vertices than are numbered here.
    #[error("{}: {vertices} vertices are more than the {} that can be numbered\nhelp: validate on a part of the survey", path.display(), u32::MAX)]
    TooManyVertices {
        /// The file.
        path: PathBuf,
        /// How many there are.
        vertices: u64,
    },
    /// A NumPy file cannot be read.
    #[error(
        "{}: {what} cannot be read: {reason}\nhelp: write it again with numpy.save or numpy.savez_compressed, as whole numbers such as int32",
        path.display()
    )]
    Array {
        /// The file.
        path: PathBuf,
        /// The array, or the whole file.
        what: String,
        /// What is wrong with it.
        reason: String,
    },
    /// An array is not in the archive.
    #[error("{}: has no array {name}; it has {found}\nhelp: store one whole number for each triangle of mesh.ply under this name", path.display())]
    ArrayMissing {
        /// The archive.
        path: PathBuf,
        /// The array.
        name: String,
        /// The arrays that are there.
        found: String,
    },
    /// An array has another length than the mesh has triangles.
    #[error(
        "{}: array {name} has {found} numbers, but mesh.ply has {triangles} triangles\nhelp: it must be made for this very mesh, one number for each triangle in the mesh's order",
        path.display()
    )]
    ArrayLength {
        /// The archive.
        path: PathBuf,
        /// The array.
        name: String,
        /// Its length.
        found: u64,
        /// What is needed.
        triangles: u64,
    },
    /// A triangle is of a stone that the table does not have.
    #[error(
        "{}: array {name} says that triangle {triangle} is of stone {stone}, but truth.csv has {stones} stones, numbered from 0\nhelp: stones go by their row in truth.csv, the first is 0; sand is -1",
        path.display()
    )]
    UnknownStone {
        /// The archive.
        path: PathBuf,
        /// The array.
        name: &'static str,
        /// The triangle, from 0.
        triangle: usize,
        /// The stone that it names.
        stone: i64,
        /// Rows of the table.
        stones: usize,
    },
    /// A table cannot be read.
    #[error("{}: cannot read the table: {source}\nhelp: it must be comma-separated text with the names of the columns in its first line", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// Why.
        source: csv::Error,
    },
    /// A column that is needed is not in the table.
    #[error("{}: has no column `{column}`; it has {found}\nhelp: {help}", path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// The columns that are there.
        found: String,
        /// What the column is for.
        help: &'static str,
    },
    /// A field holds no number, or none that makes sense.
    #[error("{}: line {line}: `{column}` is `{text}`, which is no {expected}\nhelp: correct the field", path.display())]
    Field {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// The column.
        column: &'static str,
        /// What stands there.
        text: String,
        /// What should.
        expected: &'static str,
    },
    /// A PLY file has no property that could be a label.
    #[error(
        "{}: neither faces nor vertices have a label: a number called {names}\nhelp: give the labelled mesh of a run, or write the labels under one of these names",
        path.display()
    )]
    NoLabels {
        /// The file.
        path: PathBuf,
        /// Names that are looked for.
        names: String,
    },
    /// The labels are of another mesh.
    #[error(
        "{}: {found}, but the mesh of the truth has {triangles} triangles and {vertices} vertices\nhelp: the labels must be of TRUTH/mesh.ply itself, in its order: run on that file",
        path.display()
    )]
    LabelCount {
        /// The file of labels.
        path: PathBuf,
        /// What it has.
        found: String,
        /// Triangles of the scene.
        triangles: u64,
        /// Vertices of the scene.
        vertices: u64,
    },
    /// A label is no whole number.
    #[error("{}: the {property} of {element} {index} is {value}, which is no whole number\nhelp: labels number the grains; give the property that does", path.display())]
    LabelValue {
        /// The file of labels.
        path: PathBuf,
        /// The property.
        property: String,
        /// `face` or `vertex`.
        element: &'static str,
        /// Which, from 0.
        index: u64,
        /// What it says.
        value: f64,
    },
    /// A result would replace an input.
    #[error("{}: is read here, and would be replaced by the {what}\nhelp: name another file", path.display())]
    OutputIsInput {
        /// The file.
        path: PathBuf,
        /// `scores` or `picture`.
        what: &'static str,
    },
    /// The scores cannot be written.
    #[error(transparent)]
    Write(#[from] StoreError),
    /// The picture cannot be written.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A file cannot be read.
    #[error("{}: cannot be read: {source}\nhelp: check that it is there and that you may read it", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}
