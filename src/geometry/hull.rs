//! Convex hulls, by `parry3d-f64`.

use super::DVec3;

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
pub fn hull(points: &[DVec3]) -> Hull {
    let Some(&first) = points.first() else { return Hull::default() };
    let relative: Vec<DVec3> = points.iter().map(|&p| p - first).collect();
    let Ok((corners, faces)) = parry3d_f64::transformation::try_convex_hull(&relative) else {
        return Hull::default();
    };
    let mut hull = Hull::default();
    for face in faces {
        let [a, b, c] = face.map(|i| corners[i as usize]);
        let normal = (b - a).cross(c - a);
        hull.area_m2 += 0.5 * normal.length();
        hull.volume_m3 += a.dot(normal) / 6.0;
    }
    hull.volume_m3 = hull.volume_m3.abs();
    hull
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
        let hull = hull(&points);
        assert!((hull.area_m2 - 22.0).abs() < 1e-12 && (hull.volume_m3 - 6.0).abs() < 1e-12, "{hull:?}");
    }

    #[test]
    fn a_flat_sheet_has_two_sides_and_no_sphericity() {
        let points: Vec<DVec3> = (0..100).map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.5)).collect();
        let hull = hull(&points);
        assert!((hull.area_m2 - 162.0).abs() < 1e-9 && hull.volume_m3 == 0.0, "{hull:?}");
        assert_eq!(sphericity(hull.volume_m3, hull.area_m2), 0.0);
    }

    #[test]
    fn points_on_a_line_have_no_hull() {
        let points: Vec<DVec3> = (0..5).map(|i| DVec3::splat(f64::from(i))).collect();
        assert_eq!(hull(&points).volume_m3, 0.0);
        assert_eq!(hull(&[]), Hull::default());
    }
}
