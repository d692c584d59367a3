//! Randomness by hashing: a place always gives the same numbers, in whatever order places are asked for.

/// SplitMix64's finalizer (Steele, Lea and Flood 2014, doi:10.1145/2714064.2660195): a bijection of 64 bits.
pub(crate) fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// 64 bits for a lattice point, apart for each purpose.
pub(crate) fn at(seed: u64, purpose: u64, i: i64, j: i64) -> u64 {
    mix(mix(mix(seed ^ (purpose << 56)) ^ i as u64) ^ j as u64)
}

/// Uniform in [0, 1) from 16 bits of a hash, the `part`-th of four.
pub(crate) fn part(hash: u64, part: u32) -> f64 {
    f64::from((hash >> (16 * part)) as u16) / 65_536.0
}

/// The same in [-1, 1).
pub(crate) fn signed(hash: u64, which: u32) -> f64 {
    2.0 * part(hash, which) - 1.0
}

/// A bijection of 0, 1, ... `count` - 1 in no memory: a Feistel network over the next even number of bits,
/// walked until it comes back into the range (Black and Rogaway 2002, doi:10.1007/3-540-45760-7_9).
pub(crate) struct Permutation {
    count: u64,
    half_bits: u32,
    keys: [u64; 4],
}

impl Permutation {
    /// That of a seed and a purpose.
    pub(crate) fn new(seed: u64, purpose: u64, count: u64) -> Permutation {
        let bits = u64::BITS - count.saturating_sub(1).leading_zeros();
        let keys = [0, 1, 2, 3].map(|round| at(seed, purpose, round, 0));
        Permutation { count, half_bits: bits.div_ceil(2).max(1), keys }
    }

    /// Where `number` goes.
    pub(crate) fn forward(&self, number: u64) -> u64 {
        self.walk(number, |left, right| {
            self.keys.iter().fold((left, right), |(left, right), key| (right, left ^ self.round(right, *key)))
        })
    }

    /// What goes to `number`.
    pub(crate) fn backward(&self, number: u64) -> u64 {
        self.walk(number, |left, right| {
            self.keys.iter().rev().fold((left, right), |(left, right), key| (right ^ self.round(left, *key), left))
        })
    }

    fn round(&self, half: u64, key: u64) -> u64 {
        mix(half ^ key) >> (u64::BITS - self.half_bits)
    }

    fn walk(&self, mut number: u64, network: impl Fn(u64, u64) -> (u64, u64)) -> u64 {
        debug_assert!(number < self.count);
        loop {
            let (left, right) = network(number >> self.half_bits, number & ((1 << self.half_bits) - 1));
            number = left << self.half_bits | right;
            if number < self.count {
                return number;
            }
        }
    }
}
