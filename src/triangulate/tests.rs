#![allow(clippy::unwrap_used)]

use super::*;
use crate::open::MemorySurface;
use robust::{Coord, incircle, orient2d};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read, Seek};

/// Numbers between 0 and 1, always the same.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn cloud(positions: Vec<DVec3>) -> MemorySurface {
    MemorySurface { positions, ..MemorySurface::default() }
}

/// Gently rolling ground, points strewn at random, denser to the east.
fn ground(n: usize, seed: u64) -> Vec<DVec3> {
    let mut next = random(seed);
    let point = |_| {
        let (x, y) = (next().sqrt() * 3.0, next() * 2.0);
        DVec3::new(x, y, 0.05 * (3.0 * x).sin() * (4.0 * y).cos() + 1e-3 * next())
    };
    (0..n).map(point).collect()
}

fn draped(points: &[DVec3], settings: &SurfaceSettings, most_points: u64) -> (Vec<[u64; 3]>, DrapeFigures) {
    let folder = tempfile::tempdir().unwrap();
    let shelf = Shelf::new(folder.path()).unwrap();
    let found =
        drape_in_blocks(&cloud(points.to_vec()), &|_| true, settings, (&shelf, 1 << 26, &|_| Ok(())), most_points)
            .unwrap();
    let (mut file, mut bytes) = (found.triangles, Vec::new());
    file.rewind().unwrap();
    file.read_to_end(&mut bytes).unwrap();
    assert!(!found.wide);
    let number = |b: &[u8]| u64::from(u32::from_le_bytes(b.try_into().unwrap()));
    let triangles = bytes.chunks_exact(12).map(|t| [number(&t[..4]), number(&t[4..8]), number(&t[8..])]).collect();
    (triangles, found.figures)
}

/// Triangles as places, in an order of their own.
fn places(points: &[DVec3], triangles: &[[u64; 3]]) -> Vec<[[u64; 3]; 3]> {
    let place = |v: u64| points[v as usize].to_array().map(f64::to_bits);
    let mut all: Vec<_> = triangles.iter().map(|t| t.map(place)).collect();
    all.sort_unstable();
    all
}

fn coord(p: DVec3) -> Coord<f64> {
    Coord { x: p.x, y: p.y }
}

/// Points on flat ground at random.
fn flat(n: usize, seed: u64) -> Vec<DVec3> {
    let mut next = random(seed);
    (0..n).map(|_| DVec3::new(next() * 3.0, next() * 2.0, 0.0)).collect()
}

fn area_m2(points: &[DVec3], triangles: &[[u64; 3]]) -> f64 {
    triangles.iter().map(|t| crate::geometry::triangle_area(t.map(|v| points[v as usize]))).sum()
}

/// No side is taken twice in the same sense, so no edge has more than two triangles and neighbours face alike.
fn is_manifold(triangles: &[[u64; 3]]) -> bool {
    let mut sides: Vec<[u64; 2]> = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    sides.sort_unstable();
    sides.windows(2).all(|pair| pair[0] != pair[1])
}

#[test]
fn on_flat_ground_the_triangles_are_those_of_delaunay() {
    for seed in 1..4 {
        let points = flat(800, seed);
        let (triangles, figures) = draped(&points, &SurfaceSettings::default(), 300);
        for t in &triangles {
            let [p, q, r] = t.map(|v| coord(points[v as usize]));
            assert!(orient2d(p, q, r) > 0.0, "{t:?} faces down");
            let inside = |i: &u64| !t.contains(i) && incircle(p, q, r, coord(points[*i as usize])) > 0.0;
            // Where points are strewn thinly, a circle may reach further than a point's neighbours.
            let sides = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| points[t[i] as usize].distance(points[t[j] as usize]));
            let radius_m = sides.iter().product::<f64>() / (2.0 * orient2d(p, q, r));
            let within = (0..800).filter(inside).count();
            assert!(within == 0 || radius_m > 1.2 * figures.spacing_m, "{within} points within the circle of {t:?}");
        }
        assert!(is_manifold(&triangles));
        // A triangulation of n points with h on its border has 2n - 2 - h triangles.
        assert!(figures.triangles > 1600 - 2 - 140 && area_m2(&points, &triangles) > 0.93 * 6.0, "{figures:?}");
    }
}

#[test]
fn blocks_do_not_change_the_surface() {
    let mut points = ground(20_000, 9);
    // Walls, noise, and a roof over a part.
    points.iter_mut().for_each(|p| p.z += if p.x > 1.5 && p.y > 0.7 { 0.3 * (p.x - 1.5).min(0.1) / 0.1 } else { 0.0 });
    points.iter_mut().step_by(7).for_each(|p| p.z += 0.004);
    let roof: Vec<DVec3> = points.iter().filter(|p| p.x < 1.0).map(|p| *p + DVec3::new(0.001, 0.002, 0.2)).collect();
    points.extend(roof);
    for gap_spacings in [2.0, 3.0] {
        blocks_agree(&points, &SurfaceSettings { gap_spacings });
    }
}

/// Whatever the size of blocks.
fn blocks_agree(points: &[DVec3], settings: &SurfaceSettings) {
    let (whole, figures) = draped(points, settings, 1 << 17);
    assert!(is_manifold(&whole) && whole.len() > points.len(), "{figures:?}");
    for most in [333, 1500, 6000] {
        let (triangles, of_blocks) = draped(points, settings, most);
        assert_eq!(of_blocks, figures, "blocks of {most}");
        assert_eq!(places(points, &triangles), places(points, &whole), "blocks of {most}");
    }
}

#[test]
fn blocks_do_not_change_the_surface_where_density_jumps_and_noise_is_as_coarse_as_points_lie_apart() {
    let mut next = random(7);
    // Four hundred times as many points in a corner as elsewhere, all with heights that say little.
    let sparse = (0..1500).map(|_| [next() * 3.0, next() * 2.0, next() * 0.06]).collect::<Vec<_>>();
    let dense = (0..12_000).map(|_| [next() * 0.35, next() * 0.35, next() * 0.003]).collect::<Vec<_>>();
    let points: Vec<DVec3> = sparse.into_iter().chain(dense).map(DVec3::from_array).collect();
    blocks_agree(&points, &SurfaceSettings { gap_spacings: 3.0 });
}

#[test]
fn the_order_of_points_does_not_change_the_surface_even_on_a_grid() {
    // Four corners of each square lie on one circle, and all columns are in line.
    let mut points: Vec<DVec3> =
        (0..40 * 30).map(|i| DVec3::new(f64::from(i % 40) * 0.5, f64::from(i / 40) * 0.5, 0.0)).collect();
    let (triangles, _) = draped(&points, &SurfaceSettings::default(), 300);
    assert_eq!(triangles.len(), 2 * 39 * 29);
    let expected = places(&points, &triangles);
    let mut next = random(4);
    for _ in 0..3 {
        for i in (1..points.len()).rev() {
            points.swap(i, (next() * (i + 1) as f64) as usize);
        }
        let (triangles, _) = draped(&points, &SurfaceSettings::default(), 500);
        assert_eq!(places(&points, &triangles), expected);
    }
}

#[test]
fn no_triangle_spans_a_gap_and_few_are_missing_elsewhere() {
    // A strip without points, 15 spacings wide.
    let points: Vec<DVec3> = flat(8000, 5).into_iter().filter(|p| (p.x - 2.0).abs() > 0.2).collect();
    let (triangles, figures) = draped(&points, &SurfaceSettings::default(), 2000);
    let side = |v: u64| points[v as usize].x > 2.0;
    assert!(triangles.iter().all(|t| side(t[0]) == side(t[1]) && side(t[1]) == side(t[2])));
    let share = area_m2(&points, &triangles) / (2.6 * 2.0);
    assert!(share > 0.95, "{share} of the ground, {figures:?}");
}

#[test]
fn a_stone_is_covered_from_above_and_below_its_widest_place_and_faces_outwards() {
    // Evenly spread points on a sphere (a spiral), from the top to far below the equator.
    let n = 1500;
    let turn = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let point = |i: i32| {
        let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n);
        let (radius, angle) = ((1.0 - z * z).sqrt(), turn * f64::from(i));
        DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
    };
    let points: Vec<DVec3> = (0..n).map(point).filter(|p| p.z > -0.4).collect();
    let (triangles, figures) = draped(&points, &SurfaceSettings::default(), 400);
    assert!(is_manifold(&triangles));
    for t in &triangles {
        let corners = t.map(|v| points[v as usize]);
        assert!(crate::geometry::triangle_normal(corners).dot(corners[0]) > 0.8, "{corners:?}");
    }
    // The cap of a sphere has an area of 2 pi times its height.
    let share = area_m2(&points, &triangles) / (std::f64::consts::TAU * 1.4);
    assert!((0.95..1.0).contains(&share), "{share} of the cap, {figures:?}");
    // One surface without holes: vertices - edges + triangles is 1.
    let used: BTreeSet<u64> = triangles.iter().flatten().copied().collect();
    let mut edges = BTreeMap::new();
    for &[a, b, c] in &triangles {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    assert_eq!(used.len() as i64 - edges.len() as i64 + triangles.len() as i64, 1);
}

#[test]
fn points_that_are_not_kept_and_points_that_are_there_twice_do_not_matter() {
    let points = ground(3000, 2);
    let mut more = points.clone();
    more.extend((0..500).map(|i| DVec3::new(f64::from(i) * 0.37, -50.0, 9.0)));
    let folder = tempfile::tempdir().unwrap();
    let shelf = Shelf::new(folder.path()).unwrap();
    let found =
        drape(&cloud(more), &|i| i < 3000, &SurfaceSettings::default(), (&shelf, 1 << 26), &|_| Ok(())).unwrap();
    let (expected, figures) = draped(&points, &SurfaceSettings::default(), 1 << 17);
    assert_eq!((found.figures.triangles, found.figures.skipped), (expected.len() as u64, 500));
    assert_eq!(found.figures.spacing_m, figures.spacing_m);
    let mut twice = points.clone();
    twice.extend_from_within(100..200);
    let (triangles, figures) = draped(&twice, &SurfaceSettings::default(), 1 << 17);
    assert_eq!(figures.same_place, 100);
    assert!(triangles.iter().flatten().all(|&v| v < 3000));
}

#[test]
fn a_cloud_without_a_surface_is_refused_by_what_it_lacks() {
    let refusal = |points: Vec<DVec3>| {
        let folder = tempfile::tempdir().unwrap();
        let shelf = Shelf::new(folder.path()).unwrap();
        drape(&cloud(points), &|_| true, &SurfaceSettings::default(), (&shelf, 1 << 26), &|_| Ok(()))
            .unwrap_err()
            .to_string()
    };
    let line = |n: u32| (0..n).map(|i| DVec3::new(f64::from(i), 2.0 * f64::from(i), 0.0)).collect::<Vec<_>>();
    assert!(refusal(line(2)).contains("2 of the 2 points"));
    assert!(refusal(vec![DVec3::ONE; 9]).contains("9 of the 9 points"));
    assert!(refusal(line(50)).contains("no three are near enough"));
}
