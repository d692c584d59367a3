//! Which vector instructions the processor has, found out at run time.

use super::lanes::{Lanes, Plain};
#[cfg(target_arch = "x86_64")]
use super::{avx2::Avx2, avx512::Avx512};

/// Vector instructions that the curvature kernel is written for. The results do not depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum InstructionSet {
    /// Plain Rust, on any processor.
    Scalar,
    /// AVX2, FMA and BMI2: x86-64 since 2013.
    Avx2,
    /// AVX-512 F, BW, DQ and VL: most x86-64 servers since 2017.
    Avx512,
}

/// Work that can be done with any instruction set.
pub(super) trait Work {
    /// What comes of it.
    type Result;

    /// Does the work.
    fn with<L: Lanes>(self, lanes: L) -> Self::Result;
}

impl InstructionSet {
    /// All that this processor has, the fastest last.
    pub fn available() -> Vec<InstructionSet> {
        let mut sets = vec![InstructionSet::Scalar];
        #[cfg(target_arch = "x86_64")]
        {
            sets.extend(Avx2::detect().map(|_| InstructionSet::Avx2));
            sets.extend(Avx512::detect().map(|_| InstructionSet::Avx512));
        }
        sets
    }

    /// The fastest that this processor has.
    pub fn best() -> InstructionSet {
        Self::available().pop().unwrap_or(InstructionSet::Scalar)
    }

    /// Does work with this instruction set; in plain Rust where the processor lacks it.
    pub(super) fn run<W: Work>(self, work: W) -> W::Result {
        #[cfg(target_arch = "x86_64")]
        match self {
            InstructionSet::Avx512 => {
                if let Some(lanes) = Avx512::detect() {
                    return work.with(lanes);
                }
            }
            InstructionSet::Avx2 => {
                if let Some(lanes) = Avx2::detect() {
                    return work.with(lanes);
                }
            }
            InstructionSet::Scalar => {}
        }
        work.with(Plain)
    }
}
