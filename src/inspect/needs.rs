//! What a run would take, and what is there.

use crate::forecast::{least_bytes, whole_bytes, work_disk_bytes};
use crate::open::Reach;
use serde::Serialize;

/// Memory and disk of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Needs {
    /// The smallest memory budget that makes sense, bytes: what does not fit into it is worked in tiles.
    pub least_memory_bytes: u64,
    /// Memory with which the survey is worked in one tile, or in the largest that there are, bytes.
    pub whole_memory_bytes: u64,
    /// Memory that is there, bytes, of which a run takes half unless it is told; none where the system does not tell.
    pub memory_there_bytes: Option<u64>,
    /// Disk that the index takes, and of a cloud its surface, bytes; with very little memory about half as much again.
    pub disk_bytes: u64,
}

impl Needs {
    /// Of a run on this survey.
    pub fn of(reach: &Reach, memory_there_bytes: Option<u64>) -> Needs {
        Needs {
            least_memory_bytes: least_bytes(reach),
            whole_memory_bytes: whole_bytes(reach),
            memory_there_bytes,
            disk_bytes: work_disk_bytes(reach, u64::MAX),
        }
    }
}
