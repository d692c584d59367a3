//! Map colours: touching grains differ.

use crate::measure::Grain;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

type Boxed = GeomWithData<Rectangle<[i64; 2]>, usize>;

/// The smallest colour number that no lower-numbered touching grain has, for grains by ascending anchor.
///
/// Two grains touch when the outline of one has a corner within `touch_steps` of the other's box in plan:
/// true of every pair of outlines that come so near, of some that do not quite, and cheap.
pub(super) fn colors(grains: &[Grain], touch_steps: i64) -> Vec<u32> {
    let boxes: Vec<Option<AABB<[i64; 2]>>> = grains.iter().map(|g| grown_box(g, touch_steps)).collect();
    let entries: Vec<Boxed> = boxes
        .iter()
        .enumerate()
        .filter_map(|(i, b)| b.map(|b| Boxed::new(Rectangle::from_corners(b.lower(), b.upper()), i)))
        .collect();
    let tree = RTree::bulk_load(entries);
    let mut colors: Vec<u32> = Vec::with_capacity(grains.len());
    for (i, b) in boxes.iter().enumerate() {
        let mut taken: Vec<u32> = b
            .iter()
            .flat_map(|b| tree.locate_in_envelope_intersecting(*b))
            .map(|entry| entry.data)
            .filter(|&j| j < i && (touch(&grains[i], &boxes[j]) || touch(&grains[j], &boxes[i])))
            .map(|j| colors[j])
            .collect();
        taken.sort_unstable();
        taken.dedup();
        colors.push((0..).zip(&taken).find(|(c, t)| c != *t).map_or(taken.len() as u32, |(c, _)| c));
    }
    colors
}

fn points(grain: &Grain) -> impl Iterator<Item = [i64; 2]> {
    grain.outline.iter().flatten().flatten().copied()
}

fn grown_box(grain: &Grain, by: i64) -> Option<AABB<[i64; 2]>> {
    let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
    for p in points(grain) {
        (0..2).for_each(|k| {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        });
    }
    (low[0] <= high[0]).then(|| AABB::from_corners([low[0] - by, low[1] - by], [high[0] + by, high[1] + by]))
}

fn touch(grain: &Grain, other: &Option<AABB<[i64; 2]>>) -> bool {
    other.is_some_and(|b| points(grain).any(|p| (0..2).all(|k| b.lower()[k] <= p[k] && p[k] <= b.upper()[k])))
}
