//! Points of a LAS file as records of a scratch file: coordinates, colours, class.

use super::las_header::LasFile;
use super::ply_header::{Element, Kind, Property};
use super::scalar::Scalar;
use super::vertices::SKIPPED;
use las::{PointData, PointDataBuilder};

/// Classes of points that are no surface: low noise and high noise.
const NOISE: [u8; 2] = [7, 18];

/// How the colours of a file are kept. The standard wants 16 bits, many files have 8.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Colors {
    /// There are none, or all are 0.
    None,
    /// None is above 255.
    LowBytes,
    /// All are 256 or all are 257 times a byte.
    HighBytes,
    /// Anything else.
    Words,
}

impl Colors {
    fn bytes(self) -> usize {
        match self {
            Colors::None => 0,
            Colors::LowBytes | Colors::HighBytes => 3,
            Colors::Words => 6,
        }
    }
}

/// The element that the records of a file make.
pub(super) fn element(points: u64, colors: Colors) -> Element {
    let number = |name: &&str, scalar| Property { name: (*name).to_owned(), kind: Kind::Number(scalar) };
    let mut properties: Vec<Property> = ["x", "y", "z"].iter().map(|name| number(name, Scalar::F64)).collect();
    if colors != Colors::None {
        let scalar = if colors == Colors::Words { Scalar::U16 } else { Scalar::U8 };
        properties.extend(["red", "green", "blue"].iter().map(|name| number(name, scalar)));
    }
    properties.extend(["classification", SKIPPED].iter().map(|name| number(name, Scalar::U8)));
    Element { name: "vertex".to_owned(), count: points, properties }
}

/// Bytes of such a record.
pub(super) fn record_bytes(colors: Colors) -> usize {
    3 * Scalar::F64.size() + colors.bytes() + 2
}

/// What was seen among points. Two of them add up in any order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tally {
    pub(super) points: u64,
    pub(super) noise: u64,
    pub(super) withheld: u64,
    /// Lowest and highest coordinates, as whole numbers.
    pub(super) lowest: [i32; 3],
    pub(super) highest: [i32; 3],
    /// All bits of all colours.
    color_bits: u16,
    not_times_256: bool,
    not_times_257: bool,
}

impl Default for Tally {
    fn default() -> Tally {
        Tally {
            points: 0,
            noise: 0,
            withheld: 0,
            lowest: [i32::MAX; 3],
            highest: [i32::MIN; 3],
            color_bits: 0,
            not_times_256: false,
            not_times_257: false,
        }
    }
}

impl Tally {
    pub(super) fn add(&mut self, other: &Tally) {
        self.points += other.points;
        self.noise += other.noise;
        self.withheld += other.withheld;
        for axis in 0..3 {
            self.lowest[axis] = self.lowest[axis].min(other.lowest[axis]);
            self.highest[axis] = self.highest[axis].max(other.highest[axis]);
        }
        self.color_bits |= other.color_bits;
        self.not_times_256 |= other.not_times_256;
        self.not_times_257 |= other.not_times_257;
    }

    /// The narrowest way to keep the colours that were seen.
    pub(super) fn colors(&self) -> Colors {
        match self.color_bits {
            0 => Colors::None,
            1..=0xff => Colors::LowBytes,
            _ if self.not_times_256 && self.not_times_257 => Colors::Words,
            _ => Colors::HighBytes,
        }
    }

    #[inline]
    fn see_color(&mut self, value: u16) {
        let [low, high] = value.to_le_bytes();
        self.color_bits |= value;
        self.not_times_256 |= low != 0;
        self.not_times_257 |= low != high;
    }
}

/// Turns records of LAS into records of the scratch file.
pub(super) struct Converter {
    points: PointData,
    colors: Colors,
    withheld: (usize, u8),
    /// What was seen so far.
    pub(super) tally: Tally,
}

impl Converter {
    pub(super) fn new(file: &LasFile<'_>, colors: Colors) -> Converter {
        let points = PointDataBuilder::new().with_format(file.format).with_transforms(file.transforms()).build();
        // The byte with the flag that a point is to be taken for deleted, and the flag.
        let withheld = if file.format.is_extended { (15, 0x04) } else { (15, 0x80) };
        Converter { points, colors, withheld, tally: Tally::default() }
    }

    /// Puts the records of `slab` in place of what `to` holds.
    pub(super) fn convert(&mut self, slab: &[u8], to: &mut Vec<u8>) {
        let record = self.points.record_len();
        self.points.resize_for(slab.len() / record).copy_from_slice(slab);
        let (points, tally) = (&self.points, &mut self.tally);
        tally.points += points.len() as u64;
        let spans = [span(points.x_raw()), span(points.y_raw()), span(points.z_raw())];
        for (axis, (lowest, highest)) in spans.into_iter().enumerate() {
            tally.lowest[axis] = tally.lowest[axis].min(lowest);
            tally.highest[axis] = tally.highest[axis].max(highest);
        }
        to.clear();
        let flags = slab.chunks_exact(record).map(|r| r[self.withheld.0] & self.withheld.1 != 0);
        let places = points.x().zip(points.y()).zip(points.z());
        let classes = points.classification().zip(flags);
        let mut colors = points.rgb();
        for (((x, y), z), (class, withheld)) in places.zip(classes) {
            to.extend(x.to_le_bytes());
            to.extend(y.to_le_bytes());
            to.extend(z.to_le_bytes());
            if let Some((red, green, blue)) = colors.as_mut().and_then(Iterator::next) {
                for value in [red, green, blue] {
                    tally.see_color(value);
                    let [low, high] = value.to_le_bytes();
                    match self.colors {
                        Colors::None => {}
                        Colors::LowBytes => to.push(low),
                        Colors::HighBytes => to.push(high),
                        Colors::Words => to.extend([low, high]),
                    }
                }
            }
            let noise = NOISE.contains(&class);
            tally.noise += u64::from(noise);
            tally.withheld += u64::from(withheld);
            to.extend([class, u8::from(noise || withheld)]);
        }
    }
}

/// Lowest and highest of some numbers.
fn span(numbers: impl Iterator<Item = i32>) -> (i32, i32) {
    numbers.fold((i32::MAX, i32::MIN), |(lowest, highest), n| (lowest.min(n), highest.max(n)))
}
