//! How many stones were found, and the shares that follow from it.

/// Counts of found and missed stones and false grains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Detection {
    /// Visible stones that were found: true positives.
    pub found: usize,
    /// Visible stones that were not: false negatives.
    pub missed: usize,
    /// Grains that are no stone, or a stone once more: false positives.
    pub false_grains: usize,
}

impl Detection {
    /// Share of the grains that are right, 0 to 1; 0 without grains.
    pub fn precision(&self) -> f64 {
        share(self.found, self.found + self.false_grains)
    }

    /// Share of the visible stones that were found, 0 to 1; 0 without stones.
    pub fn recall(&self) -> f64 {
        share(self.found, self.found + self.missed)
    }

    /// Harmonic mean of precision and recall, 0 to 1.
    pub fn f1(&self) -> f64 {
        share(2 * self.found, 2 * self.found + self.missed + self.false_grains)
    }

    /// Found stones over all stones and false grains together, 0 to 1.
    pub fn iou(&self) -> f64 {
        share(self.found, self.found + self.missed + self.false_grains)
    }
}

fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}
