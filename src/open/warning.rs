//! What is odd about a survey without being wrong.

use std::fmt;

/// A finding that does not stop a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
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
    /// Header lines that begin with no word of PLY, in a file that is whole without them.
    HeaderLinesSkipped {
        /// The file.
        path: String,
        /// The first such line, counted from 1.
        line: u64,
        /// What it says.
        text: String,
        /// How many there are.
        lines: u64,
    },
    /// Colour properties of a type or range that is not read.
    ColoursIgnored {
        /// The file.
        path: String,
        /// What is odd about them.
        reason: String,
    },
    /// An offset for coordinates that look like map coordinates already.
    LooksShifted {
        /// The first file.
        path: String,
        /// Lowest coordinates, input units.
        lowest: [f64; 3],
        /// The offset, map units.
        offset: [f64; 3],
    },
    /// Text with few digits.
    CoarselyPrinted {
        /// The file.
        path: String,
        /// Step of the last digit, metres.
        step_m: f64,
        /// Mean edge, metres.
        edge_m: f64,
    },
    /// Much of the surface faces down.
    FacesDown {
        /// The file.
        path: String,
        /// Share of the surface, in plan.
        share: f64,
    },
    /// A header speaks of a coordinate system, but not so that it can be used.
    CrsUnusable {
        /// The file.
        path: String,
        /// What there is.
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
            Warning::HeaderLinesSkipped { path, line, text, lines } => {
                write!(f, "{path}: header line {line} is skipped")?;
                if *lines > 1 {
                    write!(f, ", and {} more", lines - 1)?;
                }
                write!(
                    f,
                    ": `{text}` begins with no PLY keyword, and the data are whole without it\nhelp: if it is a comment, \
                     put `comment` before it"
                )
            }
            Warning::ColoursIgnored { path, reason } => write!(
                f,
                "{path}: colours are ignored: {reason}\nhelp: export colours as uchar (0 to 255), ushort (0 to 65535) \
                 or float (0 to 1)"
            ),
            Warning::LooksShifted { path, lowest: [x, y, _], offset: [east, north, _] } => write!(
                f,
                "{path}: the coordinates begin at {x}, {y}, and the offset {east}, {north} is added to them: they look \
                 like map coordinates already\nhelp: leave out the offset, unless the survey was shifted by half"
            ),
            Warning::CoarselyPrinted { path, step_m, edge_m } => write!(
                f,
                "{path}: coordinates are printed in steps of {step_m} m, and the mean edge is {edge_m:.3e} m long: \
                 unless they are exact, the surface is roughened\nhelp: export them with more digits, or as binary PLY"
            ),
            Warning::FacesDown { path, share } => write!(
                f,
                "{path}: {:.0} % of the surface, in plan, faces down: faces may be turned over, z may point down, or the \
                 mesh is closed\nhelp: stones are what bends up: turn the faces over (MeshLab: Filters > Normals > Invert \
                 Faces Orientation) or the axes (there: Transform), and cut off a closed mesh's floor",
                100.0 * share
            ),
            Warning::CrsUnusable { path, reason } => write!(
                f,
                "{path}: the coordinate system in the header cannot be used: {reason}\nhelp: name it with --crs"
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
