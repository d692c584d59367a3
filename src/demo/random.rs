//! Random numbers and smooth random fields that are the same on every machine.

use crate::geometry::DVec3;

/// SplitMix64 (Steele, Lea and Flood 2014): one 64-bit state, full period, integer arithmetic only.
#[derive(Debug, Clone)]
pub(super) struct Random(u64);

impl Random {
    /// A stream of its own for every seed and purpose.
    pub(super) fn new(seed: u64, purpose: u64) -> Random {
        Random(mix(seed ^ mix(purpose)))
    }

    /// The next 64 bits.
    pub(super) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        mix(self.0)
    }

    /// Uniform in [low, high).
    pub(super) fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * unit(self.bits())
    }

    /// True with the given probability.
    pub(super) fn chance(&mut self, probability: f64) -> bool {
        unit(self.bits()) < probability
    }

    /// Near-normal, mean 0 and deviation 1, within ±6: the sum of twelve uniforms, free of libm.
    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| unit(self.bits())).sum::<f64>() - 6.0
    }

    /// A direction, uniform on the sphere (rejection from the cube).
    pub(super) fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.range(-1.0, 1.0), self.range(-1.0, 1.0), self.range(-1.0, 1.0));
            let length = v.length();
            if length > 0.1 && length <= 1.0 {
                return v / length;
            }
        }
    }
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

fn mix(value: u64) -> u64 {
    let a = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let b = (a ^ (a >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    b ^ (b >> 31)
}

/// The upper 53 bits as a number in [0, 1).
fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// Value noise: random numbers in -1 to 1 on the unit lattice, smoothly interpolated between.
pub(super) fn noise(seed: u64, at: DVec3) -> f64 {
    let base = at.floor();
    let t = at - base;
    let smooth = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let mut sum = 0.0;
    for corner in 0..8u32 {
        let step = DVec3::new(f64::from(corner & 1), f64::from(corner >> 1 & 1), f64::from(corner >> 2));
        let weight = step * smooth + (DVec3::ONE - step) * (DVec3::ONE - smooth);
        sum += weight.x * weight.y * weight.z * lattice(seed, base + step);
    }
    sum
}

fn lattice(seed: u64, at: DVec3) -> f64 {
    let mut hash = seed;
    for coordinate in at.to_array() {
        hash = mix(hash.wrapping_add(GOLDEN) ^ (coordinate as i64 as u64));
    }
    2.0 * unit(hash) - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_generator_follows_the_published_sequence() {
        let mut random = Random(1_234_567);
        let first: Vec<u64> = (0..3).map(|_| random.bits()).collect();
        assert_eq!(first, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn noise_is_bounded_and_continuous_across_lattice_planes() {
        for i in 0..200 {
            let at = DVec3::new(f64::from(i), 0.37 * f64::from(i), -0.11 * f64::from(i));
            let (below, above) = (noise(9, at - DVec3::X * 1e-7), noise(9, at + DVec3::X * 1e-7));
            assert!(below.abs() <= 1.0 && (below - above).abs() < 1e-5, "{below} against {above}");
        }
    }
}
