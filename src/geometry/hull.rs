//! Convex hulls, by `parry3d-f64`.

use super::DVec3;
use parry3d_f64::transformation::{ConvexHullError, try_convex_hull};

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
/// Points well inside the hull of a few extreme ones cannot be corners and are left out first: the library
/// takes time with the product of points and corners. The result depends on the order of the points in its
/// last bits: give them by ascending vertex id.
///
/// None where the library gives up for rounding, which is not known to happen to grains.
pub fn hull(points: &[DVec3]) -> Option<Hull> {
    let Some(&first) = points.first() else { return Some(Hull::default()) };
    let relative: Vec<DVec3> = points.iter().map(|&p| p - first).collect();
    let outside = match Core::of(&relative) {
        Some(core) => {
            let margin = -1e-9 * core.radius;
            relative.iter().zip(&core.heights).filter(|(_, h)| **h > margin).map(|(&p, _)| p).collect()
        }
        None => relative,
    };
    match Polytope::around(&outside) {
        Ok(polytope) => Some(polytope.hull()),
        // Too few points, or all on a line.
        Err(ConvexHullError::IncompleteInput | ConvexHullError::MissingSupportPoint) => Some(Hull::default()),
        Err(_) => None,
    }
}

/// Whether the convex hull of some points is less spherical than a threshold, see [`sphericity`].
///
/// Decided by bounds where they suffice: the hull contains that of a few extreme points, and is contained
/// in it grown by the largest height of a point above it, whose area and volume Steiner's formula gives.
pub fn flatter_than(points: &[DVec3], threshold: f64) -> bool {
    let Some(&first) = points.first() else { return threshold > 0.0 };
    let relative: Vec<DVec3> = points.iter().map(|&p| p - first).collect();
    if let Some(core) = Core::of(&relative) {
        let inner = core.polytope.hull();
        let outer = core.polytope.grown(core.heights.iter().fold(0.0, |most, &h| h.max(most)));
        // The slack is far above rounding and far below what matters.
        if sphericity(inner.volume_m3, outer.area_m2) > threshold * (1.0 + 1e-9) {
            return false;
        }
        if sphericity(outer.volume_m3, inner.area_m2) < threshold * (1.0 - 1e-9) {
            return true;
        }
    }
    // A body whose hull cannot be made is kept: nothing says that it is flat.
    hull(points).is_some_and(|exact| sphericity(exact.volume_m3, exact.area_m2) < threshold)
}

/// Directions in which extreme points are looked for.
const DIRECTIONS: usize = 96;
/// Below this many points a hull is cheaper than its bounds.
const FEW: usize = 300;

/// The hull of a few extreme points, and how high every point stands above it.
struct Core {
    polytope: Polytope,
    /// Largest height above a face, metres; negative inside.
    heights: Vec<f64>,
    /// Largest distance of a corner from the first point, metres.
    radius: f64,
}

impl Core {
    /// None where there are few points, or all lie in a plane.
    fn of(points: &[DVec3]) -> Option<Core> {
        if points.len() < FEW {
            return None;
        }
        let mut chosen: Vec<usize> = (0..DIRECTIONS).map(|i| extreme(points, direction(i))).collect();
        chosen.sort_unstable();
        chosen.dedup();
        let extremes: Vec<DVec3> = chosen.into_iter().map(|i| points[i]).collect();
        let polytope = Polytope::around(&extremes).ok()?;
        let radius = extremes.iter().map(|p| p.length()).fold(0.0, f64::max);
        if polytope.hull().volume_m3 <= 1e-9 * radius.powi(3) {
            return None;
        }
        let mut heights = vec![f64::NEG_INFINITY; points.len()];
        for face in &polytope.faces {
            let [a, b, c] = face.map(|i| polytope.corners[i as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let level = normal.dot(a);
            for (h, p) in heights.iter_mut().zip(points) {
                let height = normal.dot(*p) - level;
                *h = if height > *h { height } else { *h };
            }
        }
        Some(Core { polytope, heights, radius })
    }
}

/// Evenly spread directions: a spiral of golden angles.
fn direction(i: usize) -> DVec3 {
    let z = 1.0 - (2.0 * i as f64 + 1.0) / DIRECTIONS as f64;
    let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

fn extreme(points: &[DVec3], direction: DVec3) -> usize {
    let (mut best, mut at) = (f64::NEG_INFINITY, 0);
    for (i, p) in points.iter().enumerate() {
        let x = p.dot(direction);
        if x > best {
            (best, at) = (x, i);
        }
    }
    at
}

/// A convex polytope with triangular faces, outward.
struct Polytope {
    corners: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
}

impl Polytope {
    fn around(points: &[DVec3]) -> Result<Polytope, ConvexHullError> {
        let (corners, faces) = try_convex_hull(points)?;
        Ok(Polytope { corners, faces })
    }

    fn hull(&self) -> Hull {
        let mut hull = Hull::default();
        for face in &self.faces {
            let [a, b, c] = face.map(|i| self.corners[i as usize]);
            let normal = (b - a).cross(c - a);
            hull.area_m2 += 0.5 * normal.length();
            hull.volume_m3 += a.dot(normal) / 6.0;
        }
        hull.volume_m3 = hull.volume_m3.abs();
        hull
    }

    /// Area and volume of the polytope grown by a distance on all sides: Steiner's formula, with the
    /// integral of the mean curvature as half the sum of edge length times outer angle (each edge is seen
    /// from both of its faces here, hence a quarter).
    fn grown(&self, by: f64) -> Hull {
        let Hull { area_m2, volume_m3 } = self.hull();
        let normal = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|i| self.corners[i as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let mut sides: Vec<([u32; 2], usize)> = Vec::with_capacity(self.faces.len() * 3);
        for (i, f) in self.faces.iter().enumerate() {
            sides.extend((0..3).map(|k| ([f[k].min(f[(k + 1) % 3]), f[k].max(f[(k + 1) % 3])], i)));
        }
        sides.sort_unstable();
        let curvature: f64 = sides
            .chunk_by(|x, y| x.0 == y.0)
            .map(|pair| {
                let [a, b] = pair[0].0.map(|i| self.corners[i as usize]);
                let last = pair[pair.len() - 1].1;
                let cos = normal(&self.faces[pair[0].1]).dot(normal(&self.faces[last]));
                0.5 * (b - a).length() * cos.clamp(-1.0, 1.0).acos()
            })
            .sum();
        let pi = std::f64::consts::PI;
        Hull {
            area_m2: area_m2 + 2.0 * curvature * by + 4.0 * pi * by * by,
            volume_m3: volume_m3 + area_m2 * by + curvature * by * by + 4.0 / 3.0 * pi * by.powi(3),
        }
    }
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
    fn leaving_inner_points_out_changes_nothing() {
        for height in [0.05, 0.5, 1.0, 3.0] {
            let points = dome(height);
            let all = Polytope::around(&points).expect("solid").hull();
            let fast = hull(&points).expect("hull");
            assert!((fast.area_m2 / all.area_m2 - 1.0).abs() < 1e-12, "{fast:?} {all:?}");
            assert!((fast.volume_m3 / all.volume_m3 - 1.0).abs() < 1e-12, "{fast:?} {all:?}");
        }
    }

    #[test]
    fn bounds_decide_as_the_hull_does_and_hold_it_between_them() {
        for height in [0.05, 0.1, 0.2, 0.3, 0.5, 1.0] {
            let points = dome(height);
            let exact = hull(&points).expect("hull");
            let core = Core::of(&points).expect("solid");
            let outer = core.polytope.grown(core.heights.iter().fold(0.0, |most, &h| h.max(most)));
            let inner = core.polytope.hull();
            assert!(inner.area_m2 <= exact.area_m2 && exact.area_m2 <= outer.area_m2);
            assert!(inner.volume_m3 <= exact.volume_m3 && exact.volume_m3 <= outer.volume_m3);
            let s = sphericity(exact.volume_m3, exact.area_m2);
            for threshold in [0.01, 0.3, s - 1e-6, s + 1e-6, 0.5, 0.9] {
                assert_eq!(flatter_than(&points, threshold), s < threshold, "height {height}, threshold {threshold}");
            }
        }
    }

    #[test]
    fn growing_a_cube_rounds_its_edges_and_corners() {
        let cube: Vec<DVec3> =
            (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect();
        let grown = Polytope::around(&cube).expect("solid").grown(0.5);
        let pi = std::f64::consts::PI;
        assert!((grown.volume_m3 - (1.0 + 3.0 + 0.75 * pi + pi / 6.0)).abs() < 1e-12, "{grown:?}");
        assert!((grown.area_m2 - (6.0 + 3.0 * pi + pi)).abs() < 1e-12, "{grown:?}");
    }

    #[test]
    fn points_on_a_line_have_no_hull() {
        let points: Vec<DVec3> = (0..5).map(|i| DVec3::splat(f64::from(i))).collect();
        assert_eq!(hull(&points).expect("hull").volume_m3, 0.0);
        assert_eq!(hull(&[]), Some(Hull::default()));
    }
}
