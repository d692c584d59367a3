//! What a run would take, and what is there.

use serde::Serialize;

/// Memory of all stages for one triangle of a tile, bytes: positions, normals, neighbours, labels and the
/// search structures over them, with its half vertex. An estimate, rounded up from the sizes of those arrays.
pub const STATE_BYTES_PER_TRIANGLE: u64 = 300;

/// Memory that a run in one piece would take against what is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Memory {
    /// Estimated need of an untiled run, bytes.
    pub untiled_bytes: u64,
    /// What is there, bytes; none where the system does not tell.
    pub there_bytes: Option<u64>,
    /// Whether an untiled run fits; none where the system does not tell.
    pub untiled_fits: Option<bool>,
}

impl Memory {
    /// The figures for so many triangles.
    pub fn untiled(triangles: u64, there_bytes: Option<u64>) -> Memory {
        let untiled_bytes = triangles.saturating_mul(STATE_BYTES_PER_TRIANGLE);
        Memory { untiled_bytes, there_bytes, untiled_fits: there_bytes.map(|there| untiled_bytes <= there) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_fits_exactly_up_to_what_is_there() {
        assert_eq!(Memory::untiled(10, Some(3000)).untiled_fits, Some(true));
        assert_eq!(Memory::untiled(10, Some(2999)).untiled_fits, Some(false));
        assert_eq!(Memory::untiled(10, None).untiled_fits, None);
    }
}
