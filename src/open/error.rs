//! What can be wrong with a survey's files.

/// A survey that cannot be opened: what, where, why, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "each variant's message names every field")]
pub enum OpenError {
    /// No input was named.
    #[error("no input file was given\nhelp: name one or several PLY meshes, or LAS, LAZ or PLY clouds")]
    NoFiles,
    /// The path leads nowhere.
    #[error("{path}: there is no such file\nhelp: check the path; a relative path starts at the working directory")]
    Missing { path: String },
    /// Two of the paths lead to the same file.
    #[error("{path}: is given twice, so every grain would count twice\nhelp: name each file once")]
    Twice { path: String },
    /// A folder without surveys.
    #[error(
        "{path}: the folder {found}, but no *.ply, *.las or *.laz\nhelp: folders within it are not searched; name the one \
         that holds the surveys, or the files"
    )]
    NoSurveysInFolder { path: String, found: String },
    /// A folder with a survey in two formats.
    #[error(
        "{one} and {other} have one name: if they are the same survey, every grain would count twice\nhelp: name the files that are meant, for instance with a pattern"
    )]
    TwoFormats { one: String, other: String },
    /// A pattern that is none.
    #[error(
        "{pattern}: there is no such file, and as a pattern it cannot be understood: {reason}\nhelp: patterns have * for any letters, ? for one, [ab] for one of these"
    )]
    Pattern { pattern: String, reason: String },
    /// A pattern that leads nowhere.
    #[error(
        "{pattern}: nothing matches this pattern{but}\nhelp: check it from the working directory; * does not go into folders, and small letters are not capital ones"
    )]
    NoMatch { pattern: String, but: &'static str },
    /// A list of inputs that cannot be read.
    #[error(
        "@{path}: the list of inputs cannot be read: {source}\nhelp: name a text file with one path on a line, relative to its own folder"
    )]
    InputList { path: String, source: std::io::Error },
    /// A list of inputs without any.
    #[error(
        "@{path}: the list of inputs names no file\nhelp: write one path on a line, relative to the folder of the list"
    )]
    InputListEmpty { path: String },
    /// The path is a directory.
    #[error("{path}: is a directory, not a mesh\nhelp: name the files in it, for instance {path}/*.ply")]
    Directory { path: String },
    /// The path is a pipe, socket or device.
    #[error("{path}: is not a regular file, so it cannot be memory-mapped\nhelp: save the data to a file first")]
    NotAFile { path: String },
    /// The file exists, but the system refuses to read or map it.
    #[error("{path}: cannot be read: {source}\nhelp: check the file's permissions and that its disk is mounted")]
    Unreadable { path: String, source: std::io::Error },
    /// The file has no bytes.
    #[error("{path}: is empty (0 bytes)\nhelp: the export or copy did not finish; export it again")]
    Empty { path: String },

    /// Changed by another program while it was read.
    #[error(
        "{path}: was changed while it was read, so that results would be partly of the old file and partly of the new\nhelp: \
         let what writes it end, then run again"
    )]
    Changed { path: String },

    /// The first line is not `ply`.
    #[error(
        "{path}: is not a PLY file: it starts with `{start}`, not with a line `ply`\nhelp: meshes are \
         read from PLY, clouds from PLY, LAS and LAZ (which start with `LASF`); export the mesh as binary PLY, for instance from CloudCompare or MeshLab"
    )]
    NotPly { path: String, start: String },
    /// The header does not end.
    #[error(
        "{path}: the PLY header has no line `end_header` in the first {searched} bytes\nhelp: the file is cut off or \
         is not PLY; export it again"
    )]
    HeaderUnended { path: String, searched: u64 },
    /// A header line that is not PLY.
    #[error(
        "{path}: header line {line} cannot be understood: `{text}` ({reason})\nhelp: export the mesh again as PLY 1.0"
    )]
    HeaderLine { path: String, line: u64, text: String, reason: String },
    /// Text where a number should be.
    #[error(
        "{path}: line {line}: `{text}` is no number that `{property}` of {element} {index} can be\nhelp: the data do not \
         match the header; export the file again"
    )]
    NoNumber { path: String, line: u64, element: String, index: u64, property: String, text: String },
    /// No room for what an encoding is turned into.
    #[error(
        "{path}: is not plain binary PLY, so it is written as such first, and that fails in {folder}: {source}\nhelp: \
         free some space there, or set TMPDIR to a folder with room for about the file's size"
    )]
    Scratch { path: String, folder: String, source: std::io::Error },
    /// Points on a lattice that is coarser than they lie apart.
    #[error(
        "{path}: coordinates step by {step_m:.3e} m, and points lie {spacing_m:.3e} m apart: their places are destroyed\nhelp: \
         export it again with finer steps (LAS: a smaller scale; PLY: double, or shifted to small coordinates with the shift \
         given as --offset or in an --offset-file)"
    )]
    CloudStep { path: String, step_m: f64, spacing_m: f64 },
    /// The triangles of a cloud cannot be read again.
    #[error(
        "the surface of the cloud cannot be mapped: {source}\nhelp: give the process more address space (ulimit -v)"
    )]
    Surface { source: std::io::Error },
    /// An element is declared twice.
    #[error(
        "{path}: the header declares element `{element}` twice\nhelp: export the mesh again with one `{element}` element"
    )]
    RepeatedElement { path: String, element: String },
    /// There is no `vertex` element.
    #[error(
        "{path}: the header declares no element `vertex` (it declares: {found})\nhelp: export a triangle mesh as PLY"
    )]
    NoVertexElement { path: String, found: String },
    /// The file has no vertices.
    #[error("{path}: has 0 vertices\nhelp: the mesh is empty; check the export")]
    NoVertices { path: String },
    /// Some files are meshes and some are point clouds.
    #[error(
        "{mesh} is a mesh and {cloud} a point cloud: they cannot be one survey, since a cloud gets a surface of its own\n\
         help: run the meshes and the clouds apart from each other"
    )]
    MeshAndCloud { mesh: String, cloud: String },
    /// A property is missing.
    #[error(
        "{path}: element `{element}` has no property `{property}` (it has: {found})\nhelp: export the mesh again with \
         this property"
    )]
    PropertyMissing { path: String, element: &'static str, property: &'static str, found: String },
    /// A property of an unusable kind.
    #[error(
        "{path}: property `{property}` of element `{element}` is `{kind}`, but must be {expected}\nhelp: export the \
         mesh again, for instance from CloudCompare or MeshLab"
    )]
    PropertyKind { path: String, element: String, property: String, kind: String, expected: &'static str },

    /// The file ends too early.
    #[error(
        "{path}: the file ends at byte {bytes}, within {element} {index} of {count}\nhelp: the file is cut off; copy \
         or export it again"
    )]
    Truncated { path: String, bytes: u64, element: String, index: u64, count: u64 },
    /// The file cannot hold what it declares, which its length alone tells.
    #[error(
        "{path}: the file ends at byte {bytes}, at the latest within {element} {index} of {count}\nhelp: the file is cut \
         off, or many of its faces have fewer than 3 corners; copy or export it again"
    )]
    TooShort { path: String, bytes: u64, element: String, index: u64, count: u64 },
    /// A list with a negative length.
    #[error(
        "{path}: {element} {index}: list `{property}` has {length} entries (byte {byte})\nhelp: the data do not match \
         the header; export the file again"
    )]
    ListLength { path: String, element: String, index: u64, property: String, length: i64, byte: u64 },
    /// A face that is no polygon.
    #[error(
        "{path}: face {face} has {corners} corners (byte {byte}); a face needs at least 3\nhelp: if the header \
         counts vertices or faces wrong, export the mesh again; else clean it, for instance in MeshLab with Filters > Cleaning \
         and Repairing"
    )]
    FewCorners { path: String, face: u64, corners: u64, byte: u64 },
    /// A face that is no polygon either.
    #[error(
        "{path}: face {face} has {corners} corners (byte {byte}); at most {most} are read\nhelp: triangulate the mesh if \
         this is meant; else the file is damaged or does not match its header: export it again"
    )]
    ManyCorners { path: String, face: u64, corners: u64, byte: u64, most: u64 },
    /// A face that names a vertex that is not there.
    #[error(
        "{path}: face {face} refers to vertex {index}, but the file has {vertices} vertices (0 to {last})\nhelp: the \
         file is damaged or its index type is too narrow; export it again",
        last = vertices.saturating_sub(1)
    )]
    VertexIndex { path: String, face: u64, index: i64, vertices: u64 },
    /// More polygons than the face table can number.
    #[error(
        "{path}: has {faces} faces, not all triangles: above {limit} faces only pure triangle meshes are read\nhelp: \
         triangulate the mesh",
        limit = u32::MAX
    )]
    TooManyPolygons { path: String, faces: u64 },
    /// A coordinate that is no number.
    #[error(
        "{path}: vertex {vertex}: property `{property}` is {value}\nhelp: remove vertices without finite coordinates, \
         for instance in MeshLab with Remove Vertices > NaN, or export the mesh again"
    )]
    NotFinite { path: String, vertex: u64, property: &'static str, value: f64 },
    /// A survey too wide to be one.
    #[error(
        "{path}: the survey spans {extent_m:.6e} m along {axis}, from {min} to {max} in input units; more than \
         {limit_m:e} m is no reach\nhelp: set the unit (--unit mm for millimetres), remove stray vertices, or run far \
         apart files one by one"
    )]
    Extent { path: String, axis: char, min: f64, max: f64, extent_m: f64, limit_m: f64 },
    /// Coordinates too large for their type.
    #[error(
        "{path}: coordinates are floating-point numbers as large as {largest}, where they step by {step_m:.3e} m, but the mean \
         edge is only {edge_m:.3e} m long: the surface is destroyed\nhelp: export it again with double coordinates, or \
         shifted to small ones, with the shift given as --offset or --offset-file"
    )]
    FloatStep { path: String, largest: f64, step_m: f64, edge_m: f64 },
    /// Coordinates with too few digits.
    #[error(
        "{path}: coordinates as large as {largest} are printed in steps of {step_m} m, but the mean edge is only {edge_m:.3e} m \
         long: the surface is destroyed\nhelp: export it again with more digits, or as binary PLY with double \
         coordinates, or shifted to small ones, with the shift given as --offset or --offset-file"
    )]
    PrintedStep { path: String, largest: f64, step_m: f64, edge_m: f64 },

    /// The first four bytes are not `LASF`.
    #[error(
        "{path}: is not a LAS file: it starts with `{start}`, not with `LASF`\nhelp: export the cloud again as LAS or LAZ, for \
         instance from CloudCompare or PDAL"
    )]
    NotLas { path: String, start: String },
    /// A version that does not exist.
    #[error(
        "{path}: is LAS version {major}.{minor}; versions 1.0 to 1.5 are known\nhelp: export the cloud again as LAS 1.4, or \
         check that the file is not damaged"
    )]
    LasVersion { path: String, major: u8, minor: u8 },
    /// A point format that does not exist.
    #[error(
        "{path}: has points of format {number}; formats 0 to 10 are known\nhelp: export the cloud again as LAS 1.4, or check \
         that the file is not damaged"
    )]
    LasFormat { path: String, number: u8 },
    /// A header that contradicts itself or the file.
    #[error(
        "{path}: the LAS header is damaged: {reason}\nhelp: the file is cut off or damaged; copy or export it again"
    )]
    LasHeader { path: String, reason: String },
    /// A scale or an offset that makes no coordinates.
    #[error(
        "{path}: coordinates along {axis} have scale {scale:e} and offset {offset:e}, which makes no places of \
         them: a scale is not 0, and an offset not so large that the scale is lost in it\nhelp: the header is \
         damaged; export the cloud again"
    )]
    LasTransform { path: String, axis: char, scale: f64, offset: f64 },
    /// More or fewer points than declared.
    #[error(
        "{path}: the header declares {declared} points, but the file ({bytes} bytes) holds {found}\nhelp: the file is cut \
         off, or its writer did not finish; copy or export it again"
    )]
    LasCount { path: String, bytes: u64, declared: u64, found: u64 },
    /// What says how a LAZ file is packed is no good.
    #[error(
        "{path}: the LAZ file cannot be unpacked: {reason}\nhelp: the file is cut off or damaged, or its writer did not \
         finish; copy or export it again"
    )]
    LazTable { path: String, reason: String },
    /// A chunk of a LAZ file cannot be unpacked.
    #[error(
        "{path}: points {first} to {last}, packed at byte {byte}, cannot be unpacked: {reason}\nhelp: the file is \
         damaged; copy or export it again"
    )]
    LazChunk { path: String, first: u64, last: u64, byte: u64, reason: String },

    /// A CRS that is neither code, text nor file.
    #[error("{origin}: is neither EPSG:n, nor WKT, nor a file\nhelp: give a code such as EPSG:2193 or a .prj file")]
    CrsForm { origin: String },
    /// A CRS file that cannot be read.
    #[error("{origin}: cannot be read: {source}\nhelp: give a code such as EPSG:2193, or a text file that holds WKT")]
    CrsFile { origin: String, source: std::io::Error },
    /// A CRS that GDAL does not know.
    #[error(
        "{origin}: GDAL cannot make a coordinate system of it: {message}\nhelp: check the code or the WKT, or name the \
         system with --crs"
    )]
    CrsUnknown { origin: String, message: String },
    /// A CRS without plane coordinates.
    #[error(
        "{origin}: {name} is {kind}, not a projected system, so lengths cannot be measured in it\nhelp: project the \
         mesh, for instance to the UTM zone of the site, and name that system with --crs"
    )]
    CrsKind { origin: String, name: String, kind: &'static str },
    /// A compound CRS of two units.
    #[error(
        "{origin}: {name} measures plan in units of {plan_m} m and height in units of {height_m} m\nhelp: bring \
         heights and plan to one unit and name a system that uses it with --crs"
    )]
    CrsUnits { origin: String, name: String, plan_m: f64, height_m: f64 },
    /// PROJ is not installed properly.
    #[error(
        "{origin}: PROJ does not find its database: {message}\nhelp: set PROJ_DATA (PROJ 9.1 and newer) or PROJ_LIB \
         to the directory that holds proj.db, often /usr/share/proj"
    )]
    ProjDatabase { origin: String, message: String },
    /// Two sources name two systems.
    #[error("{first} says {first_name}, but {second} says {second_name}\nhelp: {help}")]
    CrsContradiction { first: String, first_name: String, second: String, second_name: String, help: &'static str },
    /// An offset file that is none.
    #[error(
        "{path}: line {line}: {found}, where this is expected: {expected}\nhelp: an offset file holds, for instance,\n{example}"
    )]
    OffsetFile { path: String, line: usize, found: String, expected: String, example: String },
    /// An offset file that cannot be read.
    #[error("--offset-file {path}: cannot be read: {source}\nhelp: check the path and the file's permissions")]
    OffsetFileUnreadable { path: String, source: std::io::Error },
    /// Two offsets.
    #[error(
        "input.offset {offset:?} and input.offset_file {path}: only one of them can say how the coordinates reach the \
         CRS\nhelp: leave out --offset or --offset-file"
    )]
    TwoOffsets { offset: [f64; 3], path: String },
    /// Coordinates in degrees.
    #[error(
        "{path}: the coordinates look like degrees: the survey spans {x_extent} x {y_extent} in plan and {z_extent} in height, \
         and its edges rise {steepness:.0} times as far as they reach in plan\nhelp: project the mesh, for instance to \
         the UTM zone of the site, and export it again; if the coordinates are metres, say so with --unit m"
    )]
    LooksLikeDegrees { path: String, x_extent: f64, y_extent: f64, z_extent: f64, steepness: f64 },
}

impl OpenError {
    /// Whether what was asked for is wrong, rather than what is in the files.
    pub fn is_about_settings(&self) -> bool {
        matches!(
            self,
            OpenError::CrsForm { .. }
                | OpenError::CrsFile { .. }
                | OpenError::CrsUnknown { .. }
                | OpenError::CrsKind { .. }
                | OpenError::CrsUnits { .. }
                | OpenError::CrsContradiction { .. }
                | OpenError::OffsetFile { .. }
                | OpenError::OffsetFileUnreadable { .. }
                | OpenError::TwoOffsets { .. }
        )
    }
}
