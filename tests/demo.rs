//! The sample scene: deterministic, a sound mesh, enough visible stones, true overhangs, exact truth.

use gravelometer::demo::{
    MIN_GRAIN_AREA_M2, SAND, Scene, SceneSettings, VISIBLE_AREA_FACTOR, make_scene, score, top_view, write_ply,
    write_png, write_truth_csv,
};
use std::collections::BTreeMap;
use std::sync::OnceLock;

fn sample() -> &'static Scene {
    static SCENE: OnceLock<Scene> = OnceLock::new();
    SCENE.get_or_init(|| make_scene(&SceneSettings::default()))
}

/// A hand's breadth of the same bed, quick to make.
fn small(seed: u64) -> Scene {
    make_scene(&SceneSettings { seed, side_m: 0.12, stones: 40, max_b_m: 0.03, ..SceneSettings::default() })
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_another_scene() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let bytes = |name: &str, seed: u64| {
        let (mesh, truth) = (folder.path().join(format!("{name}.ply")), folder.path().join(format!("{name}.csv")));
        let scene = small(seed);
        write_ply(&scene, &mesh).expect("mesh written");
        write_truth_csv(&scene, &truth).expect("truth written");
        (std::fs::read(mesh).expect("mesh"), std::fs::read(truth).expect("truth"), scene.stone_of_triangle)
    };
    let first = bytes("first", 7);
    assert!(first.0.starts_with(b"ply\nformat binary_little_endian 1.0\n") && first.0.len() > 100_000);
    assert_eq!(first, bytes("again", 7));
    assert_ne!(first.0, bytes("other", 8).0);
}

#[test]
fn at_least_three_hundred_stones_are_visible() {
    let least = VISIBLE_AREA_FACTOR * MIN_GRAIN_AREA_M2;
    let visible = sample().stones.iter().filter(|s| s.connected_area_m2 >= least).count();
    assert!(visible >= 300, "{visible} visible stones");
}

#[test]
fn the_survey_has_overhangs_and_the_demanded_resolution() {
    let scene = sample();
    let (mut down, mut edges) = (0, 0.0);
    for triangle in &scene.triangles {
        let [a, b, c] = triangle.map(|v| scene.vertices[v as usize].map(f64::from));
        down += usize::from((b[0] - a[0]) * (c[1] - a[1]) < (c[0] - a[0]) * (b[1] - a[1]));
        for (p, q) in [(a, b), (b, c), (c, a)] {
            edges += (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt();
        }
    }
    let count = scene.triangles.len();
    assert!((400_000..800_000).contains(&count), "{count} triangles");
    assert!(down as f64 > 0.005 * count as f64, "{down} of {count} triangles face down");
    assert!(2 * down < count, "{down} of {count} triangles face down: the surface is inside out");
    let edge_mm = 1e3 * edges / (3 * count) as f64;
    assert!((0.9..1.2).contains(&edge_mm), "mean edge {edge_mm} mm");
}

#[test]
fn the_mesh_is_an_oriented_manifold_up_to_its_border_and_uses_every_vertex() {
    let scene = sample();
    let mut directed: Vec<(u32, u32)> =
        scene.triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]).collect();
    directed.sort_unstable();
    assert!(directed.windows(2).all(|w| w[0] != w[1]), "an edge is used twice in one direction");
    let mut used = vec![false; scene.vertices.len()];
    scene.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    assert!(used.iter().all(|&u| u), "a vertex without triangles");
    assert!(scene.vertices.iter().flatten().all(|c| c.is_finite()));
    assert!((0..scene.triangles.len()).all(|t| scene.triangle_area_m2(t) > 0.0), "a triangle without area");
    assert_eq!(scene.colors.len(), scene.vertices.len());
}

#[test]
fn true_areas_of_stones_and_sand_sum_to_the_area_of_the_mesh() {
    let scene = sample();
    assert_eq!(scene.stone_of_triangle.len(), scene.triangles.len());
    let whole: f64 = (0..scene.triangles.len()).map(|t| scene.triangle_area_m2(t)).sum();
    let on_sand = |t: &usize| scene.stone_of_triangle[*t] == SAND;
    let sand: f64 = (0..scene.triangles.len()).filter(on_sand).map(|t| scene.triangle_area_m2(t)).sum();
    let stones: f64 = scene.stones.iter().map(|s| s.visible_area_m2).sum();
    assert!((stones + sand - whole).abs() < 1e-9 * whole, "{stones} + {sand} against {whole}");
    assert!(sand > 0.1 * whole && stones > 0.4 * whole, "{sand} m² of sand, {stones} m² of stones");
}

#[test]
fn true_axes_are_ordered_and_hold_the_visible_part_of_their_stone() {
    let scene = sample();
    let mut reach: BTreeMap<u32, f64> = BTreeMap::new();
    for (triangle, &stone) in scene.triangles.iter().zip(&scene.stone_of_triangle).filter(|&(_, &s)| s != SAND) {
        let centre = scene.stones[stone as usize].centre;
        for &v in triangle {
            let position = scene.vertices[v as usize].map(f64::from);
            let away = (gravelometer::geometry::DVec3::from_array(position) - centre).length();
            let farthest = reach.entry(stone).or_insert(0.0);
            *farthest = farthest.max(away);
        }
    }
    for stone in &scene.stones {
        let [a, b, c] = stone.axes_m;
        assert!(a >= b && b >= c && c > 0.002 && a < 0.09, "{stone:?}");
        assert!(stone.connected_area_m2 <= stone.visible_area_m2 + 1e-12, "{stone:?}");
        // Diagonals of the boxiest superellipsoid exceed its longest half axis by a quarter.
        let farthest = reach.get(&stone.id).copied().unwrap_or(0.0);
        assert!(farthest < 0.5 * a * 1.25 + 0.002, "{farthest} m against {stone:?}");
    }
}

#[test]
fn the_truth_given_as_grains_scores_nearly_one() {
    let scene = sample();
    let grains: Vec<i64> = scene.stone_of_triangle.iter().map(|&s| if s == SAND { -1 } else { i64::from(s) }).collect();
    let axes = |grain: i64| scene.stones.get(grain as usize).map(|s| s.axes_m);
    let result = score(scene, &grains, &axes, MIN_GRAIN_AREA_M2);
    assert_eq!((result.by_overlap.f1(), result.by_majority.f1()), (1.0, 1.0), "{result}");
    assert_eq!(result.axis_error, Some([0.0; 3]));
}

#[test]
fn the_picture_from_above_is_written_as_png() {
    let scene = small(3);
    let color = |t: usize| scene.colors[scene.triangles[t][0] as usize];
    let mut picture = top_view(&scene.vertices, &scene.triangles, &color, 300);
    let plain = picture.clone();
    picture.draw_outlines(&|t| i64::from(scene.stone_of_triangle[t]), [255, 0, 255]);
    assert_ne!(plain, picture);
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("top.png");
    write_png(&picture, &path).expect("picture written");
    assert!(std::fs::read(&path).expect("picture").starts_with(b"\x89PNG\r\n"));
    let refused = write_png(&picture, &folder.path().join("missing/top.png")).expect_err("no such folder").to_string();
    assert!(refused.contains("missing/top.png") && refused.contains("help: "), "{refused}");
}

#[test]
fn settings_beyond_their_ranges_still_give_a_scene() {
    let odd = SceneSettings {
        side_m: 0.0,
        stones: 5,
        median_b_m: f64::NAN,
        max_b_m: -1.0,
        voxel_m: 0.0015,
        ..SceneSettings::default()
    };
    let scene = make_scene(&odd);
    assert!(!scene.triangles.is_empty() && scene.vertices.iter().flatten().all(|c| c.is_finite()));
}
