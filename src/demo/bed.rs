//! The bed as one implicit body: the union of the stones and the sand.

use super::random::noise;
use super::settings::{SAND, SceneSettings};
use super::stone::Shape;
use crate::geometry::DVec3;

/// Side of the cells in which stones are looked up, metres.
const LOOKUP_M: f64 = 0.01;

/// Sand: gentle ripples, undulation and roughness.
#[derive(Debug, Clone)]
pub(super) struct Sand {
    seed: u64,
}

impl Sand {
    pub(super) fn new(seed: u64) -> Sand {
        Sand { seed }
    }

    /// Height at a place in plan, metres.
    pub(super) fn height_m(&self, x: f64, y: f64) -> f64 {
        let octave = |number: u64, wavelength: f64| {
            noise(self.seed ^ number, DVec3::new(x / wavelength, y / wavelength, number as f64 + 0.5))
        };
        // Ripples run across a flow towards x, and their crests wander.
        let phase = (x + 0.3 * y + 0.02 * octave(11, 0.12)) / 0.085;
        let ripple = 0.0016 * (std::f64::consts::TAU * phase).sin();
        ripple + 0.005 * octave(12, 0.2) + 0.0009 * octave(13, 0.018) + 0.0004 * octave(14, 0.0055)
    }
}

/// Stones and sand.
pub(super) struct Bed {
    pub(super) shapes: Vec<Shape>,
    pub(super) sand: Sand,
    /// Stones that may reach into each plan cell, row by row.
    lookup: Vec<Vec<u32>>,
    columns: usize,
}

impl Bed {
    pub(super) fn new(settings: &SceneSettings, sand: Sand, shapes: Vec<Shape>) -> Bed {
        let columns = (settings.side_m / LOOKUP_M).ceil() as usize + 1;
        let mut lookup = vec![Vec::new(); columns * columns];
        for (id, shape) in shapes.iter().enumerate() {
            let reach = shape.reach();
            let low = shape.centre - reach;
            let high = shape.centre + reach;
            for j in cell(low.y, columns)..=cell(high.y, columns) {
                for i in cell(low.x, columns)..=cell(high.x, columns) {
                    lookup[j * columns + i].push(id as u32);
                }
            }
        }
        Bed { shapes, sand, lookup, columns }
    }

    /// The stone whose surface is nearest to a point of the bed's surface, or [`SAND`].
    pub(super) fn owner(&self, point: DVec3) -> u32 {
        let mut best = (point.z - self.sand.height_m(point.x, point.y), SAND);
        for &id in &self.lookup[cell(point.y, self.columns) * self.columns + cell(point.x, self.columns)] {
            let distance = self.shapes[id as usize].distance_m(point, 0.002);
            if distance < best.0 {
                best = (distance, id);
            }
        }
        best.1
    }
}

fn cell(coordinate: f64, columns: usize) -> usize {
    ((coordinate / LOOKUP_M).max(0.0) as usize).min(columns - 1)
}
