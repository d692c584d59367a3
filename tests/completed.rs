//! Axes of completed stones: on bodies of known axes, and on scenes whose stones are known.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use glam::{DMat3, DQuat, DVec3};
use gravelometer::measure::{Completed, Patch, axes, completed};
use gravelometer::settings::ShapePrior;
use npyz::npz::NpzArchive;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

const PRIOR: ShapePrior = ShapePrior::RIVER_GRAVEL;

fn measured(patch: &Patch) -> Option<Completed> {
    completed(patch, &axes(&patch.points), &PRIOR)
}

/// The part of an ellipsoid above `lowest` times its greatest height, turned and then shifted by its own length.
fn seen(axes_m: [f64; 3], turn: DMat3, lowest: f64) -> Patch {
    let (rings, around) = (60, 120);
    let half = DVec3::from_array(axes_m) / 2.0;
    let corner = |ring: u32, step: u32| {
        let (polar, azimuth) = (PI * f64::from(ring) / f64::from(rings), TAU * f64::from(step) / f64::from(around));
        let unit = DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
        turn * (unit * half)
    };
    let all: Vec<DVec3> = (0..=rings).flat_map(|r| (0..around).map(move |s| corner(r, s))).collect();
    let top = all.iter().fold(0.0f64, |top, p| top.max(p.z));
    let number = |r: u32, s: u32| r * around + s % around;
    let corners: Vec<[u32; 3]> = (0..rings)
        .flat_map(|r| (0..around).map(move |s| (r, s)))
        .flat_map(|(r, s)| {
            let [a, b, c, d] = [number(r, s), number(r + 1, s), number(r + 1, s + 1), number(r, s + 1)];
            [[a, b, c], [a, c, d]]
        })
        .filter(|t| t.iter().all(|&v| all[v as usize].z >= lowest * top))
        .collect();
    patch(&all, &corners)
}

/// Only the points that triangles use, in their order.
fn patch(points: &[DVec3], corners: &[[u32; 3]]) -> Patch {
    let mut used: Vec<u32> = corners.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let place = |v: u32| used.binary_search(&v).unwrap() as u32;
    Patch {
        points: used.iter().map(|&v| points[v as usize]).collect(),
        corners: corners.iter().map(|t| t.map(place)).collect(),
        vertices: used,
    }
}

fn tilted() -> DMat3 {
    DMat3::from_quat(DQuat::from_euler(glam::EulerRot::ZYX, 0.7, 0.15, -0.2))
}

fn relative(found: f64, expected: f64) -> f64 {
    found / expected - 1.0
}

#[test]
fn the_upper_half_of_a_stone_gives_its_axes_within_a_tenth() {
    for axes_m in [[0.10, 0.075, 0.06], [0.10, 0.075, 0.045], [0.10, 0.08, 0.07], [0.3, 0.2, 0.12]] {
        let stone = seen(axes_m, tilted(), 0.0);
        let half = axes(&stone.points).extents_m;
        let whole = measured(&stone).unwrap();
        println!("{axes_m:?}: box {half:?}, completed {whole:?}");
        assert!(relative(half[2], axes_m[2]) < -0.25, "nothing is hidden: {half:?}");
        assert!((0..3).all(|k| relative(whole.axes_m[k], axes_m[k]).abs() < 0.1), "{whole:?}");
        assert!((whole.axes_m[2] - axes_m[2]).abs() < whole.c_error_m, "{whole:?}");
        assert!((whole.seen_share - 0.5).abs() < 0.08, "{whole:?}");
    }
}

#[test]
fn a_stone_seen_from_all_sides_is_surer_than_half_of_it() {
    for axes_m in [[0.10, 0.075, 0.06], [0.10, 0.08, 0.03], [0.1, 0.095, 0.09]] {
        let (half, all) = (seen(axes_m, tilted(), 0.0), seen(axes_m, tilted(), -1.0));
        let (half, all) = (measured(&half).unwrap(), measured(&all).unwrap());
        println!("{axes_m:?}: {all:?}");
        assert!((0..3).all(|k| relative(all.axes_m[k], axes_m[k]).abs() < 0.12), "{all:?}");
        assert!(all.c_error_m < half.c_error_m && all.seen_share > 0.85 && !all.c_from_prior, "{all:?} {half:?}");
    }
}

#[test]
fn the_cap_of_a_ball_gives_the_ball_within_its_error() {
    for lowest in [-0.3, 0.0, 0.2] {
        let ball = measured(&seen([0.1; 3], DMat3::IDENTITY, lowest)).unwrap();
        println!("from {lowest}: {ball:?}");
        assert!((ball.axes_m[2] - 0.1).abs() < ball.c_error_m, "{ball:?}");
        assert!(relative(ball.axes_m[2], 0.1).abs() < 0.2, "{ball:?}");
    }
}

#[test]
fn a_small_cap_says_that_its_c_is_a_guess() {
    let cap = measured(&seen([0.1, 0.08, 0.05], tilted(), 0.9)).unwrap();
    let half = measured(&seen([0.1, 0.08, 0.05], tilted(), 0.0)).unwrap();
    println!("{cap:?} {half:?}");
    assert!(cap.c_error_m / cap.axes_m[2] > half.c_error_m / half.axes_m[2], "{cap:?} {half:?}");
    assert!(cap.seen_share < half.seen_share && !half.c_from_prior, "{cap:?} {half:?}");
}

#[test]
fn neither_place_nor_turn_nor_unit_changes_the_axes() {
    let home = seen([0.1, 0.07, 0.05], tilted(), -0.3);
    let at_home = measured(&home).unwrap();
    for (scale, turn, shift) in [
        (1.0, DMat3::IDENTITY, DVec3::new(812.25, -377.5, 64.0)),
        (1.0, DMat3::from_rotation_z(1.3), DVec3::ZERO),
        (1.0, DMat3::from_quat(DQuat::from_euler(glam::EulerRot::ZYX, 2.7, -1.4, 1.9)), DVec3::new(1.0, 2.0, 3.0)),
        (1000.0, DMat3::IDENTITY, DVec3::ZERO),
    ] {
        let mut moved = home.clone();
        moved.points.iter_mut().for_each(|p| *p = turn * *p * scale + shift);
        let there = measured(&moved).unwrap();
        let pairs = [0, 1, 2].map(|k| (there.axes_m[k], at_home.axes_m[k] * scale));
        let more = [(there.c_error_m, at_home.c_error_m * scale), (there.seen_share, at_home.seen_share)];
        let worst = pairs.iter().chain(&more).fold(0.0f64, |worst, &(f, e)| worst.max(relative(f, e).abs()));
        println!("worst relative change {worst:.1e}");
        assert!(worst < 1e-6, "{there:?} {at_home:?}");
    }
}

#[test]
fn a_flat_patch_says_that_its_c_is_the_prior() {
    let points: Vec<DVec3> =
        (0..900).map(|i| DVec3::new(f64::from(i % 30) * 0.004, f64::from(i / 30) * 0.003, 2.0)).collect();
    let corners: Vec<[u32; 3]> = (0..29 * 29)
        .flat_map(|i| {
            let v = i / 29 * 30 + i % 29;
            [[v, v + 1, v + 31], [v, v + 31, v + 30]]
        })
        .collect();
    let flat = measured(&patch(&points, &corners)).unwrap();
    println!("{flat:?}");
    assert!(flat.axes_m.iter().all(|a| a.is_finite() && *a > 0.0) && flat.c_error_m.is_finite());
    assert!(flat.c_error_m > 0.15 * flat.axes_m[2], "{flat:?}");
}

#[test]
fn patches_without_enough_to_see_have_no_completed_axes() {
    assert_eq!(measured(&Patch::default()), None);
    let five: Vec<DVec3> = (0..5).map(|i| DVec3::new(f64::from(i), f64::from(i * i), f64::from(i % 2))).collect();
    assert_eq!(measured(&patch(&five, &[[0, 1, 2], [1, 2, 3], [2, 3, 4]])), None);
    let line: Vec<DVec3> = (0..50).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)).collect();
    let thin: Vec<[u32; 3]> = (0..48).map(|i| [i, i + 1, i + 2]).collect();
    assert_eq!(measured(&patch(&line, &thin)), None);
    let point = vec![DVec3::splat(3.0); 50];
    assert_eq!(measured(&patch(&point, &thin)), None);
    let mut broken = line.clone();
    broken[7].z = f64::NAN;
    assert_eq!(measured(&patch(&broken, &thin)), None);
}

#[test]
fn the_usual_shape_decides_where_little_is_seen_and_hardly_where_all_is() {
    let flat = ShapePrior { c_over_b: 0.4, ..PRIOR };
    let c = |patch: &Patch, prior: &ShapePrior| completed(patch, &axes(&patch.points), prior).unwrap().axes_m[2];
    let (cap, all) = (seen([0.1, 0.08, 0.05], tilted(), 0.8), seen([0.1, 0.08, 0.05], tilted(), -1.0));
    let (of_cap, of_all) = (relative(c(&cap, &flat), c(&cap, &PRIOR)), relative(c(&all, &flat), c(&all, &PRIOR)));
    println!("cap {of_cap:.3}, whole {of_all:.3}");
    assert!(of_cap < -0.1 && of_all.abs() < 0.05, "cap {of_cap}, whole {of_all}");
}

/// The visible, whole stones of a development scene, with their true axes.
fn known_stones(scene: &str) -> Option<Vec<(Patch, [f64; 3])>> {
    let folder = support::data(&format!("dev-scenes/{scene}"))?;
    let bytes = std::fs::read(folder.join("mesh.ply")).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    let count = |name: &str| -> usize {
        header.lines().find_map(|l| l.strip_prefix(&format!("element {name} "))).unwrap().parse().unwrap()
    };
    let (n, m) = (count("vertex"), count("face"));
    // Float x y z and uchar colours, then triangles as `list uchar int`.
    assert_eq!(bytes.len(), end + 15 * n + 13 * m);
    let word = |at: usize| -> [u8; 4] { bytes[at..at + 4].try_into().unwrap() };
    let point = |v: usize| DVec3::from_array([0, 4, 8].map(|k| f64::from(f32::from_le_bytes(word(end + 15 * v + k)))));
    let corners = |t: usize| [1, 5, 9].map(|k| u32::from_le_bytes(word(end + 15 * n + 13 * t + k)));
    let mut archive = NpzArchive::open(folder.join("truth.npz")).unwrap();
    let stone_of: Vec<i32> = archive.by_name("tri_id").unwrap().unwrap().into_vec().unwrap();
    let mut triangles = BTreeMap::<i32, Vec<[u32; 3]>>::new();
    for (t, &stone) in stone_of.iter().enumerate() {
        triangles.entry(stone).or_default().push(corners(t));
    }
    let points: Vec<DVec3> = (0..n).map(point).collect();
    let mut table = csv::Reader::from_path(folder.join("truth.csv")).unwrap();
    let names = table.headers().unwrap().clone();
    let column = |name: &str| names.iter().position(|h| h == name).unwrap();
    let [id, visible, cut, a, b, c] = ["id", "visible", "cut", "A", "B", "C"].map(column);
    let mut stones = Vec::new();
    for row in table.records().map(Result::unwrap) {
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        let seen = triangles.get(&(number(id) as i32));
        if let Some(seen) = seen.filter(|_| number(visible) > 0.0 && number(cut) == 0.0) {
            stones.push((patch(&points, seen), [a, b, c].map(number)));
        }
    }
    Some(stones)
}

#[test]
fn c_of_known_stones_is_nearer_than_the_box_and_its_error_is_honest() {
    let (mut within, mut count, mut sum) = (0, 0, 0.0);
    for (scene, most) in [
        ("coarse", 0.15),
        ("packed_window", 0.16),
        ("sandbox_window", 0.15),
        ("sandbox_low_window", 0.15),
        ("wide_window", 0.15),
    ] {
        let Some(stones) = known_stones(scene) else { return };
        let (mut fit, mut of_box, mut b_fit, mut b_box, mut inside) = (0.0, 0.0, 0.0, 0.0, 0);
        for (patch, true_m) in &stones {
            let visible = axes(&patch.points);
            let whole = completed(patch, &visible, &PRIOR).unwrap();
            fit += relative(whole.axes_m[2], true_m[2]).abs();
            of_box += relative(visible.extents_m[2], true_m[2]).abs();
            b_fit += relative(whole.axes_m[1], true_m[1]).abs();
            b_box += relative(visible.extents_m[1], true_m[1]).abs();
            inside += usize::from((whole.axes_m[2] - true_m[2]).abs() <= whole.c_error_m);
        }
        let n = stones.len() as f64;
        let [fit, of_box, b_fit, b_box, share] = [fit / n, of_box / n, b_fit / n, b_box / n, inside as f64 / n];
        println!(
            "{scene}: {n} stones, c {fit:.3} (box {of_box:.3}), b {b_fit:.3} (box {b_box:.3}), in 1 sd {share:.2}"
        );
        assert!(fit < most && fit < of_box && b_fit < b_box, "{scene}: c {fit} {of_box}, b {b_fit} {b_box}");
        (within, count, sum) = (within + inside, count + stones.len(), sum + fit * n);
    }
    let (share, mean) = (within as f64 / count as f64, sum / count as f64);
    println!("all {count}: c {mean:.3}, within one standard deviation {share:.2}");
    assert!((0.62..0.84).contains(&share) && mean < 0.13, "{share}, {mean}");
}
