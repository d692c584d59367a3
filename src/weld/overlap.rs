//! Whether files hold the same ground twice.
//!
//! Along a border that is cut cleanly, what two files cover of a square adds up to the square. Where it adds up to
//! half a square more, they overlap by several triangles at least: no border looks like that.

use super::facts::{Doubled, PairFacts};
use super::near::{Cover, Near};
use super::parts::Part;
use crate::geometry::PlanBox;
use crate::open::Frame;
use std::collections::BTreeMap;

/// A square is held twice where two files cover this much more than all of it together.
const EXCESS: f64 = 0.5;
/// Below this, it is due to the triangles on the sides of the square, which count as a whole.
const LEAST_EXCESS: f64 = 0.1;
/// Two sheets above each other, as far apart as this many squares are wide, are not the same surface: a bank that
/// hangs over the bed, cut into files by height.
const APART_SQUARES: f64 = 2.0;
/// As many squares may be held twice by chance.
const MOST_SQUARES: u64 = 4;
/// So may this share of all that both files are in: where a reconstruction is folded, as between stones, what looks
/// up of one fold and what looks down of the other may be in different files.
const MOST_BORDER_SHARE: f64 = 0.02;
/// Share of a file's triangles in squares that are held twice, above which the survey is refused: below it, few
/// grains are found twice, which is said and no more.
const MOST_SHARE: f64 = 1e-3;

/// What each two files that come near each other have in common.
pub(super) fn pairs(near: &Near, frame: &Frame) -> BTreeMap<[usize; 2], PairFacts> {
    let input = |p: [f64; 2]| [0, 1].map(|i| p[i] / frame.metres_per_input_unit + frame.origin_input[i]);
    let mut pairs = BTreeMap::new();
    for square in near.covers.chunk_by(|a, b| a.0.0 == b.0.0) {
        for (i, &((square_number, first), a)) in square.iter().enumerate() {
            for &((_, second), b) in &square[i + 1..] {
                let pair: &mut PairFacts = pairs.entry([first, second]).or_default();
                pair.files = [first, second];
                pair.border_squares += 1;
                pair.border_m = pair.border_squares as f64 * near.sheet.side_m();
                let excess = a.share() + b.share() - 1.0;
                if excess > LEAST_EXCESS {
                    let apart = (a.height() - b.height()).abs() > APART_SQUARES;
                    let twice = if apart { &mut pair.stacked } else { &mut pair.doubled };
                    // Where it is certain, holes in both need not be made up for.
                    let share = if excess > EXCESS { a.share().min(b.share()) } else { excess };
                    twice.area_m2 += share * near.sheet.side_m() * near.sheet.side_m();
                    if excess > EXCESS {
                        let local = near.sheet.outline(square_number);
                        add(twice, [a, b], &PlanBox { min: input(local.min), max: input(local.max) });
                    }
                }
            }
        }
    }
    pairs
}

fn add(twice: &mut Doubled, [a, b]: [Cover; 2], place: &PlanBox) {
    twice.squares += 1;
    twice.triangles[0] += a.triangles;
    twice.triangles[1] += b.triangles;
    twice.place.get_or_insert(PlanBox::EMPTY).merge(place);
}

impl Doubled {
    /// Whether it is more than borders that were measured coarsely can explain.
    pub(super) fn is_real(&self, border_squares: u64) -> bool {
        self.squares > MOST_SQUARES && self.squares as f64 > MOST_BORDER_SHARE * border_squares as f64
    }

    /// Whether so much is held twice that the result would mean nothing.
    pub(super) fn is_too_much(&self, border_squares: u64, files: [&Part; 2]) -> bool {
        let share = |i: usize| self.triangles[i] as f64 / files[i].size().max(1) as f64;
        self.is_real(border_squares) && share(0).max(share(1)) > MOST_SHARE
    }
}
