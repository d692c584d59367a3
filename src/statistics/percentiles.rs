//! Percentiles of grain size on two bases.
//!
//! **Area-by-number**: each grain counts once. The p-th percentile interpolates linearly between the order
//! statistics: with sizes x(0) <= ... <= x(n-1) and h = (n-1) p/100 it is x at position h ("type 7", the
//! default of NumPy and R).
//!
//! **Grid-by-number**: a stone is hit by a grid point in proportion to its area, so each grain weighs its
//! b² (Kellerhals & Bray 1971, exponent 2). The weighted curve puts each grain at the middle of its own
//! weight: grain i, of weight w(i), stands at P(i) = 100 (w(0) + ... + w(i-1) + w(i)/2) / W. The percentile
//! interpolates size linearly between neighbouring P(i); below the first and above the last it is the
//! smallest and the largest size. With equal weights this is the Hazen rule ("type 5"), not type 7.

/// Sizes in ascending order, with the running sums that both bases need.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sizes {
    ascending: Vec<f64>,
    /// Middle of each grain's weight on the running sum of b².
    middles: Vec<f64>,
    total_weight: f64,
}

impl Sizes {
    /// Sizes in any order and any unit; those that are not finite are left out.
    pub fn new(sizes: impl IntoIterator<Item = f64>) -> Sizes {
        let mut ascending: Vec<f64> = sizes.into_iter().filter(|s| s.is_finite()).collect();
        ascending.sort_unstable_by(f64::total_cmp);
        let mut total_weight = 0.0;
        let middles = ascending
            .iter()
            .map(|s| {
                let weight = s * s;
                let middle = total_weight + 0.5 * weight;
                total_weight += weight;
                middle
            })
            .collect();
        Sizes { ascending, middles, total_weight }
    }

    /// Number of sizes.
    pub fn len(&self) -> usize {
        self.ascending.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.ascending.is_empty()
    }

    /// Area-by-number percentile (type 7), `percent` in 0 to 100; none without grains.
    pub fn area_by_number(&self, percent: f64) -> Option<f64> {
        let last = self.ascending.len().checked_sub(1)?;
        let position = last as f64 * (percent / 100.0).clamp(0.0, 1.0);
        let below = (position.floor() as usize).min(last);
        let above = (below + 1).min(last);
        Some(between(self.ascending[below], self.ascending[above], position - below as f64))
    }

    /// Grid-by-number percentile (weights b², midpoint rule), `percent` in 0 to 100; none without grains.
    pub fn grid_by_number(&self, percent: f64) -> Option<f64> {
        let (first, last) = (*self.ascending.first()?, *self.ascending.last()?);
        let target = self.total_weight * (percent / 100.0).clamp(0.0, 1.0);
        let above = self.middles.partition_point(|&m| m < target);
        if above == 0 {
            return Some(first);
        }
        if above == self.middles.len() {
            return Some(last);
        }
        let (low, high) = (self.middles[above - 1], self.middles[above]);
        let share = (target - low) / (high - low);
        Some(between(self.ascending[above - 1], self.ascending[above], share))
    }

    /// Arithmetic mean, each grain counted once; none without grains.
    pub fn area_by_number_mean(&self) -> Option<f64> {
        (!self.is_empty()).then(|| self.ascending.iter().sum::<f64>() / self.len() as f64)
    }

    /// Arithmetic mean with weights b²; none without grains.
    pub fn grid_by_number_mean(&self) -> Option<f64> {
        (self.total_weight > 0.0)
            .then(|| self.ascending.iter().map(|s| s * s * s).sum::<f64>() / self.total_weight)
            .or(self.area_by_number_mean())
    }
}

fn between(low: f64, high: f64, share: f64) -> f64 {
    low + (high - low) * share
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_by_number_interpolates_between_order_statistics_as_numpy_does() {
        let sizes = Sizes::new([4.0, 1.0, 3.0, 2.0]);
        assert_eq!(sizes.area_by_number(50.0), Some(2.5));
        assert_eq!(sizes.area_by_number(0.0), Some(1.0));
        assert_eq!(sizes.area_by_number(100.0), Some(4.0));
        let d84 = sizes.area_by_number(84.0).expect("four grains");
        assert!((d84 - 3.52).abs() < 1e-12, "{d84}");
    }

    #[test]
    fn grid_by_number_puts_each_grain_at_the_middle_of_its_weight() {
        // Weights 1, 4, 9: middles 0.5, 3, 9.5 of 14.
        let sizes = Sizes::new([3.0, 1.0, 2.0]);
        let at = |weight: f64| sizes.grid_by_number(100.0 * weight / 14.0).expect("three grains");
        assert!((at(3.0) - 2.0).abs() < 1e-12);
        assert!((at(1.75) - 1.5).abs() < 1e-12);
        assert!((at(6.25) - 2.5).abs() < 1e-12);
        assert_eq!((at(0.1), at(13.9)), (1.0, 3.0));
        let mean = sizes.grid_by_number_mean().expect("three grains");
        assert!((mean - 36.0 / 14.0).abs() < 1e-12);
    }

    #[test]
    fn a_grid_hits_large_stones_more_often_than_a_count_of_all() {
        let sizes = Sizes::new((1..=100).map(|i| f64::from(i) * 1e-3));
        let (area, grid) = (sizes.area_by_number(50.0), sizes.grid_by_number(50.0));
        assert!((area.expect("grains") - 0.0505).abs() < 1e-12);
        // The continuous answer is 0.1 / 2^(1/3) = 0.0794.
        assert!((grid.expect("grains") - 0.0794).abs() < 5e-4, "{grid:?}");
    }

    #[test]
    fn no_grains_have_no_percentile_and_one_grain_has_one() {
        let none = Sizes::new([f64::NAN]);
        assert!(none.is_empty());
        assert_eq!((none.area_by_number(50.0), none.grid_by_number(50.0)), (None, None));
        assert_eq!((none.area_by_number_mean(), none.grid_by_number_mean()), (None, None));
        let one = Sizes::new([0.02]);
        assert_eq!((one.area_by_number(84.0), one.grid_by_number(16.0)), (Some(0.02), Some(0.02)));
    }
}
