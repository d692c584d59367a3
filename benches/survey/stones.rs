//! Stones of an endless bed: one in every cell of a coarse lattice, so that each place knows its stones from
//! the seed alone.
//!
//! Seen from above a half-buried stone is the cap of an ellipsoid, and below it a flank as steep as a camera
//! still sees. Where stones lie over each other the higher one shows, and the crease between them is as round
//! as a survey makes it. Density, sizes and slopes are those of the golden bed of 0.3 million triangles.

use crate::random::{at, mix, part, signed};

/// Side of a cell, metres: 1,100 stones a square metre.
const CELL_M: f64 = 30e-3;
/// Cells around its own that a stone can reach into.
const REACH_CELLS: i64 = 2;
/// Slope of the flanks.
const FLANK: f64 = 3.0;
/// Height of the cap's ellipsoid over its minor semi-axis in plan.
const DOME: f64 = 0.62;
/// Where the cap is as steep as the flank, which begins there, in shares of the semi-axes in plan:
/// FLANK / sqrt(FLANK² + DOME²).
const CAP: f64 = 0.979_304;
/// Surfaces whose heights differ by less than this blend into each other, metres.
const CREASE_M: f64 = 2.5e-3;

/// One stone.
pub(crate) struct Stone {
    /// Centre in plan, metres.
    pub(crate) center_m: [f64; 2],
    /// Semi-axes of the cap in plan, metres, the longer first.
    pub(crate) semi_m: [f64; 2],
    /// Height of the top, metres.
    pub(crate) top_m: f64,
    /// Colour.
    pub(crate) color: [u8; 3],
    /// Direction of the longer axis.
    axis: [f64; 2],
    /// Inclination: rise per metre, east and north.
    tilt: [f64; 2],
    /// Nothing of it shows farther than this from the centre.
    reach_m: f64,
}

impl Stone {
    fn of_cell(seed: u64, i: i64, j: i64) -> Stone {
        let [place, size, shape, paint] = [1, 2, 3, 4].map(|purpose| at(seed, purpose, i, j));
        let center_m = [(i, 0), (j, 1)].map(|(cell, which)| (cell as f64 + 0.5 + 0.36 * signed(place, which)) * CELL_M);
        // The sum of two uniforms: most are of middle size, some small, some large.
        let b = 4.0e-3 + 6.8e-3 * (part(size, 0) + part(size, 1));
        let a = b * (1.0 + 0.4 * part(size, 2));
        let top_m = b * (2.0 + 0.6 * part(size, 3));
        let tilt = [0, 1].map(|which| 0.22 * signed(shape, which));
        // No sine: its last bit differs between machines. The drop of the cap, then the flank down to below the sand.
        let low = 2e-3 + top_m - DOME * b * (1.0 - (1.0 - CAP * CAP).sqrt());
        let reach_m = (a * CAP + low / FLANK * a / b) * 1.35;
        Stone {
            center_m,
            semi_m: [a, b],
            top_m,
            color: [0, 1, 2].map(|channel| (70.0 + 130.0 * part(paint, channel)) as u8),
            axis: direction(mix(shape)),
            tilt,
            reach_m: reach_m.min(CELL_M * REACH_CELLS as f64),
        }
    }

    /// Height of the stone's surface there, metres; far below the sand where the stone is not.
    fn height_m(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (x - self.center_m[0], y - self.center_m[1]);
        let [c, s] = self.axis;
        let [a, b] = self.semi_m;
        let (u, v) = ((dx * c + dy * s) / a, (dy * c - dx * s) / b);
        let r2 = u * u + v * v;
        let dome = |r2: f64| DOME * b * (1.0 - (1.0 - r2).sqrt());
        let drop = if r2 <= CAP * CAP { dome(r2) } else { dome(CAP * CAP) + FLANK * b * (r2.sqrt() - CAP) };
        self.top_m - drop + self.tilt[0] * dx + self.tilt[1] * dy
    }
}

/// A unit vector, uniform over the circle: the first of a sequence of points that lies within it.
fn direction(mut hash: u64) -> [f64; 2] {
    loop {
        let (x, y) = (signed(hash, 0), signed(hash, 1));
        let length = (x * x + y * y).sqrt();
        if (0.1..=1.0).contains(&length) {
            return [x / length, y / length];
        }
        hash = mix(hash);
    }
}

/// The stones of a piece of the bed that begins at the origin: about a hundred bytes for every 20,000
/// triangles, kept so that no stone is made twice.
pub(crate) struct Stones {
    all: Vec<Stone>,
    cells: [i64; 2],
}

impl Stones {
    /// Those that show within the given extent, metres.
    pub(crate) fn new(seed: u64, extent_m: [f64; 2]) -> Stones {
        // One more cell than reached: vertices are jittered across the border.
        let cells = extent_m.map(|side| (side / CELL_M) as i64 + 2 + 2 * (REACH_CELLS + 1));
        let first = -(REACH_CELLS + 1);
        let all = (0..cells[0] * cells[1])
            .map(|cell| Stone::of_cell(seed, first + cell / cells[1], first + cell % cells[1]))
            .collect();
        Stones { all, cells }
    }

    /// All of them.
    pub(crate) fn all(&self) -> &[Stone] {
        &self.all
    }

    /// The highest stone there, if one rises over `ground_m`, and the height of the surface, metres.
    pub(crate) fn surface(&self, x: f64, y: f64, ground_m: f64) -> (Option<usize>, f64) {
        let [i, j] = [x, y].map(|p| (p / CELL_M).floor() as i64 + REACH_CELLS + 1);
        let (mut found, mut highest, mut second) = (None, ground_m, f64::NEG_INFINITY);
        for row in i - REACH_CELLS..=i + REACH_CELLS {
            let from = (row * self.cells[1] + j - REACH_CELLS) as usize;
            for number in from..=from + 2 * REACH_CELLS as usize {
                let stone = &self.all[number];
                if (x - stone.center_m[0]).abs() < stone.reach_m && (y - stone.center_m[1]).abs() < stone.reach_m {
                    let there = stone.height_m(x, y);
                    if there > highest {
                        (found, highest, second) = (Some(number), there, highest);
                    } else if there > second {
                        second = there;
                    }
                }
            }
        }
        // The polynomial smooth maximum: a parabola in place of the crease.
        let near = (1.0 - (highest - second) / CREASE_M).max(0.0);
        (found, highest + near * near * CREASE_M / 4.0)
    }
}
