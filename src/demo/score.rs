//! How well a segmentation finds the known stones, counted as Rheinwalt et al. (2025) count.

use super::scene::{Scene, Stone};
use super::settings::SAND;
use crate::validate::{Detection, Judgement, Overlaps, Percentiles, TrueSurface};
use std::fmt;

/// Smallest grain to ask for in the default scene, m²: stones of its smallest b axis have about twice that.
pub const MIN_GRAIN_AREA_M2: f64 = 3e-5;
/// A stone counts as visible from this many smallest grain areas in one piece.
pub const VISIBLE_AREA_FACTOR: f64 = 3.0;
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
    let triangles = 0..scene.triangles.len();
    let areas_m2: Vec<f64> = triangles.map(|t| scene.triangle_area_m2(t)).collect();
    let of_triangle = |&stone: &u32| if stone == SAND { -1 } else { stone as i32 };
    let stone_of_triangle: Vec<i32> = scene.stone_of_triangle.iter().map(of_triangle).collect();
    let surface = TrueSurface {
        areas_m2: &areas_m2,
        stone_of_triangle: &stone_of_triangle,
        unseen: &[],
        stones: scene.stones.len(),
    };
    let least = VISIBLE_AREA_FACTOR * min_grain_area_m2;
    let is_visible = |s: &Stone| s.connected_area_m2 >= least && s.connected_area_m2 > 0.0;
    let visible: Vec<bool> = scene.stones.iter().map(is_visible).collect();
    let overlaps = Overlaps::of(surface, grain_of_triangle);
    let judgement = Judgement::of(&overlaps, &visible, 0.0);
    let errors: Vec<[f64; 3]> = judgement
        .matches
        .iter()
        .filter_map(|(&stone, &grain)| {
            let axes = grain_axes(overlaps.grain_ids[grain])?;
            let truth = scene.stones[stone].axes_m;
            Some([0, 1, 2].map(|i| (axes[i] / truth[i] - 1.0).abs()))
        })
        .collect();
    let seen = scene.stones.iter().zip(&visible).filter(|&(_, &v)| v);
    let found_b = overlaps.grain_ids.iter().filter_map(|&id| grain_axes(id)).map(|axes| axes[1]);
    Score {
        visible_stones: judgement.visible,
        grains: overlaps.grains(),
        by_overlap: judgement.by_overlap,
        by_majority: judgement.by_majority,
        split_grains: judgement.split_grains,
        sand_grains: judgement.sand_grains,
        merged_stones: judgement.merged.len(),
        ignored_grains: judgement.hidden_grains,
        measured_stones: errors.len(),
        axis_error: (!errors.is_empty())
            .then(|| [0, 1, 2].map(|i| errors.iter().map(|e| e[i]).sum::<f64>() / errors.len() as f64)),
        true_b_m: Percentiles::of(seen.map(|(stone, _)| stone.axes_m[1])).map(Percentiles::to_array),
        found_b_m: Percentiles::of(found_b).map(Percentiles::to_array),
    }
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
        if self.ignored_grains > 0 {
            writeln!(f, "not judged: {} on stones that show too little to count", self.ignored_grains)?;
        }
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
