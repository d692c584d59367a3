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
const PARTS: f64 = 16_777_216.0;

/// A ring of a grain's outline, and a cell that it may reach into.
struct Part<'c> {
    /// Number of the cell in the raster, and its column and row from the south-west.
    cell: usize,
    at: [usize; 2],
    grain: usize,
    ring: &'c [[i64; 2]],
}

/// Share of each cell that outlines cover, 0 to 1, row-major from the north-west.
pub(super) fn cover(catalogue: &Catalogue, frame: &Frame, grid: &RasterGrid) -> Vec<f64> {
    let cells_per_step = frame.outline_step_m() / grid.cell_m;
    let shift = grid.corner_shift();
    let place = |p: &[i64; 2]| -> [f64; 2] { std::array::from_fn(|i| p[i] as f64 * cells_per_step + shift[i]) };
    let mut parts = Vec::new();
    for (grain, of_grain) in catalogue.grains.iter().enumerate() {
        for ring in of_grain.grain.outline.iter().flatten() {
            let columns = span(ring.iter().map(|p| place(p)[0]), grid.columns);
            let rows = span(ring.iter().map(|p| place(p)[1]), grid.rows);
            for [column, row] in columns.flat_map(|column| rows.clone().map(move |row| [column, row])) {
                parts.push(Part { cell: grid.index(column, row), at: [column, row], grain, ring });
            }
        }
    }
    parts.sort_by_key(|part| part.cell);
    let of_cells: Vec<&[Part]> = parts.chunk_by(|a, b| a.cell == b.cell).collect();
    let shares: Vec<f64> = of_cells.par_iter().map(|parts| share(parts, &place)).collect();
    let mut cover = vec![0.0; grid.cells()];
    of_cells.iter().zip(shares).for_each(|(parts, share)| cover[parts[0].cell] = share);
    cover
}

/// Share of a cell that the rings which may reach into it cover.
fn share(parts: &[Part], place: &impl Fn(&[i64; 2]) -> [f64; 2]) -> f64 {
    let [column, row] = parts[0].at.map(|at| at as f64);
    let in_cell = |part: &Part| {
        let mut ring: Vec<[f64; 2]> = part.ring.iter().map(place).collect();
        for (axis, at, sign) in [(0, column, 1.0), (0, column + 1.0, -1.0), (1, row, 1.0), (1, row + 1.0, -1.0)] {
            ring = clip(&ring, axis, at, sign);
        }
        ring
    };
    // Rings of one grain do not overlap; holes run clockwise and take away.
    if parts.iter().all(|part| part.grain == parts[0].grain) {
        return parts.iter().map(|part| signed_area(&in_cell(part))).sum::<f64>().clamp(0.0, 1.0);
    }
    let mut overlay: Overlay<i32> = Overlay::new_custom(256, IntOverlayOptions::ogc(), Solver::default());
    for part in parts {
        let whole = |[x, y]: [f64; 2]| [x - column, y - row].map(|share| (share * PARTS).round() as i32);
        let ring: Vec<IntPoint<i32>> = in_cell(part).into_iter().map(whole).map(|[x, y]| IntPoint::new(x, y)).collect();
        overlay.add_contour(&ring, ShapeType::Subject);
    }
    // Around what lies in a hole of one grain and outside all others the rings wind 0 times.
    let rings = overlay.overlay(OverlayRule::Subject, FillRule::NonZero);
    let area = |ring: Vec<IntPoint<i32>>| {
        let ring: Vec<[f64; 2]> = ring.into_iter().map(|p| [f64::from(p.x) / PARTS, f64::from(p.y) / PARTS]).collect();
        signed_area(&ring)
    };
    rings.into_iter().flatten().map(area).sum::<f64>().clamp(0.0, 1.0)
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

    /// Rings in cells, of one cell at the origin.
    fn share_of(rings: &[(usize, Vec<[i64; 2]>)]) -> f64 {
        let part = |(grain, ring)| Part { cell: 0, at: [0, 0], grain, ring };
        let parts: Vec<Part> = rings.iter().map(|(grain, ring)| part((*grain, ring.as_slice()))).collect();
        share(&parts, &|p| p.map(|x| x as f64 / 100.0))
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
    fn what_reaches_beyond_the_cell_does_not_count() {
        assert!(
            (share_of(&[(0, square(50, 50, 200)), (1, square(-100, -100, 175))]) - 0.75 * 0.75 - 0.1875).abs() < 1e-6
        );
    }
}
