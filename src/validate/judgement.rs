//! What became of each stone and what each grain is, as Rheinwalt et al. (2025) count.
//!
//! By *majority* a stone is found if some grain is mostly it; the grain that holds most of it is its match, and
//! further such grains are over-segmentation. By *overlap* a grain and a stone are a pair if their intersection over
//! union is half or more. Only visible stones count, and a grain that is mostly a hidden stone, or mostly a membrane
//! that the reconstruction spans over space that no camera saw, is held against nobody.

use super::detection::Detection;
use super::overlap::Overlaps;
use std::collections::BTreeMap;

/// A missed stone was merged into another grain, not overlooked, if a grain holds this share of it.
const MERGED_SHARE: f64 = 0.25;
/// A grain and a stone of this intersection over union are a pair.
const PAIR_IOU: f64 = 0.5;

/// What the largest part of a grain is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mostly {
    /// Not asked: the grain is smaller than the smallest that counts.
    Small,
    /// Sand: the grain is false.
    Sand,
    /// A membrane over unseen space: ignored.
    Unseen,
    /// A stone that is too hidden to count: ignored.
    Hidden(usize),
    /// A visible stone.
    Stone(usize),
}

impl Mostly {
    /// The stone that the grain is mostly, visible or not.
    pub fn stone(self) -> Option<usize> {
        match self {
            Mostly::Hidden(stone) | Mostly::Stone(stone) => Some(stone),
            Mostly::Small | Mostly::Sand | Mostly::Unseen => None,
        }
    }

    /// Whether the grain is held for right or false.
    pub fn is_judged(self) -> bool {
        matches!(self, Mostly::Sand | Mostly::Stone(_))
    }
}

/// A labelling, judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// Visible stones.
    pub visible: usize,
    /// Grains that count.
    pub grains: usize,
    /// What each grain is mostly.
    pub mostly: Vec<Mostly>,
    /// Whether each grain is one of a pair by overlap.
    pub is_right: Vec<bool>,
    /// The matching grain of each stone that was found by majority.
    pub matches: BTreeMap<usize, usize>,
    /// One grain, one stone, intersection over union 0.5 or more.
    pub by_overlap: Detection,
    /// A stone is found if a grain is mostly it.
    pub by_majority: Detection,
    /// Further grains on stones that were found.
    pub split_grains: usize,
    /// Stones with such grains.
    pub split_stones: usize,
    /// Grains that are mostly sand.
    pub sand_grains: usize,
    /// Grains that are mostly a membrane over unseen space.
    pub unseen_grains: usize,
    /// Grains that are mostly a hidden stone.
    pub hidden_grains: usize,
    /// Stones missed by majority that lie in another stone's grain.
    pub merged: Vec<usize>,
    /// The other stones missed by majority.
    pub overlooked: Vec<usize>,
}

impl Judgement {
    /// Judges grains of at least `min_area_m2` against the stones that are visible.
    pub fn of(overlaps: &Overlaps, visible: &[bool], min_area_m2: f64) -> Judgement {
        let grains = 0..overlaps.grains();
        let mostly: Vec<Mostly> = grains.map(|grain| mostly(overlaps, visible, min_area_m2, grain)).collect();
        let visible_stones = visible.iter().filter(|&&v| v).count();
        let (matches, split_stones) = majority_matches(overlaps, &mostly);
        let count = |wanted: fn(Mostly) -> bool| mostly.iter().filter(|&&m| wanted(m)).count();
        let sand_grains = count(|m| m == Mostly::Sand);
        let split_grains = count(|m| matches!(m, Mostly::Stone(_))) - matches.len();
        let lost = (0..visible.len()).filter(|stone| visible[*stone] && !matches.contains_key(stone));
        let (merged, overlooked) = lost.partition(|&stone| {
            let held = overlaps.largest_on(stone).map_or(0.0, |(_, area)| area);
            overlaps.grains() > 0 && held >= MERGED_SHARE * overlaps.stone_area_m2[stone]
        });
        let is_right = pairs(overlaps, visible, &mostly);
        let found = is_right.iter().filter(|&&right| right).count();
        let is_false = |(m, right): (&Mostly, &bool)| !right && m.is_judged();
        Judgement {
            visible: visible_stones,
            grains: count(|m| m != Mostly::Small),
            by_overlap: Detection {
                found,
                missed: visible_stones - found,
                false_grains: mostly.iter().zip(&is_right).filter(|&(m, right)| is_false((m, right))).count(),
            },
            by_majority: Detection {
                found: matches.len(),
                missed: visible_stones - matches.len(),
                false_grains: split_grains + sand_grains,
            },
            split_grains,
            split_stones,
            sand_grains,
            unseen_grains: count(|m| m == Mostly::Unseen),
            hidden_grains: count(|m| matches!(m, Mostly::Hidden(_))),
            mostly,
            is_right,
            matches,
            merged,
            overlooked,
        }
    }
}

/// What a grain is mostly; sand wins a tie, then the lower stone.
fn mostly(overlaps: &Overlaps, visible: &[bool], min_area_m2: f64, grain: usize) -> Mostly {
    if overlaps.grain_area_m2[grain] < min_area_m2 {
        return Mostly::Small;
    }
    let sand = overlaps.sand_m2[grain];
    let mut best = (sand, None);
    for &(stone, area) in overlaps.of_grain(grain) {
        if area > best.0 {
            best = (area, Some(stone));
        }
    }
    match best.1 {
        None if overlaps.unseen_m2[grain] > 0.5 * sand => Mostly::Unseen,
        None => Mostly::Sand,
        Some(stone) if visible[stone] => Mostly::Stone(stone),
        Some(stone) => Mostly::Hidden(stone),
    }
}

/// For each stone found by majority the grain that holds most of it, and the number of stones with several grains.
fn majority_matches(overlaps: &Overlaps, mostly: &[Mostly]) -> (BTreeMap<usize, usize>, usize) {
    let mut grains_of: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (grain, kind) in mostly.iter().enumerate() {
        if let Mostly::Stone(stone) = *kind {
            grains_of.entry(stone).or_default().push(grain);
        }
    }
    let split = grains_of.values().filter(|grains| grains.len() > 1).count();
    let most = |(stone, grains): (usize, Vec<usize>)| {
        let held = |grain: usize| overlaps.shared_m2(grain, stone);
        // The first of several that hold as much.
        let best = grains.into_iter().reduce(|best, grain| if held(grain) > held(best) { grain } else { best })?;
        Some((stone, best))
    };
    (grains_of.into_iter().filter_map(most).collect(), split)
}

/// Whether each grain is one of a pair by overlap.
fn pairs(overlaps: &Overlaps, visible: &[bool], mostly: &[Mostly]) -> Vec<bool> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for grain in (0..overlaps.grains()).filter(|&grain| mostly[grain] != Mostly::Small) {
        for &(stone, _) in overlaps.of_grain(grain).iter().filter(|&&(stone, _)| visible[stone]) {
            let iou = overlaps.iou(grain, stone);
            if iou >= PAIR_IOU {
                pairs.push((iou, stone, grain));
            }
        }
    }
    // Above a half a pair is one by itself. Exact halves could pair twice: the better pair goes first.
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut stone_taken = vec![false; visible.len()];
    let mut grain_taken = vec![false; mostly.len()];
    for (_, stone, grain) in pairs {
        if !stone_taken[stone] && !grain_taken[grain] {
            stone_taken[stone] = true;
            grain_taken[grain] = true;
        }
    }
    grain_taken
}
