//! What is odd about a survey without being wrong.

use std::fmt;

/// A finding that does not stop a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// Several files are one survey, but their vertices are not joined.
    SeparateFiles {
        /// The first file.
        path: String,
        /// How many files.
        files: usize,
    },
    /// Metres were assumed, but the figures look like millimetres.
    LooksLikeMillimetres {
        /// The first file.
        path: String,
        /// Mean edge, metres as assumed.
        mean_edge_m: f64,
        /// Longer side in plan, metres as assumed.
        extent_m: f64,
    },
    /// The file is longer than its header says.
    TrailingBytes {
        /// The file.
        path: String,
        /// Bytes behind the last element.
        bytes: u64,
    },
    /// Colour properties of a type or range that is not read.
    ColoursIgnored {
        /// The file.
        path: String,
        /// What is odd about them.
        reason: String,
    },
    /// The file has fields for colours, but nothing in them.
    ColorsAllZero {
        /// The file.
        path: String,
    },
    /// Some files have colours and some do not.
    SomeFilesWithoutColours {
        /// The first file without.
        path: String,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::SeparateFiles { path, files } => write!(
                f,
                "{path} and {} more: vertices are not joined across files in this version, so a grain cut by a border \
                 between files counts once per file\nhelp: merge the meshes into one file where borders matter",
                files - 1
            ),
            Warning::LooksLikeMillimetres { path, mean_edge_m, extent_m } => write!(
                f,
                "{path}: taken as metres, the mean edge is {mean_edge_m:.3} m on an extent of {extent_m:.0} m, too \
                 coarse for gravel\nhelp: if the coordinates are millimetres, say so with --unit mm; if they are \
                 metres, say so with --unit m"
            ),
            Warning::TrailingBytes { path, bytes } => write!(
                f,
                "{path}: {bytes} bytes follow the last element that the header declares; they are ignored\nhelp: if \
                 faces are missing, the header is wrong; export the mesh again"
            ),
            Warning::ColoursIgnored { path, reason } => write!(
                f,
                "{path}: colours are ignored: {reason}\nhelp: export colours as uchar (0 to 255), ushort (0 to 65535) \
                 or float (0 to 1)"
            ),
            Warning::ColorsAllZero { path } => write!(
                f,
                "{path}: red, green and blue are 0 at every point, so it is taken as a cloud without colours\nhelp: if the \
                 survey has colours, export them with the points"
            ),
            Warning::SomeFilesWithoutColours { path } => write!(
                f,
                "{path}: has no colours while other files have them; the survey is taken as one without\nhelp: export \
                 colours from all files"
            ),
        }
    }
}
