//! A bit for each element of a survey.

use std::sync::atomic::{AtomicU64, Ordering};

/// Bits that several threads may set.
#[derive(Debug, Default)]
pub(crate) struct Bits(Vec<AtomicU64>);

impl Bits {
    pub(crate) fn new(len: u64) -> Bits {
        Bits((0..len.div_ceil(64)).map(|_| AtomicU64::new(0)).collect())
    }

    #[inline]
    pub(crate) fn set(&self, i: u64) {
        let (word, bit) = (&self.0[(i / 64) as usize], 1 << (i % 64));
        // Most are set already, and looking is cheaper than locking.
        if word.load(Ordering::Relaxed) & bit == 0 {
            word.fetch_or(bit, Ordering::Relaxed);
        }
    }

    #[inline]
    pub(crate) fn get(&self, i: u64) -> bool {
        self.0[(i / 64) as usize].load(Ordering::Relaxed) >> (i % 64) & 1 == 1
    }

    pub(crate) fn count(&self) -> u64 {
        self.0.iter().map(|word| u64::from(word.load(Ordering::Relaxed).count_ones())).sum()
    }

    /// The elements whose bit is set, in order.
    pub(crate) fn ones(&self) -> impl Iterator<Item = u64> + '_ {
        self.0.iter().zip(0u64..).flat_map(|(word, i)| {
            let mut rest = word.load(Ordering::Relaxed);
            std::iter::from_fn(move || {
                let lowest = (rest != 0).then(|| i * 64 + u64::from(rest.trailing_zeros()));
                rest &= rest.wrapping_sub(1);
                lowest
            })
        })
    }

    /// Memory for so many bits, bytes.
    pub(crate) fn bytes(len: u64) -> u64 {
        len.div_ceil(64) * 8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_that_were_set_are_found_again_in_order() {
        let bits = Bits::new(200);
        let set = [0, 1, 63, 64, 127, 190, 199];
        set.iter().rev().for_each(|&i| bits.set(i));
        assert_eq!(bits.ones().collect::<Vec<_>>(), set);
        assert_eq!(bits.count(), 7);
        assert!((0..200).all(|i| bits.get(i) == set.contains(&i)));
    }
}
