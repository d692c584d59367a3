//! The frame of a survey: from the numbers in a file to local metres, and from there to the map.
//!
//! Three frames exist, and every length or coordinate says which it is in:
//! * **input**: what the file holds, in the input's unit;
//! * **local**: metres from an origin near the survey (a whole number of input units). Everything is
//!   computed here. It does not know the `--offset`, so an offset can never change a grain;
//! * **map**: the CRS, in its own unit: `(origin + local) + offset`, east, north, up.

use crate::geometry::DVec3;

/// A coordinate reference system, as GDAL understands it.
#[derive(Debug, Clone, PartialEq)]
pub struct Crs {
    /// Well-known text.
    pub wkt: String,
    /// Name for people, such as `NZGD2000 / New Zealand Transverse Mercator 2000`.
    pub name: String,
    /// `EPSG:2193` where the system has a code.
    pub authority: Option<String>,
}

/// How input, local and map coordinates hang together.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Subtracted from every input coordinate first; whole input units.
    pub origin_input: [f64; 3],
    /// Metres in one unit of the input.
    pub metres_per_input_unit: f64,
    /// Added to reach the map, in map units.
    pub offset_map: [f64; 3],
    /// Metres in one unit of the map.
    pub metres_per_map_unit: f64,
    /// The map's system, if one was given.
    pub crs: Option<Crs>,
}

/// Map positions are written to this many parts of a map unit.
const POSITION_STEPS: f64 = 1e6;
/// Outlines lie on a grid of this many steps in a map unit: a power of two, so that a grid point stays
/// exact in `f64` out to 2^33 units, and a valid outline stays valid wherever the offset puts it.
const OUTLINE_STEPS: f64 = 1_048_576.0;

/// A shorter offset is none to a map.
const FAR_UNITS: f64 = 10_000.0;
/// Coordinates that differ from the offset by less than this share of it are of its kind.
const NEAR_SHARE: f64 = 0.2;

impl Frame {
    /// A frame of plain metres with its origin at zero.
    pub fn metres() -> Frame {
        Frame {
            origin_input: [0.0; 3],
            metres_per_input_unit: 1.0,
            offset_map: [0.0; 3],
            metres_per_map_unit: 1.0,
            crs: None,
        }
    }

    /// Local metres of an input coordinate.
    pub fn local(&self, input: [f64; 3]) -> DVec3 {
        let o = self.origin_input;
        DVec3::new(input[0] - o[0], input[1] - o[1], input[2] - o[2]) * self.metres_per_input_unit
    }

    /// Map coordinate of the local origin, map units.
    pub fn origin_map(&self) -> [f64; 3] {
        let scale = self.metres_per_input_unit / self.metres_per_map_unit;
        std::array::from_fn(|i| self.origin_input[i] * scale + self.offset_map[i])
    }

    /// Map position (east, north, up; map units) of a local point, on a grid of 1e-6 units.
    ///
    /// Both parts are put on the grid before they are added, so that two offsets give the same digits
    /// but for the offset itself.
    pub fn position(&self, local: DVec3) -> [f64; 3] {
        let origin = self.origin_map();
        std::array::from_fn(|i| {
            let part = (local[i] / self.metres_per_map_unit * POSITION_STEPS).round() as i64;
            let base = (origin[i] * POSITION_STEPS).round() as i64;
            (part + base) as f64 / POSITION_STEPS
        })
    }

    /// Whether a survey with these bounds, input units, is where the offset leads already, so that the offset would
    /// be added to map coordinates.
    pub(super) fn is_shifted_twice(&self, bounds: ([f64; 3], [f64; 3])) -> bool {
        let scale = self.metres_per_input_unit / self.metres_per_map_unit;
        (0..2).all(|i| {
            let middle = (bounds.0[i] + bounds.1[i]) / 2.0 * scale;
            let offset = self.offset_map[i];
            offset.abs() > FAR_UNITS && (middle - offset).abs() < NEAR_SHARE * offset.abs()
        })
    }

    /// Length of one step of the outline grid, metres.
    pub fn outline_step_m(&self) -> f64 {
        self.metres_per_map_unit / OUTLINE_STEPS
    }

    /// Map position (east, north; map units) of a point of the outline grid, counted in steps from the
    /// local origin.
    pub fn outline_position(&self, steps: [i64; 2]) -> [f64; 2] {
        let origin = self.origin_map();
        std::array::from_fn(|i| (steps[i] + (origin[i] * OUTLINE_STEPS).round() as i64) as f64 / OUTLINE_STEPS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_moves_positions_by_itself_and_nothing_else() {
        let near = Frame::metres();
        let far = Frame { offset_map: [1_480_000.0, 5_250_000.0, 700.0], ..Frame::metres() };
        let p = DVec3::new(3.271_592_653_589, 2.000_000_499, -0.1);
        let (a, b) = (near.position(p), far.position(p));
        assert_eq!(format!("{:.6}", a[0]), "3.271593");
        assert_eq!(format!("{:.6}", b[0]), "1480003.271593");
        assert_eq!(format!("{:.6}", b[1]), "5250002.000000");
        assert_eq!(format!("{:.6}", b[2]), "699.900000");
    }

    #[test]
    fn a_survey_in_millimetres_lands_in_a_map_of_feet() {
        let frame = Frame {
            origin_input: [1000.0, 0.0, 0.0],
            metres_per_input_unit: 1e-3,
            offset_map: [10.0, 20.0, 0.0],
            metres_per_map_unit: 0.3048,
            crs: None,
        };
        let local = frame.local([1304.8, 304.8, 0.0]);
        assert!((local - DVec3::new(0.3048, 0.3048, 0.0)).length() < 1e-12);
        let map = frame.position(local);
        assert!((map[0] - (10.0 + 1.3048 / 0.3048)).abs() < 2e-6, "{map:?}");
        assert!((map[1] - 21.0).abs() < 2e-6, "{map:?}");
    }
}
