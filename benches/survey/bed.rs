//! The bed: gravel on sand as a height field over a slightly jittered grid, the same for every seed, endless
//! to the east and north: a larger bed holds the smaller ones. Every vertex and every triangle is a function
//! of its number, so that a bed can be written in any order with no more memory than its stones take.

use crate::random::{at, mix, part, signed};
use crate::stones::Stones;

/// Mean distance between neighbouring vertices in plan, metres: that of the golden bed.
const STEP_M: f64 = 0.29e-3;
/// Vertices lie off the grid by up to this share of a step.
const JITTER: f64 = 0.22;

/// Purposes of random numbers; those up to 4 are the stones'.
const VERTEX: u64 = 5;
const DIAGONAL: u64 = 6;
const RIPPLE: u64 = 7;
const LUMP: u64 = 8;

/// A piece of the bed.
pub(crate) struct Bed {
    seed: u64,
    /// Vertices to the east and to the north.
    sides: [u64; 2],
    stones: Stones,
}

/// What is at one vertex.
pub(crate) struct Vertex {
    /// East, north, up; metres.
    pub(crate) position_m: [f32; 3],
    /// Red, green, blue.
    pub(crate) color: [u8; 3],
    /// Number of the stone that shows there; none on sand.
    pub(crate) stone: Option<usize>,
}

impl Bed {
    /// A nearly square bed of at least so many triangles, and hardly more.
    pub(crate) fn new(seed: u64, triangles: u64) -> Bed {
        let quads = triangles.div_ceil(2).max(1);
        let east = ((quads as f64).sqrt().round() as u64).max(1);
        let sides = [east + 1, quads.div_ceil(east) + 1];
        Bed { seed, sides, stones: Stones::new(seed, sides.map(|n| n as f64 * STEP_M)) }
    }

    /// Vertices.
    pub(crate) fn vertices(&self) -> u64 {
        self.sides[0] * self.sides[1]
    }

    /// Triangles: two for each quad of the grid.
    pub(crate) fn triangles(&self) -> u64 {
        2 * (self.sides[0] - 1) * (self.sides[1] - 1)
    }

    /// Every stone, visible or not.
    pub(crate) fn stones(&self) -> &Stones {
        &self.stones
    }

    /// A vertex by its number, which runs to the north first.
    pub(crate) fn vertex(&self, number: u64) -> Vertex {
        let (i, j) = ((number / self.sides[1]) as i64, (number % self.sides[1]) as i64);
        let hash = at(self.seed, VERTEX, i, j);
        let x = (i as f64 + JITTER * signed(hash, 0)) * STEP_M;
        let y = (j as f64 + JITTER * signed(hash, 1)) * STEP_M;
        let ripple = self.noise(RIPPLE, x / 1.2e-3, y / 1.2e-3);
        let sand_m = 0.9e-3 + 0.7e-3 * self.noise(LUMP, x / 18e-3, y / 18e-3) + 0.13e-3 * ripple;
        let (stone, height_m) = self.stones.surface(x, y, sand_m);
        let (paint, roughness_m) = match stone {
            Some(number) => (self.stones.all()[number].color, 12e-6),
            None => ([190, 174, 129], 0.0),
        };
        let z = height_m + roughness_m * ripple + 4e-6 * signed(hash, 2);
        let grain = mix(hash);
        let color = [0, 1, 2].map(|c| (f64::from(paint[c as usize]) + 19.0 * signed(grain, c)) as u8);
        Vertex { position_m: [x as f32, y as f32, z as f32], color, stone }
    }

    /// The corners of a triangle by its number, counter-clockwise from above. Each quad is cut along either
    /// diagonal, at random.
    pub(crate) fn triangle(&self, number: u64) -> [u64; 3] {
        let quad = number / 2;
        let (i, j) = (quad / (self.sides[1] - 1), quad % (self.sides[1] - 1));
        let south_west = i * self.sides[1] + j;
        let (south_east, north_west) = (south_west + self.sides[1], south_west + 1);
        let north_east = south_east + 1;
        match (at(self.seed, DIAGONAL, i as i64, j as i64) & 1, number % 2) {
            (0, 0) => [south_west, south_east, north_east],
            (0, _) => [south_west, north_east, north_west],
            (_, 0) => [south_west, south_east, north_west],
            (_, _) => [south_east, north_east, north_west],
        }
    }

    /// Smooth noise in [-1, 1): random values on a lattice of step 1, blended.
    fn noise(&self, purpose: u64, x: f64, y: f64) -> f64 {
        let (i, j) = (x.floor(), y.floor());
        let [u, v] = [x - i, y - j].map(|t| t * t * (3.0 - 2.0 * t));
        let value = |di: i64, dj: i64| 2.0 * part(at(self.seed, purpose, i as i64 + di, j as i64 + dj), 0) - 1.0;
        let along = |dj: i64| value(0, dj) * (1.0 - u) + value(1, dj) * u;
        along(0) * (1.0 - v) + along(1) * v
    }
}
