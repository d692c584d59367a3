//! Means, medians and percentiles, as the reference takes them.

use crate::statistics::Sizes;
use serde::Serialize;

/// Mean and median.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Middle {
    /// Arithmetic mean; no number for nothing.
    pub mean: f64,
    /// Median, between the two in the middle; no number for nothing.
    pub median: f64,
}

impl Middle {
    /// Of some values; those that are no numbers are left out.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Middle {
        let mut values: Vec<f64> = values.into_iter().filter(|v| !v.is_nan()).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.sort_unstable_by(f64::total_cmp);
        let half = values.len() / 2;
        let median = match values.len() {
            0 => f64::NAN,
            n if n % 2 == 1 => values[half],
            _ => 0.5 * (values[half - 1] + values[half]),
        };
        Middle { mean, median }
    }
}

/// D16, D50 and D84 by number: each grain counts once, linear between order statistics.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Percentiles {
    /// 16 % of the grains are smaller.
    #[serde(rename = "D16")]
    pub d16: f64,
    /// Half of the grains are smaller.
    #[serde(rename = "D50")]
    pub d50: f64,
    /// 84 % of the grains are smaller.
    #[serde(rename = "D84")]
    pub d84: f64,
}

impl Percentiles {
    /// Of some sizes, in their unit; those that are no numbers are left out, and without any there are none.
    pub fn of(sizes: impl IntoIterator<Item = f64>) -> Option<Percentiles> {
        let sizes = Sizes::new(sizes);
        let at = |percent| sizes.area_by_number(percent);
        Some(Percentiles { d16: at(16.0)?, d50: at(50.0)?, d84: at(84.0)? })
    }

    /// The three, in order.
    pub fn to_array(self) -> [f64; 3] {
        [self.d16, self.d50, self.d84]
    }

    /// Each of them by itself, changed.
    pub fn map(self, change: impl Fn(f64) -> f64) -> Percentiles {
        Percentiles { d16: change(self.d16), d50: change(self.d50), d84: change(self.d84) }
    }

    /// How much these are larger than the true ones, percent.
    pub fn error_percent(self, truth: Percentiles) -> Percentiles {
        let error = |found: f64, truth: f64| 100.0 * (found / truth - 1.0);
        Percentiles {
            d16: error(self.d16, truth.d16),
            d50: error(self.d50, truth.d50),
            d84: error(self.d84, truth.d84),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_count_lies_between_and_nothing_has_no_mean() {
        assert_eq!(Middle::of([4.0, 1.0, 2.0, f64::NAN, 5.0]), Middle { mean: 3.0, median: 3.0 });
        assert_eq!(Middle::of([4.0, 1.0, 2.0]).median, 2.0);
        let none = Middle::of([]);
        assert!(none.mean.is_nan() && none.median.is_nan());
        assert_eq!(Percentiles::of([]), None);
    }

    #[test]
    fn percentiles_are_those_of_numpy() {
        // numpy.percentile([1, 2, 3, 4], [16, 50, 84]) gives 1.48, 2.5, 3.52.
        let found = Percentiles::of([3.0, 1.0, 4.0, 2.0]).expect("four");
        for (found, expected) in found.to_array().into_iter().zip([1.48, 2.5, 3.52]) {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
        let error = found.error_percent(found.map(|d| 2.0 * d));
        assert_eq!(error.to_array(), [-50.0; 3]);
    }
}
