//! The least and the greatest of a block of values: by halves, which is what vector instructions do well, and not one
//! after the other, where each has to wait for the one before.

/// Values that are looked at together.
pub(super) const BLOCK: usize = 64;

/// The least value. None of them may be NaN.
pub(super) fn least(values: &[f64; BLOCK]) -> f64 {
    by_halves(values, |a, b| if b < a { b } else { a })
}

/// The greatest value. None of them may be NaN.
pub(super) fn greatest(values: &[f64; BLOCK]) -> f64 {
    by_halves(values, |a, b| if b > a { b } else { a })
}

#[inline(always)]
fn by_halves(values: &[f64; BLOCK], better: impl Fn(f64, f64) -> f64) -> f64 {
    let mut left = [0.0; BLOCK / 2];
    for i in 0..BLOCK / 2 {
        left[i] = better(values[i], values[i + BLOCK / 2]);
    }
    for half in [16, 8, 4, 2, 1] {
        for i in 0..half {
            left[i] = better(left[i], left[i + half]);
        }
    }
    left[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extremes_are_found_wherever_they_stand() {
        for at in 0..BLOCK {
            let mut values: [f64; BLOCK] = std::array::from_fn(|i| (i as f64 * 7.3).sin());
            values[at] = 2.0;
            values[(at + 31) % BLOCK] = -2.0;
            assert_eq!([least(&values), greatest(&values)], [-2.0, 2.0]);
        }
    }
}
