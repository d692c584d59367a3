//! Files that cannot be made one surface.

use crate::geometry::PlanBox;

/// Why files are not one surface.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WeldError {
    /// Two files hold the same ground.
    #[error(
        "{first} and {second}: both hold {area_m2:.3} m² of the same ground, at x {:.3} to {:.3} and y {:.3} to {:.3} (as in the files), so that every grain there would be found twice\nhelp: cut the blocks without overlap when they are exported (as in 'clip to block boundaries'), or run one of the two",
        place.min[0], place.max[0], place.min[1], place.max[1]
    )]
    Overlap {
        /// A file.
        first: String,
        /// The other one.
        second: String,
        /// Area in plan that both cover, m².
        area_m2: f64,
        /// Box around it, input units.
        place: PlanBox,
    },
    /// Two files have the same triangles.
    #[error(
        "{first} and {second}: {identical} triangles are in both, more than half of those of one of them\nhelp: run one of the two; one is a copy of the other, or of part of it"
    )]
    Copies {
        /// A file.
        first: String,
        /// The other one.
        second: String,
        /// Triangles with the same three vertices.
        identical: u64,
    },
    /// The tolerance that was asked for would mix up neighbours.
    #[error(
        "input.weld_m = {weld_m}: that is more than half of the mean edge of {path}, {edge_m:.3e} m, so that neighbouring vertices could not be told apart\nhelp: it is in metres; leave it at 0 to have it chosen"
    )]
    Tolerance {
        /// The file with the shortest edges.
        path: String,
        /// What was asked for, metres.
        weld_m: f64,
        /// Mean edge of the file, metres.
        edge_m: f64,
    },
    /// Too much lies near other files.
    #[error(
        "joining the files needs {} MiB of memory beside that of the program, and --memory leaves {} MiB: {near} vertices lie near another file\nhelp: give more with --memory, or join the files into one",
        needed.div_ceil(1 << 20),
        room >> 20
    )]
    Memory {
        /// Bytes needed.
        needed: u64,
        /// Bytes there.
        room: u64,
        /// Vertices near another file.
        near: u64,
    },
}
