//! The convex hull of many points as a polytope with triangular facets.

use super::DVec3;
use super::quickhull::Growing;

/// Why points have no polytope.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NoPolytope {
    /// All lie in one plane exactly, or nearly on a line or in a point.
    Flat,
    /// A coordinate is not finite, or so small against the others that even exact sides underflow.
    OutOfRange,
}

/// A convex polytope, facets outward.
#[derive(Debug)]
pub(super) struct Polytope<'a> {
    /// All points that it was made from; corners are some of them.
    pub points: &'a [DVec3],
    /// Corners of every facet, counter-clockwise seen from outside.
    pub facets: Vec<[u32; 3]>,
}

impl Polytope<'_> {
    /// The polytope around some points. Its last bits depend on their order.
    pub(super) fn around(points: &[DVec3]) -> Result<Polytope<'_>, NoPolytope> {
        let largest = points.iter().fold(0.0f64, |most, p| most.max(p.abs().max_element()));
        if !points.iter().all(|p| p.is_finite()) || points.len() > i32::MAX as usize {
            return Err(NoPolytope::OutOfRange);
        }
        // A power of two changes no digit, and keeps products of three coordinates in range.
        let exponent = largest.log2().ceil().clamp(-1000.0, 1000.0);
        let down = 2f64.powi(-exponent as i32);
        let mut growing = Growing::start(points.iter().map(|&p| p * down).collect())?;
        growing.finish()?;
        Ok(Polytope { points, facets: growing.facets() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::quickhull::height_exactly;
    use parry3d_f64::transformation::try_convex_hull;
    use proptest::prelude::*;

    fn area_and_volume(points: &[DVec3], facets: &[[u32; 3]]) -> [f64; 2] {
        facets.iter().fold([0.0; 2], |[area, volume], facet| {
            let [a, b, c] = facet.map(|i| points[i as usize] - points[0]);
            let normal = (b - a).cross(c - a);
            [area + 0.5 * normal.length(), volume + a.dot(normal) / 6.0]
        })
    }

    /// Closed, outward, no point above a facet, and of the same size as another library's hull.
    fn is_the_hull_of(points: &[DVec3]) {
        let polytope = Polytope::around(points).expect("solid");
        let mut sides: Vec<(u32, u32)> =
            polytope.facets.iter().flat_map(|f| (0..3).map(|k| (f[k], f[(k + 1) % 3]))).collect();
        let mut turned: Vec<(u32, u32)> = sides.iter().map(|&(from, to)| (to, from)).collect();
        sides.sort_unstable();
        turned.sort_unstable();
        assert_eq!(sides, turned, "an edge without its other facet");
        let corners: std::collections::BTreeSet<u32> = sides.iter().map(|s| s.0).collect();
        assert_eq!(corners.len() + polytope.facets.len(), sides.len() / 2 + 2, "not a sphere");
        for facet in &polytope.facets {
            let triangle = facet.map(|i| points[i as usize]);
            let outside = points.iter().position(|&p| height_exactly(triangle, p) > 0.0);
            assert_eq!(outside, None, "above {facet:?}");
        }
        let [area, volume] = area_and_volume(points, &polytope.facets);
        let (others, facets) = try_convex_hull(points).expect("solid");
        let [other_area, other_volume] = area_and_volume(&others, &facets);
        assert!((area / other_area - 1.0).abs() < 1e-9, "area {area}, {other_area} of parry");
        assert!((volume / other_volume - 1.0).abs() < 1e-9, "volume {volume}, {other_volume} of parry");
    }

    fn point() -> impl Strategy<Value = DVec3> {
        [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64].prop_map(DVec3::from_array)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn clouds_of_any_scale_have_their_hull(points in prop::collection::vec(point(), 20..300), scale in -9..9i32) {
            let scale = 10f64.powi(scale);
            is_the_hull_of(&points.iter().map(|&p| p * scale).collect::<Vec<_>>());
        }

        #[test]
        fn stones_with_every_point_on_the_hull_have_their_hull(points in prop::collection::vec(point(), 20..400)) {
            let sphere = points.iter().map(|p| p.normalize_or(DVec3::X) * DVec3::new(3.0, 2.0, 1.0));
            is_the_hull_of(&sphere.collect::<Vec<_>>());
        }

        #[test]
        fn doubled_points_change_nothing(points in prop::collection::vec(point(), 20..100)) {
            is_the_hull_of(&[points.clone(), points].concat());
        }

        #[test]
        fn no_points_however_degenerate_break_it(
            cells in prop::collection::vec([0..3u8, 0..3u8, 0..3u8], 0..60),
            turn in 0.0..6.0f64,
        ) {
            let points: Vec<DVec3> = cells.iter().map(|c| DVec3::from_array(c.map(f64::from))).collect();
            let turned: Vec<DVec3> = points.iter().map(|p| p.rotate_z(turn).rotate_x(turn)).collect();
            for points in [points, turned] {
                if let Ok(polytope) = Polytope::around(&points) {
                    let [area, volume] = area_and_volume(&points, &polytope.facets);
                    prop_assert!(volume > -1e-12 && volume < 8.0 + 1e-12 && area < 24.0 + 1e-12);
                }
            }
        }
    }

    #[test]
    fn a_cube_full_of_grid_points_has_six_square_sides() {
        let cube: Vec<DVec3> = (0..1000)
            .map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) * 0.1)
            .collect();
        for turn in [0.0, 0.7] {
            let points: Vec<DVec3> = cube.iter().map(|p| p.rotate_x(turn).rotate_z(turn)).collect();
            let facets = Polytope::around(&points).expect("solid").facets;
            let [area, volume] = area_and_volume(&points, &facets);
            assert!((area - 6.0 * 0.81).abs() < 1e-12 && (volume - 0.729).abs() < 1e-12, "{area} {volume}");
        }
    }

    #[test]
    fn flat_points_are_told_and_one_point_off_the_plane_is_not_missed() {
        let mut sheet: Vec<DVec3> = (0..100).map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.5)).collect();
        assert_eq!(Polytope::around(&sheet).err(), Some(NoPolytope::Flat));
        assert_eq!(Polytope::around(&sheet[..10]).err(), Some(NoPolytope::Flat));
        assert_eq!(Polytope::around(&[DVec3::ONE; 9]).err(), Some(NoPolytope::Flat));
        sheet.push(DVec3::new(4.5, 4.5, 0.5 + 1e-15));
        let polytope = Polytope::around(&sheet).expect("one point is off the plane");
        let [area, volume] = area_and_volume(&sheet, &polytope.facets);
        assert!((area - 162.0).abs() < 1e-9 && volume > 0.0 && volume < 1e-13, "{area} {volume}");
    }
}
