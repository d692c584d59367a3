//! How finely coordinates are printed in a text file.
//!
//! A text says more than its header: `property float x` above `500000.12345` is a number that no 32-bit float holds, so
//! the digits count and not the type. But digits may also be fewer than the surface needs (`%g` prints six of them), or
//! those of floats that were ruined before they were printed. Both show in the digits of many numbers.

use super::precision::float_step;

/// What the digits of x, y and z tell.
#[derive(Debug, Clone, Default)]
pub(super) struct PrintedDigits {
    axes: [Axis; 3],
}

/// Numbers of one axis, by their magnitude: what prints a fixed number of digits prints fewer decimals of large ones.
#[derive(Debug, Clone)]
struct Axis {
    magnitudes: [Magnitude; MAGNITUDES],
    numbers: u64,
    /// Numbers that are no 32-bit float, as closely as they are printed.
    finer_than_floats: u64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Magnitude {
    numbers: u64,
    /// The most decimals that one of them has.
    decimals: i32,
}

/// Powers of two from 2^-40 to 2^50.
const MAGNITUDES: usize = 91;
const LOWEST_POWER: i32 = -40;
/// So many numbers show how many decimals are printed: all of them end in 0 by chance in no file.
const TELLING: u64 = 32;
/// Doubles come this near to a 32-bit float now and then.
const CHANCE: f64 = 1e-3;

impl Default for Axis {
    fn default() -> Self {
        Axis { magnitudes: [Magnitude::default(); MAGNITUDES], numbers: 0, finer_than_floats: 0 }
    }
}

impl PrintedDigits {
    /// Takes note of a coordinate that was printed with so many decimals.
    pub(super) fn see(&mut self, axis: usize, value: f64, decimals: i32) {
        let Some(axis) = self.axes.get_mut(axis) else { return };
        // Zero is printed in one way only.
        if value == 0.0 || !value.is_finite() {
            return;
        }
        // The exponent of an f64 is quicker to have than a logarithm.
        let power = (value.to_bits() >> 52 & 0x7ff) as i32 - 1023;
        let place = (power - LOWEST_POWER).clamp(0, MAGNITUDES as i32 - 1) as usize;
        let magnitude = &mut axis.magnitudes[place];
        magnitude.decimals = if magnitude.numbers == 0 { decimals } else { magnitude.decimals.max(decimals) };
        magnitude.numbers += 1;
        axis.numbers += 1;
        let off = (value - f64::from(value as f32)).abs();
        axis.finer_than_floats += u64::from(off > 0.51 * 10f64.powi(-decimals));
    }

    /// The step at which the largest numbers of an axis are printed; `None` if too few are not zero to tell.
    pub(super) fn step(&self, axis: usize) -> Option<f64> {
        if self.axes[axis].numbers < TELLING {
            return None;
        }
        let mut seen: Option<(u64, i32)> = None;
        for magnitude in self.axes[axis].magnitudes.iter().rev().filter(|m| m.numbers > 0) {
            let (numbers, decimals) = seen.unwrap_or((0, magnitude.decimals));
            if numbers >= TELLING {
                break;
            }
            seen = Some((numbers + magnitude.numbers, decimals.max(magnitude.decimals)));
        }
        seen.map(|(_, decimals)| 10f64.powi(-decimals))
    }

    /// Whether the numbers of an axis, none larger than this, were 32-bit floats before they were printed with more
    /// digits than those have.
    pub(super) fn were_floats(&self, axis: usize, largest: f64) -> bool {
        let numbers = &self.axes[axis];
        numbers.finer_than_floats as f64 <= CHANCE * numbers.numbers as f64
            && self.step(axis).is_some_and(|step| step < float_step(largest))
    }
}

/// Decimals of a number in words, without zeros at its end: 3 of `1.2340`, -5 of `4.6e+06`.
pub(super) fn decimals(word: &str) -> i32 {
    let (digits, exponent) = word.split_once(['e', 'E']).unwrap_or((word, "0"));
    let after_point = digits.split_once('.').map_or(0, |(_, after)| after.trim_end_matches('0').len());
    after_point as i32 - exponent.parse::<i32>().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digits(words: impl Iterator<Item = String>) -> PrintedDigits {
        let mut digits = PrintedDigits::default();
        words.for_each(|w| digits.see(0, w.parse().expect("a number"), decimals(&w)));
        digits
    }

    /// Numbers that know no grid.
    fn values(from: f64) -> impl Iterator<Item = f64> {
        (0..500).map(move |i| from + 50.0 * (f64::from(i) * 0.618_033_988_75).fract())
    }

    #[test]
    fn decimals_are_counted_in_every_notation() {
        for (word, expected) in [
            ("1.2340", 3),
            ("-7", 0),
            ("500000", 0),
            ("0.000", 0),
            ("4.6e+06", -5),
            ("1.5E-3", 4),
            ("1e-7", 7),
            (".25", 2),
            ("nan", 0),
        ] {
            assert_eq!(decimals(word), expected, "{word}");
        }
    }

    #[test]
    fn the_step_is_that_of_the_largest_numbers() {
        assert_eq!(digits(values(500_000.0).map(|v| format!("{v:.3}"))).step(0), Some(1e-3));
        assert_eq!(digits(values(500_000.0).map(|v| format!("{v:.1}00"))).step(0), Some(0.1));
        // Six digits: 4.60003e+06.
        assert_eq!(digits(values(4_600_000.0).map(|v| format!("{v:.5e}"))).step(0), Some(10.0));
        // A lone large number without decimals says nothing about the rest.
        let with_round = values(1.0).map(|v| format!("{v:.4}")).chain(["100".to_owned()]);
        assert_eq!(digits(with_round).step(0), Some(1e-4));
        assert_eq!(digits(std::iter::repeat_n("0".to_owned(), 50)).step(0), None);
        assert_eq!(digits(values(1.0).take(5).map(|v| format!("{v:.1}"))).step(0), None);
    }

    #[test]
    fn floats_are_known_by_their_numbers_whatever_the_digits() {
        let floats = || values(500_000.0).map(|v| f64::from(v as f32));
        assert!(digits(floats().map(|v| format!("{v:.6}"))).were_floats(0, 500_050.0));
        assert!(digits(floats().map(|v| format!("{}", v as f32))).were_floats(0, 500_050.0));
        assert!(!digits(values(500_000.0).map(|v| format!("{v:.5}"))).were_floats(0, 500_050.0));
        assert!(!digits(values(500_000.0).map(|v| format!("{v:.2}"))).were_floats(0, 500_050.0));
        // Coarser than floats: nothing was lost but what the digits lost.
        assert!(!digits(values(500_000.0).map(|v| format!("{v:.1}"))).were_floats(0, 500_050.0));
    }
}
