//! How much of each cell lies under a grain.
//!
//! Seen from above, outlines overlap: a stone that leans over another hides part of it. What lies under two counts once.

use super::grid::RasterGrid;
use crate::open::Frame;
use crate::stitch::Catalogue;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{IntOverlayOptions, Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::core::solver::Solver;
use i_overlay::i_float::int::point::IntPoint;
use rayon::prelude::*;
use std::ops::Range;

/// Parts of a cell's side in which overlapping outlines are put together.
const PARTS: f64 = (1u32 << 29) as f64;
/// Rings that are put together at once: of more, memory and time grow faster than their number.
const AT_ONCE: usize = 64;
/// Times that a cell is halved in both directions to that end.
const HALVINGS: u32 = 8;

/// A ring of a grain's outline, and a row of cells that it may reach into.
struct Crossing<'c> {
    row: usize,
    grain: usize,
    ring: &'c [[i64; 2]],
}

/// What of a ring lies in a cell, in cells from the cell's south-western corner.
struct Part {
    column: usize,
    grain: usize,
    ring: Vec<[f64; 2]>,
}

/// Share of each cell that outlines cover, 0 to 1, row-major from the north-west; and the sum of all shares.
pub(super) fn cover(catalogue: &Catalogue, frame: &Frame, grid: &RasterGrid) -> (Vec<f32>, f64) {
    let cells_per_step = frame.outline_step_m() / grid.cell_m;
    let shift = grid.corner_shift();
    let place = |p: &[i64; 2]| -> [f64; 2] { std::array::from_fn(|i| p[i] as f64 * cells_per_step + shift[i]) };
    let mut crossings = Vec::new();
    for (grain, of_grain) in catalogue.grains.iter().enumerate() {
        for ring in of_grain.grain.outline.iter().flatten() {
            let rows = span(ring.iter().map(|p| place(p)[1]), grid.rows);
            crossings.extend(rows.map(|row| Crossing { row, grain, ring }));
        }
    }
    crossings.sort_by_key(|crossing| crossing.row);
    // Row by row, so that only what is worked on is held twice.
    let of_rows: Vec<&[Crossing]> = crossings.chunk_by(|a, b| a.row == b.row).collect();
    let shares: Vec<Vec<(usize, f64)>> =
        of_rows.par_iter().map(|crossings| shares_of_row(crossings, grid.columns, &place)).collect();
    let mut cover = vec![0.0; grid.cells()];
    for (crossings, shares) in of_rows.iter().zip(&shares) {
        shares.iter().for_each(|&(column, share)| cover[grid.index(column, crossings[0].row)] = share as f32);
    }
    (cover, shares.iter().flatten().map(|(_, share)| share).sum())
}

/// The columns of a row in which anything lies, with the share that is covered.
fn shares_of_row(
    crossings: &[Crossing],
    columns: usize,
    place: &(impl Fn(&[i64; 2]) -> [f64; 2] + Sync),
) -> Vec<(usize, f64)> {
    let mut parts = Vec::new();
    for &Crossing { row, grain, ring } in crossings {
        let south = row as f64;
        let ring: Vec<[f64; 2]> = ring.iter().map(place).collect();
        let strip = clip(&clip(&ring, 1, south, 1.0), 1, south + 1.0, -1.0);
        for column in span(strip.iter().map(|p| p[0]), columns) {
            let west = column as f64;
            let mut ring = clip(&clip(&strip, 0, west, 1.0), 0, west + 1.0, -1.0);
            ring.iter_mut().for_each(|p| *p = [p[0] - west, p[1] - south]);
            parts.push(Part { column, grain, ring });
        }
    }
    parts.sort_by_key(|part| part.column);
    let of_cell = |parts: &[Part]| (parts[0].column, area(parts, [0.0, 0.0], 1.0, HALVINGS).clamp(0.0, 1.0));
    parts.chunk_by(|a, b| a.column == b.column).map(of_cell).collect()
}

/// Area that parts of rings cover, all of which lie in a square of a cell.
fn area(parts: &[Part], [west, south]: [f64; 2], side: f64, halvings: u32) -> f64 {
    // Rings of one grain do not overlap; holes run clockwise and take away.
    if parts.iter().all(|part| part.grain == parts[0].grain) {
        return parts.iter().map(|part| signed_area(&part.ring)).sum();
    }
    if parts.len() > AT_ONCE && halvings > 0 {
        let half = 0.5 * side;
        return halves(parts, 0, west + half)
            .into_iter()
            .zip([west, west + half])
            .flat_map(|(column, west)| {
                halves(&column, 1, south + half).into_iter().zip([[west, south], [west, south + half]])
            })
            .map(|(quarter, corner)| area(&quarter, corner, half, halvings - 1))
            .sum();
    }
    union_area(parts)
}

/// What of the parts lies below a line, and what above it.
fn halves(parts: &[Part], axis: usize, at: f64) -> [Vec<Part>; 2] {
    [-1.0, 1.0].map(|sign| {
        let of_part = |part: &Part| Part { ring: clip(&part.ring, axis, at, sign), ..*part };
        parts.iter().map(of_part).filter(|part| !part.ring.is_empty()).collect()
    })
}

/// Area of the union of rings.
fn union_area(parts: &[Part]) -> f64 {
    let mut overlay: Overlay<i32> = Overlay::new_custom(256, IntOverlayOptions::ogc(), Solver::default());
    for part in parts {
        let whole = |p: &[f64; 2]| p.map(|share| (share * PARTS).round() as i32);
        let ring: Vec<IntPoint<i32>> = part.ring.iter().map(whole).map(|[x, y]| IntPoint::new(x, y)).collect();
        overlay.add_contour(&ring, ShapeType::Subject);
    }
    // Around what lies in a hole of one grain and outside all others the rings wind 0 times.
    let rings = overlay.overlay(OverlayRule::Subject, FillRule::NonZero);
    let area = |ring: Vec<IntPoint<i32>>| {
        let ring: Vec<[f64; 2]> = ring.into_iter().map(|p| [f64::from(p.x) / PARTS, f64::from(p.y) / PARTS]).collect();
        signed_area(&ring)
    };
    rings.into_iter().flatten().map(area).sum()
}

/// The cells, of so many along an axis, that places on it meet; none where there are no places.
fn span(places: impl Iterator<Item = f64>, count: usize) -> Range<usize> {
    let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low > high || high < 0.0 || low >= count as f64 {
        return 0..0;
    }
    let first = low.floor().max(0.0) as usize;
    first..(high.ceil() as usize).clamp(first + 1, count.max(first + 1))
}

/// Sutherland-Hodgman against one line: keeps the side where `(p[axis] - at) * sign >= 0`. What is left of
/// a concave ring may run along the line and back, which adds no area.
fn clip(ring: &[[f64; 2]], axis: usize, at: f64, sign: f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::with_capacity(ring.len() + 4);
    let Some(&last) = ring.last() else { return kept };
    let mut from = last;
    for &to in ring {
        let (d_from, d_to) = ((from[axis] - at) * sign, (to[axis] - at) * sign);
        if (d_from < 0.0) != (d_to < 0.0) {
            let share = d_from / (d_from - d_to);
            let mut crossing: [f64; 2] = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share);
            crossing[axis] = at;
            kept.push(crossing);
        }
        if d_to >= 0.0 {
            kept.push(to);
        }
        from = to;
    }
    kept
}

/// Area of a ring, positive counter-clockwise, about its first point so that distant rings lose nothing.
fn signed_area(ring: &[[f64; 2]]) -> f64 {
    let Some(&[x0, y0]) = ring.first() else { return 0.0 };
    let twice: f64 = ring.windows(2).map(|w| (w[0][0] - x0) * (w[1][1] - y0) - (w[1][0] - x0) * (w[0][1] - y0)).sum();
    0.5 * twice
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of the first cell of a row of one; places are in hundredths of it.
    fn share_of(rings: &[(usize, Vec<[i64; 2]>)]) -> f64 {
        let crossing = |(grain, ring)| Crossing { row: 0, grain, ring };
        let crossings: Vec<Crossing> = rings.iter().map(|(grain, ring)| crossing((*grain, ring.as_slice()))).collect();
        let shares = shares_of_row(&crossings, 1, &|p| p.map(|x| x as f64 / 100.0));
        assert_eq!((shares.len(), shares[0].0), (1, 0));
        shares[0].1
    }

    fn square(west: i64, south: i64, side: i64) -> Vec<[i64; 2]> {
        vec![[west, south], [west + side, south], [west + side, south + side], [west, south + side]]
    }

    #[test]
    fn what_lies_under_two_grains_counts_once() {
        let [one, other] = [square(10, 10, 40), square(30, 30, 40)];
        assert!((share_of(&[(0, one.clone())]) - 0.16).abs() < 1e-12);
        assert!((share_of(&[(0, one.clone()), (1, other)]) - 0.28).abs() < 1e-6);
        assert!((share_of(&[(0, one.clone()), (1, one)]) - 0.16).abs() < 1e-6);
    }

    #[test]
    fn a_grain_in_the_hole_of_another_adds_to_it() {
        let mut hole = square(30, 30, 40);
        hole.reverse();
        let ring = [(0, square(10, 10, 80)), (0, hole)];
        assert!((share_of(&ring) - 0.48).abs() < 1e-12);
        let within = [&ring[..], &[(1, square(40, 40, 20))]].concat();
        assert!((share_of(&within) - 0.52).abs() < 1e-6);
        let across = [&ring[..], &[(1, square(20, 40, 20))]].concat();
        assert!((share_of(&across) - 0.50).abs() < 1e-6, "half of it lies on the ring: {}", share_of(&across));
    }

    #[test]
    fn hundreds_of_grains_in_a_cell_cover_what_a_count_of_its_points_says() {
        // Squares over squares, by a rule that repeats itself late.
        let places = (0..400u64).map(|i| [i * i * 37 % 83, i * 53 % 89].map(|x| x as i64 - 3));
        let rings: Vec<(usize, Vec<[i64; 2]>)> =
            places.enumerate().map(|(i, [x, y])| (i, square(x, y, 2 + i as i64 % 7))).collect();
        let covered = |x: i64, y: i64| {
            rings.iter().any(|(_, ring)| (ring[0][0]..ring[1][0]).contains(&x) && (ring[0][1]..ring[2][1]).contains(&y))
        };
        let count = (0..100).flat_map(|x| (0..100).map(move |y| (x, y))).filter(|&(x, y)| covered(x, y)).count();
        assert!((2000..9000).contains(&count), "{count}");
        assert!((share_of(&rings) - count as f64 / 1e4).abs() < 1e-6, "{} is not {count}", share_of(&rings));
    }

    #[test]
    fn what_reaches_beyond_the_cell_does_not_count() {
        assert!(
            (share_of(&[(0, square(50, 50, 200)), (1, square(-100, -100, 175))]) - 0.75 * 0.75 - 0.1875).abs() < 1e-6
        );
    }
}
