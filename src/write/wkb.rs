//! Geometries as little-endian well-known binary, so that coordinates reach the file bit for bit.

use crate::geometry::PlanBox;
use crate::measure::Polygon;
use crate::open::Frame;

const POLYGON: u32 = 3;
const MULTI_POLYGON: u32 = 6;
const POINT_Z: u32 = 1001;

fn head(kind: u32) -> Vec<u8> {
    let mut bytes = vec![1];
    bytes.extend(kind.to_le_bytes());
    bytes
}

fn count(bytes: &mut Vec<u8>, n: usize) {
    // OGR itself counts with 31 bits; an outline has thousands of points.
    bytes.extend((n as u32).to_le_bytes());
}

fn coordinates(bytes: &mut Vec<u8>, values: &[f64]) {
    values.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
}

/// A point with height.
pub(crate) fn point_z(position: [f64; 3]) -> Vec<u8> {
    let mut bytes = head(POINT_Z);
    coordinates(&mut bytes, &position);
    bytes
}

/// The outline of a grain on the map; none for an outline without area.
pub(crate) fn multi_polygon(frame: &Frame, outline: &[Polygon]) -> Option<Vec<u8>> {
    let solid: Vec<&Polygon> = outline.iter().filter(|p| p.first().is_some_and(|ring| ring.len() >= 3)).collect();
    if solid.is_empty() {
        return None;
    }
    let mut bytes = head(MULTI_POLYGON);
    count(&mut bytes, solid.len());
    for polygon in solid {
        bytes.extend(head(POLYGON));
        count(&mut bytes, polygon.len());
        for ring in polygon {
            count(&mut bytes, ring.len() + 1);
            for &point in ring.iter().chain(ring.first()) {
                coordinates(&mut bytes, &frame.outline_position(point));
            }
        }
    }
    Some(bytes)
}

/// A rectangle in plan, counter-clockwise; none where a side is not finite.
pub(crate) fn rectangle(frame: &Frame, plan: &PlanBox) -> Option<Vec<u8>> {
    let ([west, south], [east, north]) = (plan.min, plan.max);
    if ![west, south, east, north].iter().all(|v| v.is_finite()) {
        return None;
    }
    let mut bytes = head(POLYGON);
    count(&mut bytes, 1);
    count(&mut bytes, 5);
    for (x, y) in [(west, south), (east, south), (east, north), (west, north), (west, south)] {
        coordinates(&mut bytes, &frame.position(crate::geometry::DVec3::new(x, y, 0.0))[..2]);
    }
    Some(bytes)
}
