//! Area, volume and sphericity of convex hulls.

use super::DVec3;
use super::extremes::{BLOCK, greatest, least};
use super::polytope::{NoPolytope, Polytope};
use robust::{Coord, orient2d};

/// Area and volume of a convex hull. Flat points have a hull of two sides and no volume; fewer than three
/// points, or points on a line, have neither.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hull {
    /// Surface area, m².
    pub area_m2: f64,
    /// Volume, m³.
    pub volume_m3: f64,
}

/// The convex hull of some points, metres in any frame.
///
/// The result depends on the order of the points in its last bits: give them by ascending vertex id.
///
/// None where a coordinate is not finite.
pub fn hull(points: &[DVec3]) -> Option<Hull> {
    let Some(&first) = points.first() else { return Some(Hull::default()) };
    let relative: Vec<DVec3> = points.iter().map(|&p| p - first).collect();
    match Polytope::around(&relative) {
        Ok(polytope) => Some(polytope.hull()),
        Err(NoPolytope::Flat) => Some(two_sided(&relative)),
        Err(NoPolytope::OutOfRange) => None,
    }
}

/// Whether the convex hull of some points is less spherical than a threshold, see [`sphericity`].
///
/// Decided by bounds where they suffice: the hull contains that of a few extreme points, and is contained
/// in the planes that touch it there.
pub fn flatter_than(points: &[DVec3], threshold: f64) -> bool {
    if points.is_empty() {
        return threshold > 0.0;
    }
    if points.len() >= FEW {
        // Most stones are far from flat, and most sheets far from round: a few directions tell.
        for pairs in PAIRS {
            let Some([inner, outer]) = bounds(points, pairs) else { break };
            // The slack is far above rounding and far below what matters.
            if sphericity(inner.volume_m3, outer.area_m2) > threshold * (1.0 + 1e-6) {
                return false;
            }
            if sphericity(outer.volume_m3, inner.area_m2) < threshold * (1.0 - 1e-6) {
                return true;
            }
        }
    }
    // A body whose hull cannot be made is kept: nothing says that it is flat.
    hull(points).is_some_and(|exact| sphericity(exact.volume_m3, exact.area_m2) < threshold)
}

/// Planes that touch the convex hull of some points, in 200 directions.
#[derive(Debug, Clone)]
pub struct Supports {
    origin: DVec3,
    planes: Vec<(DVec3, f64)>,
}

impl Supports {
    /// Around some points.
    pub fn of(points: &[DVec3]) -> Supports {
        let Some(&origin) = points.first() else { return Supports { origin: DVec3::ZERO, planes: Vec::new() } };
        Supports { origin, planes: supports(points, PAIRS_FOR_DEPTH).1 }
    }

    /// How far a point lies below the nearest of the planes, in the unit of the points; negative outside.
    pub fn depth(&self, point: DVec3) -> f64 {
        let point = point - self.origin;
        self.planes.iter().map(|(direction, level)| level - direction.dot(point)).fold(f64::INFINITY, f64::min)
    }
}

/// How far points lie, in the mean, below the [`Supports`] of others, in the unit of both. Of many points every so-many-th
/// is asked.
pub fn mean_depth(hull_of: &[DVec3], points: &[DVec3]) -> f64 {
    if hull_of.is_empty() || points.is_empty() {
        return 0.0;
    }
    let supports = Supports::of(hull_of);
    let step = (points.len() / MOST_DEPTHS).max(1);
    let asked = points.len().div_ceil(step);
    points.iter().step_by(step).map(|&p| supports.depth(p)).sum::<f64>() / asked as f64
}

/// About 0.25 rad apart: of a ball, the planes lie 0.4 % of its radius off.
const PAIRS_FOR_DEPTH: usize = 100;
/// Points whose depth is asked; at most twice as many.
const MOST_DEPTHS: usize = 400;

/// Pairs of opposite directions in which the hull is bounded, at first and where that leaves it open: about 0.6 and
/// 0.4 rad apart.
const PAIRS: [usize; 2] = [14, 32];
/// Below this many points a hull is cheaper than its bounds.
const FEW: usize = 300;

/// A hull within the points' own, and one around it, both relative to the first point; none where the points are
/// flat or nearly so.
fn bounds(points: &[DVec3], pairs: usize) -> Option<[Hull; 2]> {
    let (extremes, planes) = supports(points, pairs);
    let inner = Polytope::around(&extremes).ok()?;
    // Dual to the planes, seen from a point well inside, are points whose hull has a facet for each corner
    // of the body that the planes enclose.
    let centre = extremes.iter().sum::<DVec3>() / extremes.len() as f64;
    let heights: Vec<f64> = planes.iter().map(|&(direction, level)| level - direction.dot(centre)).collect();
    let widest = heights.iter().fold(0.0f64, |most, &h| h.max(most));
    if heights.iter().any(|&h| h.is_nan() || h < 1e-3 * widest) {
        return None;
    }
    let dual: Vec<DVec3> = planes.iter().zip(&heights).map(|(plane, h)| plane.0 * (widest / h)).collect();
    let mut corners = Vec::new();
    for facet in Polytope::around(&dual).ok()?.facets {
        let [(p, i), (q, j), (r, k)] = facet.map(|f| (planes[f as usize].0, heights[f as usize]));
        let determinant = p.dot(q.cross(r));
        // Three planes that hardly cross: rounding would move their corner.
        if determinant.abs() < 1e-6 {
            return None;
        }
        corners.push((q.cross(r) * i + r.cross(p) * j + p.cross(q) * k) / determinant);
    }
    let outer = Polytope::around(&corners).ok()?;
    Some([inner.hull(), outer.hull()])
}

/// The extreme points in the directions, and the planes there: outward direction and level. Relative to the first point.
fn supports(points: &[DVec3], pairs: usize) -> (Vec<DVec3>, Vec<(DVec3, f64)>) {
    let directions: Vec<DVec3> = (0..pairs).map(|pair| direction(pair, pairs)).collect();
    // For each pair, how far the points reach both ways, and which are there.
    let mut reach = vec![([f64::INFINITY, f64::NEG_INFINITY], [DVec3::ZERO; 2]); pairs];
    // In blocks, so that most of the work needs no branch and no memory.
    for block in points.chunks(BLOCK) {
        let across = Across::of(block, points[0]);
        for (direction, ([low, high], [lowest, highest])) in directions.iter().zip(&mut reach) {
            let [lower, upper] = across.range(*direction);
            let at = |level: f64| block.iter().map(|&p| p - points[0]).find(|p| direction.dot(*p) == level);
            if lower < *low {
                *low = lower;
                *lowest = at(lower).unwrap_or(*lowest);
            }
            if upper > *high {
                *high = upper;
                *highest = at(upper).unwrap_or(*highest);
            }
        }
    }
    let extremes = reach.iter().flat_map(|(_, points)| *points).collect();
    let planes = directions.iter().zip(&reach).flat_map(|(&d, ([low, high], _))| [(-d, -low), (d, *high)]).collect();
    (extremes, planes)
}

/// The coordinates of a block of points, each for itself. The last block is filled up with its first point.
struct Across([[f64; BLOCK]; 3]);

impl Across {
    fn of(block: &[DVec3], origin: DVec3) -> Across {
        let [mut x, mut y, mut z] = (block[0] - origin).to_array().map(|first| [first; BLOCK]);
        for (((p, x), y), z) in block.iter().zip(&mut x).zip(&mut y).zip(&mut z) {
            [*x, *y, *z] = (*p - origin).to_array();
        }
        Across([x, y, z])
    }

    /// The least and the greatest level in a direction.
    fn range(&self, direction: DVec3) -> [f64; 2] {
        let [x, y, z] = &self.0;
        let mut levels = [0.0; BLOCK];
        for i in 0..BLOCK {
            levels[i] = direction.x * x[i] + direction.y * y[i] + direction.z * z[i];
        }
        [least(&levels), greatest(&levels)]
    }
}

/// Directions evenly spread over the upper half of the sphere: a spiral of golden angles.
fn direction(i: usize, pairs: usize) -> DVec3 {
    let z = 1.0 - (i as f64 + 0.5) / pairs as f64;
    let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

impl Polytope<'_> {
    fn hull(&self) -> Hull {
        let mut hull = Hull::default();
        for facet in &self.facets {
            let [a, b, c] = facet.map(|i| self.points[i as usize]);
            let normal = (b - a).cross(c - a);
            hull.area_m2 += 0.5 * normal.length();
            hull.volume_m3 += a.dot(normal) / 6.0;
        }
        hull.volume_m3 = hull.volume_m3.abs();
        hull
    }
}

/// The hull of points in one plane: both sides of the polygon around them.
fn two_sided(points: &[DVec3]) -> Hull {
    let first = points[0];
    let far = points.iter().fold(first, |far, &p| if p.length_squared() > far.length_squared() { p } else { far });
    let normal = points.iter().fold(DVec3::ZERO, |most, &p| {
        let normal = (far - first).cross(p - first);
        if normal.length_squared() > most.length_squared() { normal } else { most }
    });
    // In plan along the axis that the plane faces most, every point keeps its place in the polygon.
    let size = normal.abs();
    let flat = |p: DVec3| match size.max_element() {
        most if most == size.z => Coord { x: p.x, y: p.y },
        most if most == size.y => Coord { x: p.z, y: p.x },
        _ => Coord { x: p.y, y: p.z },
    };
    let mut sorted: Vec<(Coord<f64>, DVec3)> = points.iter().map(|&p| (flat(p), p)).collect();
    sorted.sort_by(|(p, _), (q, _)| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)));
    let half = |points: &mut dyn Iterator<Item = (Coord<f64>, DVec3)>| {
        let mut chain: Vec<(Coord<f64>, DVec3)> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && orient2d(a.0, b.0, p.0) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain
    };
    let mut polygon = half(&mut sorted.iter().copied());
    polygon.extend(half(&mut sorted.iter().rev().copied()));
    let twice: DVec3 = polygon.windows(2).map(|w| (w[0].1 - first).cross(w[1].1 - first)).sum();
    Hull { area_m2: twice.length(), volume_m3: 0.0 }
}

/// Wadell's sphericity of a body: surface of the sphere of equal volume over its own surface,
/// pi^(1/3) (6 V)^(2/3) / A; 1 for a sphere, 0 for a sheet (Wadell 1932, J. Geol. 40, 443-451).
pub fn sphericity(volume_m3: f64, area_m2: f64) -> f64 {
    if area_m2 > 0.0 { std::f64::consts::PI.cbrt() * (6.0 * volume_m3).powf(2.0 / 3.0) / area_m2 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_its_own_area_and_volume() {
        let points: Vec<DVec3> = (0..8)
            .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1) * 2.0, f64::from(i >> 2) * 3.0))
            .collect();
        let hull = hull(&points).expect("hull");
        assert!((hull.area_m2 - 22.0).abs() < 1e-12 && (hull.volume_m3 - 6.0).abs() < 1e-12, "{hull:?}");
    }

    #[test]
    fn a_flat_sheet_has_two_sides_and_no_sphericity() {
        let points: Vec<DVec3> = (0..100).map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.5)).collect();
        let hull = hull(&points).expect("hull");
        assert!((hull.area_m2 - 162.0).abs() < 1e-9 && hull.volume_m3 == 0.0, "{hull:?}");
        assert_eq!(sphericity(hull.volume_m3, hull.area_m2), 0.0);
    }

    /// A dome of many points with a rough surface, as tall as `height` times its radius.
    fn dome(height: f64) -> Vec<DVec3> {
        (0..4000)
            .map(|i| {
                let (u, v) = (f64::from(i) * 2.4, (f64::from(i) / 4000.0).sqrt());
                let rough = 1.0 + 0.01 * (f64::from(i) * 12.9898).sin();
                DVec3::new(v * u.cos(), v * u.sin(), height * (1.0 - v * v).sqrt() * rough)
            })
            .collect()
    }

    #[test]
    fn bounds_decide_as_the_hull_does_and_hold_it_between_them() {
        for height in [0.05, 0.1, 0.2, 0.3, 0.5, 1.0] {
            let points = dome(height);
            let exact = hull(&points).expect("hull");
            for pairs in PAIRS {
                let [inner, outer] = bounds(&points, pairs).expect("solid");
                assert!(inner.area_m2 <= exact.area_m2 && exact.area_m2 <= outer.area_m2);
                assert!(inner.volume_m3 <= exact.volume_m3 && exact.volume_m3 <= outer.volume_m3);
                let wide = if pairs < 32 { 3.0 } else { 2.0 };
                assert!(height < 0.5 || outer.volume_m3 < wide * inner.volume_m3, "{inner:?} {outer:?}");
            }
            let s = sphericity(exact.volume_m3, exact.area_m2);
            for threshold in [0.01, 0.3, s - 1e-6, s + 1e-6, 0.5, 0.9] {
                assert_eq!(flatter_than(&points, threshold), s < threshold, "height {height}, threshold {threshold}");
            }
        }
    }

    #[test]
    fn a_level_disc_in_any_of_the_three_planes_has_two_sides() {
        for turn in 0..3 {
            let points: Vec<DVec3> = (0..400)
                .map(|i| {
                    let (r, u) = ((f64::from(i / 20) + 1.0) / 20.0, f64::from(i % 20) * std::f64::consts::PI / 10.0);
                    let p = [r * u.cos(), r * u.sin(), 0.25];
                    DVec3::new(p[turn], p[(turn + 1) % 3], p[(turn + 2) % 3])
                })
                .collect();
            let hull = hull(&points).expect("hull");
            let polygon = 20.0 * (std::f64::consts::PI / 10.0).sin();
            assert!((hull.area_m2 - polygon).abs() < 1e-12 && hull.volume_m3 == 0.0, "{hull:?} {polygon}");
            assert!(flatter_than(&points, 0.01));
        }
    }

    #[test]
    fn a_point_that_is_not_finite_has_no_hull() {
        let mut points = dome(0.5);
        points[7].y = f64::NAN;
        assert_eq!(hull(&points), None);
    }

    #[test]
    fn points_on_a_line_have_no_hull() {
        let points: Vec<DVec3> = (0..5).map(|i| DVec3::splat(f64::from(i))).collect();
        assert_eq!(hull(&points).expect("hull").volume_m3, 0.0);
        assert_eq!(hull(&[]), Some(Hull::default()));
    }
}
