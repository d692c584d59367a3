//! Lithology colours of stones and the beige of sand.

use super::random::{Random, noise};
use super::settings::SAND;
use crate::geometry::DVec3;

/// Mean colour and strength of the speckle.
struct Rock {
    color: [f64; 3],
    speckle: f64,
}

/// Greywacke, limestone, sandstone, quartzite, basalt, greenschist, granite; greywacke is common.
const ROCKS: [Rock; 8] = [
    Rock { color: [118.0, 120.0, 116.0], speckle: 10.0 },
    Rock { color: [98.0, 104.0, 108.0], speckle: 9.0 },
    Rock { color: [166.0, 162.0, 150.0], speckle: 8.0 },
    Rock { color: [150.0, 104.0, 82.0], speckle: 12.0 },
    Rock { color: [206.0, 198.0, 184.0], speckle: 12.0 },
    Rock { color: [66.0, 66.0, 70.0], speckle: 8.0 },
    Rock { color: [104.0, 120.0, 102.0], speckle: 10.0 },
    Rock { color: [168.0, 148.0, 138.0], speckle: 34.0 },
];
const BEIGE: Rock = Rock { color: [186.0, 166.0, 132.0], speckle: 14.0 };

/// Colour of a point on a stone, or on sand.
pub(super) fn color(seed: u64, stone: u32, at: DVec3) -> [u8; 3] {
    let mut random = Random::new(seed, 0x1_0000_0000 + u64::from(stone));
    let (rock, tint) = if stone == SAND {
        (&BEIGE, 0.0)
    } else {
        (&ROCKS[(random.bits() % ROCKS.len() as u64) as usize], random.range(-16.0, 16.0))
    };
    // Mineral grains of about a millimetre, and blotches of weathering.
    let speckle = rock.speckle * (1.6 * noise(seed ^ 21, at / 0.0011) + 0.8 * noise(seed ^ 22, at / 0.006));
    rock.color.map(|c| (c + tint + speckle).clamp(0.0, 255.0) as u8)
}
