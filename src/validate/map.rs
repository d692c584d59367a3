//! The map of a validation: what became of each stone and grain, by colour, seen from above.

use super::judgement::Mostly;
use super::labels::Labels;
use super::score::Scored;
use super::truth::Truth;
use crate::picture::{Picture, top_view};

/// Width of the picture, pixels.
const WIDTH_PX: usize = 1600;
/// Outlines of the true stones.
const OUTLINE: [u8; 3] = [0, 0, 0];

/// What a triangle shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// Sand, or a stone too hidden to count, in no grain.
    Ground,
    /// A found stone, where its grain holds it.
    Found,
    /// A found stone, where its grain does not.
    FoundStoneOnly,
    /// A grain beyond its stone.
    GrainOnly,
    /// A stone in several grains: in the one that counts, or in none.
    Split,
    /// The further grains of such a stone.
    SplitFurther,
    /// A stone in the grain of another.
    Merged,
    /// A stone that no grain holds.
    Missed,
    /// A grain that is mostly sand.
    False,
    /// A grain on a hidden stone, on a membrane, or too small: not judged.
    Ignored,
}

impl Shown {
    /// All of them, in the order of the legend.
    pub const ALL: [Shown; 10] = [
        Shown::Found,
        Shown::FoundStoneOnly,
        Shown::GrainOnly,
        Shown::Split,
        Shown::SplitFurther,
        Shown::Merged,
        Shown::Missed,
        Shown::False,
        Shown::Ignored,
        Shown::Ground,
    ];

    /// The colour, before shading.
    pub fn color(self) -> [u8; 3] {
        match self {
            Shown::Found => [60, 160, 75],
            Shown::FoundStoneOnly => [175, 225, 165],
            Shown::GrainOnly => [95, 180, 215],
            Shown::Split => [190, 150, 225],
            Shown::SplitFurther => [125, 60, 175],
            Shown::Merged => [245, 145, 40],
            Shown::Missed => [215, 45, 45],
            Shown::False => [245, 220, 50],
            Shown::Ignored => [135, 135, 135],
            Shown::Ground => [214, 206, 190],
        }
    }

    /// The colour's name and what it means.
    pub fn legend(self) -> (&'static str, &'static str) {
        match self {
            Shown::Found => ("green", "found: stone and grain"),
            Shown::FoundStoneOnly => ("light green", "found, but this part of the stone is not in its grain"),
            Shown::GrainOnly => ("blue", "grain beyond its stone"),
            Shown::Split => ("light purple", "split stone: the grain that counts"),
            Shown::SplitFurther => ("purple", "split stone: its further grains"),
            Shown::Merged => ("orange", "missed: merged into another grain"),
            Shown::Missed => ("red", "missed: in no grain to speak of"),
            Shown::False => ("yellow", "false grain: mostly sand"),
            Shown::Ignored => ("grey", "grain that is not judged: hidden stone, membrane, too small"),
            Shown::Ground => ("sand", "sand and hidden stones in no grain"),
        }
    }
}

/// What becomes of a stone that counts.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    Hidden,
    Found,
    Split,
    Merged,
    Missed,
}

/// What each triangle shows.
pub fn shown(truth: &Truth, labels: &Labels, scored: &Scored) -> Vec<Shown> {
    let fates = fates(truth, scored);
    let judgement = &scored.judgement;
    let of_triangle = |(&stone, &label): (&i32, &i64)| {
        let grain = scored.overlaps.place(label);
        let stone = usize::try_from(stone).ok();
        let fate = stone.map_or(Fate::Hidden, |stone| fates[stone]);
        let kind = grain.map(|grain| judgement.mostly[grain]);
        let is_its = stone.is_some() && kind.and_then(Mostly::stone) == stone;
        let counts = stone.is_some_and(|stone| grain.is_some() && judgement.matches.get(&stone) == grain.as_ref());
        match (fate, kind) {
            (Fate::Missed, _) => Shown::Missed,
            (Fate::Merged, _) => Shown::Merged,
            (Fate::Split, _) if is_its && !counts => Shown::SplitFurther,
            (Fate::Split, _) => Shown::Split,
            (Fate::Found, _) if counts => Shown::Found,
            (Fate::Found, _) => Shown::FoundStoneOnly,
            (Fate::Hidden, None) => Shown::Ground,
            (Fate::Hidden, Some(Mostly::Sand)) => Shown::False,
            (Fate::Hidden, Some(Mostly::Stone(_))) => Shown::GrainOnly,
            (Fate::Hidden, Some(_)) => Shown::Ignored,
        }
    };
    truth.stone_of_triangle.iter().zip(&labels.of_triangle).map(of_triangle).collect()
}

fn fates(truth: &Truth, scored: &Scored) -> Vec<Fate> {
    let judgement = &scored.judgement;
    let mut grains = vec![0usize; truth.stones.len()];
    for stone in judgement.mostly.iter().filter_map(|kind| kind.stone()) {
        grains[stone] += 1;
    }
    let mut fates = vec![Fate::Hidden; truth.stones.len()];
    for &stone in judgement.matches.keys() {
        fates[stone] = if grains[stone] > 1 { Fate::Split } else { Fate::Found };
    }
    judgement.merged.iter().for_each(|&stone| fates[stone] = Fate::Merged);
    judgement.overlooked.iter().for_each(|&stone| fates[stone] = Fate::Missed);
    fates
}

/// The map, with the true stones outlined.
pub fn draw(truth: &Truth, labels: &Labels, scored: &Scored) -> Picture {
    let shown = shown(truth, labels, scored);
    let vertices: Vec<[f32; 3]> = truth.points.iter().map(|p| p.as_vec3().to_array()).collect();
    let mut picture = top_view(&vertices, &truth.triangles, &|t| shown[t].color(), WIDTH_PX);
    picture.draw_outlines(&|t| i64::from(truth.stone_of_triangle[t]), OUTLINE);
    picture
}
