//! The order of the few elements of a cell.

use std::cmp::Ordering;

/// Sorts by plain integers, which is several times as fast as comparing elements, and compares those elements only
/// that the integers do not tell apart. Kept for many cells, so that it need not be made anew.
#[derive(Default)]
pub(super) struct Sorter {
    keys: Vec<u64>,
}

impl Sorter {
    /// Places of the elements in the order of `exact`, in which `rough` must never descend.
    pub(super) fn places<T>(
        &mut self,
        elements: &[T],
        rough: impl Fn(&T) -> u64,
        exact: impl Fn(&T, &T) -> Ordering,
    ) -> impl Iterator<Item = usize> + '_ {
        // The place of an element lies below its rough key, as much of it as there is room for.
        let bits = usize::BITS - elements.len().leading_zeros();
        let place = move |key: u64| (key & ((1 << bits) - 1)) as usize;
        let keys = &mut self.keys;
        keys.clear();
        keys.extend(elements.iter().map(rough));
        let (lowest, highest) = keys.iter().fold((u64::MAX, 0), |(low, high), &k| (k.min(low), k.max(high)));
        let span = u64::BITS - highest.saturating_sub(lowest).leading_zeros();
        let shift = (span + bits).saturating_sub(u64::BITS);
        for (i, key) in (0..).zip(keys.iter_mut()) {
            *key = (*key - lowest) >> shift << bits | i;
        }
        keys.sort_unstable();
        let mut rest = keys.as_mut_slice();
        while let [first, second, ..] = *rest {
            let mut same = 1;
            if first >> bits == second >> bits {
                same = rest.iter().take_while(|&&key| key >> bits == first >> bits).count();
                rest[..same].sort_unstable_by(|&a, &b| exact(&elements[place(a)], &elements[place(b)]));
            }
            rest = &mut rest[same..];
        }
        self.keys.iter().map(move |&key| place(key))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rough_keys_of_any_width_give_the_exact_order() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 16
        };
        let mut sorter = Sorter::default();
        for n in [0, 1, 2, 3, 20, 64, 65, 1000] {
            for (width, scale) in [(1, 1), (3, u64::MAX / 3), (40, 1 << 57), (1 << 40, 1 << 20), (1 << 40, 1)] {
                let elements: Vec<(u64, u64)> = (0..n).map(|_| (random() % width * scale, random() % 9)).collect();
                let found: Vec<_> = sorter.places(&elements, |e| e.0, Ord::cmp).map(|i| elements[i]).collect();
                let mut sorted = elements;
                sorted.sort_unstable();
                assert_eq!(found, sorted, "{n} keys below {width} times {scale}");
            }
        }
    }
}
