//! How well a segmentation finds the known stones, counted as Rheinwalt et al. (2025) count.

use super::scene::Scene;
use super::settings::SAND;
use std::collections::BTreeMap;
use std::fmt;

/// Smallest grain to ask for in the default scene, m²: stones of its smallest b axis have about twice that.
pub const MIN_GRAIN_AREA_M2: f64 = 3e-5;
/// A stone counts as visible from this many smallest grain areas in one piece.
pub const VISIBLE_AREA_FACTOR: f64 = 3.0;
/// A missed stone was merged into another grain, not overlooked, if a grain holds this share of it.
const MERGED_SHARE: f64 = 0.25;

/// Counts of found and missed stones and false grains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Detection {
    /// Visible stones that were found.
    pub found: usize,
    /// Visible stones that were not.
    pub missed: usize,
    /// Grains that are no stone, or a stone once more.
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
}

fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}

/// What a segmentation is worth. `Display` gives a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// Stones whose connected visible area is at least [`VISIBLE_AREA_FACTOR`] smallest grain areas.
    pub visible_stones: usize,
    /// Grains given.
    pub grains: usize,
    /// One grain, one stone, intersection over union of their triangle areas 0.5 or more.
    pub by_overlap: Detection,
    /// A stone is found if a grain is mostly it; further such grains are false.
    pub by_majority: Detection,
    /// Further grains on stones that were found already.
    pub split_grains: usize,
    /// Grains that are mostly sand.
    pub sand_grains: usize,
    /// Stones missed by majority that lie in another stone's grain.
    pub merged_stones: usize,
    /// Grains that are mostly a stone too hidden to count; never held against the segmentation.
    pub ignored_grains: usize,
    /// Stones found by majority whose grain has axes.
    pub measured_stones: usize,
    /// Mean over these of |found / true - 1| of the a, b and c axes; none without such stones.
    pub axis_error: Option<[f64; 3]>,
    /// D16, D50, D84 of the b axes of the visible stones, metres.
    pub true_b_m: Option<[f64; 3]>,
    /// D16, D50, D84 of the b axes of all grains, metres.
    pub found_b_m: Option<[f64; 3]>,
}

/// Areas that grains and stones share, m².
struct Overlaps {
    grain_ids: Vec<i64>,
    grain_area: Vec<f64>,
    stone_area: Vec<f64>,
    visible: Vec<bool>,
    /// Shared area by grain and stone; the sand counts as stone [`SAND`].
    shared: BTreeMap<(usize, u32), f64>,
}

/// What the largest part of a grain is.
#[derive(Clone, Copy, PartialEq)]
enum Mostly {
    Sand,
    Hidden,
    Visible(usize),
}

/// Scores a segmentation of the scene.
///
/// `grain_of_triangle`: any number for each grain, -1 (or less) for no grain; triangles beyond its end
/// have none. `grain_axes`: full axes a, b, c of a grain in metres, where it was measured.
/// `min_grain_area_m2`: the smallest grain that the segmentation was asked for.
pub fn score(
    scene: &Scene,
    grain_of_triangle: &[i64],
    grain_axes: &dyn Fn(i64) -> Option<[f64; 3]>,
    min_grain_area_m2: f64,
) -> Score {
    let overlaps = Overlaps::new(scene, grain_of_triangle, min_grain_area_m2);
    let mostly = overlaps.mostly();
    let visible_stones = overlaps.visible.iter().filter(|&&v| v).count();
    let matches = overlaps.majority_matches(&mostly);
    let on = |kind: Mostly| mostly.iter().filter(|&&m| m == kind).count();
    let (sand_grains, ignored_grains) = (on(Mostly::Sand), on(Mostly::Hidden));
    let split_grains = mostly.len() - sand_grains - ignored_grains - matches.len();
    let errors: Vec<[f64; 3]> = matches
        .iter()
        .filter_map(|(&stone, &grain)| {
            let axes = grain_axes(overlaps.grain_ids[grain])?;
            let truth = scene.stones[stone].axes_m;
            Some([0, 1, 2].map(|i| (axes[i] / truth[i] - 1.0).abs()))
        })
        .collect();
    let seen = scene.stones.iter().zip(&overlaps.visible).filter(|&(_, &v)| v);
    let found_b = overlaps.grain_ids.iter().filter_map(|&id| grain_axes(id)).map(|axes| axes[1]);
    Score {
        visible_stones,
        grains: mostly.len(),
        by_overlap: overlaps.by_overlap(&mostly),
        by_majority: Detection {
            found: matches.len(),
            missed: visible_stones - matches.len(),
            false_grains: split_grains + sand_grains,
        },
        split_grains,
        sand_grains,
        merged_stones: overlaps.merged(&matches),
        ignored_grains,
        measured_stones: errors.len(),
        axis_error: (!errors.is_empty())
            .then(|| [0, 1, 2].map(|i| errors.iter().map(|e| e[i]).sum::<f64>() / errors.len() as f64)),
        true_b_m: percentiles(seen.map(|(stone, _)| stone.axes_m[1]).collect()),
        found_b_m: percentiles(found_b.collect()),
    }
}

impl Overlaps {
    fn new(scene: &Scene, grain_of_triangle: &[i64], min_grain_area_m2: f64) -> Overlaps {
        let mut grain_ids: Vec<i64> = grain_of_triangle.iter().copied().filter(|&g| g >= 0).collect();
        grain_ids.sort_unstable();
        grain_ids.dedup();
        let mut grain_area = vec![0.0; grain_ids.len()];
        let mut shared = BTreeMap::new();
        for (triangle, (grain, &stone)) in grain_of_triangle.iter().zip(&scene.stone_of_triangle).enumerate() {
            if let Ok(grain) = grain_ids.binary_search(grain) {
                let area = scene.triangle_area_m2(triangle);
                grain_area[grain] += area;
                *shared.entry((grain, stone)).or_insert(0.0) += area;
            }
        }
        let least = VISIBLE_AREA_FACTOR * min_grain_area_m2;
        Overlaps {
            grain_ids,
            grain_area,
            stone_area: scene.stones.iter().map(|s| s.visible_area_m2).collect(),
            visible: scene.stones.iter().map(|s| s.connected_area_m2 >= least && s.connected_area_m2 > 0.0).collect(),
            shared,
        }
    }

    /// Per grain what it is mostly; sand wins a tie, then the lower stone.
    fn mostly(&self) -> Vec<Mostly> {
        let mut best = vec![(0.0, SAND); self.grain_ids.len()];
        for (&(grain, stone), &area) in &self.shared {
            let more = area > best[grain].0 || (area == best[grain].0 && stone == SAND);
            if more {
                best[grain] = (area, stone);
            }
        }
        let kind = |(_, stone): (f64, u32)| match self.visible.get(stone as usize) {
            None => Mostly::Sand,
            Some(false) => Mostly::Hidden,
            Some(true) => Mostly::Visible(stone as usize),
        };
        best.into_iter().map(kind).collect()
    }

    /// For each stone found by majority the grain that holds most of it.
    fn majority_matches(&self, mostly: &[Mostly]) -> BTreeMap<usize, usize> {
        let mut matches: BTreeMap<usize, usize> = BTreeMap::new();
        for (grain, kind) in mostly.iter().enumerate() {
            if let Mostly::Visible(stone) = *kind {
                let held = |g: usize| self.shared.get(&(g, stone as u32)).copied().unwrap_or(0.0);
                let best = matches.entry(stone).or_insert(grain);
                if held(grain) > held(*best) {
                    *best = grain;
                }
            }
        }
        matches
    }

    fn by_overlap(&self, mostly: &[Mostly]) -> Detection {
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (&(grain, stone), &area) in &self.shared {
            let stone = stone as usize;
            if self.visible.get(stone) == Some(&true) {
                let iou = area / (self.grain_area[grain] + self.stone_area[stone] - area);
                if iou >= 0.5 {
                    pairs.push((iou, stone, grain));
                }
            }
        }
        // Exact halves could pair twice: the better pair goes first.
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut stone_taken = vec![false; self.visible.len()];
        let mut grain_taken = vec![false; mostly.len()];
        for (_, stone, grain) in pairs {
            if !stone_taken[stone] && !grain_taken[grain] {
                stone_taken[stone] = true;
                grain_taken[grain] = true;
            }
        }
        let found = stone_taken.iter().filter(|&&t| t).count();
        let is_false = |(kind, taken): (&Mostly, &bool)| !*taken && *kind != Mostly::Hidden;
        Detection {
            found,
            missed: self.visible.iter().filter(|&&v| v).count() - found,
            false_grains: mostly.iter().zip(&grain_taken).filter(|&(k, t)| is_false((k, t))).count(),
        }
    }

    fn merged(&self, matches: &BTreeMap<usize, usize>) -> usize {
        let mut largest = vec![0.0f64; self.visible.len()];
        for (&(_, stone), &area) in &self.shared {
            if let Some(most) = largest.get_mut(stone as usize) {
                *most = most.max(area);
            }
        }
        let lost = |stone: &usize| self.visible[*stone] && !matches.contains_key(stone);
        (0..largest.len()).filter(lost).filter(|&s| largest[s] >= MERGED_SHARE * self.stone_area[s]).count()
    }
}

/// D16, D50 and D84, linear between ranks; none without values.
fn percentiles(mut values: Vec<f64>) -> Option<[f64; 3]> {
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some([0.16, 0.5, 0.84].map(|p| {
        let rank = p * last as f64;
        let low = rank.floor() as usize;
        values[low] + (rank - low as f64) * (values[(low + 1).min(last)] - values[low])
    }))
}

impl fmt::Display for Score {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} visible stones, {} grains found", self.visible_stones, self.grains)?;
        writeln!(
            f,
            "{:<28}{:>7}{:>8}{:>7}{:>11}{:>8}{:>7}",
            "", "found", "missed", "false", "precision", "recall", "F1"
        )?;
        for (name, d) in [("overlap of half or more", self.by_overlap), ("mostly the stone", self.by_majority)] {
            let (precision, recall, f1) = (100.0 * d.precision(), 100.0 * d.recall(), d.f1());
            writeln!(
                f,
                "{name:<28}{:>7}{:>8}{:>7}{precision:>9.1} %{recall:>6.1} %{f1:>7.3}",
                d.found, d.missed, d.false_grains
            )?;
        }
        writeln!(
            f,
            "false: {} on sand, {} further pieces of a stone; missed: {} merged with a neighbour",
            self.sand_grains, self.split_grains, self.merged_stones
        )?;
        if let Some(error) = self.axis_error {
            let [a, b, c] = error.map(|e| 100.0 * e);
            writeln!(
                f,
                "axes of {} stones off by (mean)   a {a:.1} %   b {b:.1} %   c {c:.1} %",
                self.measured_stones
            )?;
        }
        if let Some(truth) = self.true_b_m {
            write!(f, "b axis")?;
            for (i, name) in ["D16", "D50", "D84"].into_iter().enumerate() {
                write!(f, "   {name} {:.1} mm", 1e3 * truth[i])?;
                if let Some(found) = self.found_b_m {
                    write!(f, " (found {:.1})", 1e3 * found[i])?;
                }
            }
        }
        Ok(())
    }
}
