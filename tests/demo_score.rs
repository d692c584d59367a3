//! The score on cases small enough to count by hand: strips of equal triangles.

use gravelometer::demo::{Detection, SAND, Scene, Score, Stone, score};
use gravelometer::geometry::DVec3;

/// A strip of triangles of 0.5 m² with the given stones.
fn strip(stone_of_triangle: &[u32]) -> Scene {
    let count = stone_of_triangle.len();
    let vertices = (0..count + 2).map(|i| [(i / 2) as f32, (i % 2) as f32, 0.0]).collect();
    let triangles = (0..count as u32).map(|i| [i, i + 1, i + 2]).collect();
    let stones = stone_of_triangle.iter().filter(|&&s| s != SAND).max().map_or(0, |m| m + 1);
    let stone = |id: u32| {
        let area = 0.5 * stone_of_triangle.iter().filter(|&&s| s == id).count() as f64;
        Stone {
            id,
            axes_m: [3.0, 2.0, 1.0],
            centre: DVec3::ZERO,
            directions: [DVec3::X, DVec3::Y, DVec3::Z],
            visible_area_m2: area,
            connected_area_m2: area,
        }
    };
    Scene {
        vertices,
        colors: vec![[0; 3]; count + 2],
        triangles,
        stone_of_triangle: stone_of_triangle.to_vec(),
        stones: (0..stones).map(stone).collect(),
    }
}

/// Two stones of four triangles between three strips of sand.
fn two_stones() -> Scene {
    strip(&[SAND, SAND, 0, 0, 0, 0, SAND, SAND, 1, 1, 1, 1, SAND, SAND])
}

fn scored(scene: &Scene, grains: &[i64]) -> Score {
    // Visible from 3 * 0.5 = 1.5 m², three triangles.
    score(scene, grains, &|_| Some([3.3, 1.8, 1.0]), 0.5)
}

#[test]
fn perfect_labels_score_one_whatever_their_numbers() {
    let result = scored(&two_stones(), &[-1, -1, 70, 70, 70, 70, -1, -1, 5, 5, 5, 5, -1, -1]);
    assert_eq!((result.visible_stones, result.grains), (2, 2));
    assert_eq!(result.by_overlap, Detection { found: 2, missed: 0, false_grains: 0 });
    assert_eq!(result.by_majority, result.by_overlap);
    assert_eq!((result.by_overlap.f1(), result.by_overlap.precision(), result.by_overlap.recall()), (1.0, 1.0, 1.0));
}

#[test]
fn axes_are_held_against_those_of_the_whole_stone() {
    let result = scored(&two_stones(), &[-1, -1, 7, 7, 7, 7, -1, -1, 5, 5, 5, 5, -1, -1]);
    let error = result.axis_error.expect("two stones are measured");
    for (found, expected) in error.iter().zip([0.1, 0.1, 0.0]) {
        assert!((found - expected).abs() < 1e-12, "{error:?}");
    }
    assert_eq!(result.true_b_m, Some([2.0; 3]));
    assert_eq!(result.found_b_m, Some([1.8; 3]));
}

#[test]
fn a_merged_pair_finds_one_stone_by_majority_and_counts_the_other_as_merged() {
    let scene = strip(&[SAND, 0, 0, 0, 0, 0, 1, 1, 1, SAND]);
    let result = scored(&scene, &[-1, 3, 3, 3, 3, 3, 3, 3, 3, -1]);
    assert_eq!(result.by_majority, Detection { found: 1, missed: 1, false_grains: 0 });
    assert_eq!(result.by_overlap, Detection { found: 1, missed: 1, false_grains: 0 }, "5 of 8 overlap");
    assert_eq!(result.merged_stones, 1);
    let even = strip(&[0, 0, 0, 0, 1, 1, 1, 1]);
    let tied = scored(&even, &[3; 8]);
    assert_eq!(tied.by_overlap, Detection { found: 1, missed: 1, false_grains: 0 }, "one grain, one stone");
}

#[test]
fn a_split_stone_is_found_once_and_its_second_piece_is_false() {
    let grains = [-1, -1, 1, 1, 1, 2, -1, -1, 5, 5, 5, 5, -1, -1];
    let result = scored(&two_stones(), &grains);
    assert_eq!(result.by_majority, Detection { found: 2, missed: 0, false_grains: 1 });
    assert_eq!(result.by_overlap, Detection { found: 2, missed: 0, false_grains: 1 });
    assert_eq!(result.split_grains, 1);
    let halves = scored(&two_stones(), &[-1, -1, 1, 1, 2, 2, -1, -1, 5, 5, 5, 5, -1, -1]);
    assert_eq!(halves.by_overlap, Detection { found: 2, missed: 0, false_grains: 1 }, "one stone, one grain");
}

#[test]
fn a_grain_on_sand_is_false_and_a_missed_stone_is_not_merged() {
    let result = scored(&two_stones(), &[9, 9, 1, 1, 1, 1, -1, -1, -1, -1, -1, -1, -1, -1]);
    assert_eq!(result.by_majority, Detection { found: 1, missed: 1, false_grains: 1 });
    assert_eq!(result.by_overlap, result.by_majority);
    assert_eq!((result.sand_grains, result.merged_stones), (1, 0));
    assert_eq!(result.by_majority.f1(), 0.5);
}

#[test]
fn a_stone_too_hidden_to_count_is_neither_missed_nor_false() {
    let scene = strip(&[0, 0, 0, 0, SAND, 1, 1, SAND]);
    let found = scored(&scene, &[1, 1, 1, 1, -1, 2, 2, -1]);
    assert_eq!((found.visible_stones, found.ignored_grains), (1, 1));
    assert_eq!(found.by_majority, Detection { found: 1, missed: 0, false_grains: 0 });
    assert_eq!(found.by_overlap, found.by_majority);
}

#[test]
fn without_grains_every_stone_is_missed_and_nothing_divides_by_zero() {
    let result = scored(&two_stones(), &[-1; 14]);
    assert_eq!(result.by_majority, Detection { found: 0, missed: 2, false_grains: 0 });
    assert_eq!((result.by_majority.precision(), result.by_majority.f1()), (0.0, 0.0));
    assert_eq!((result.axis_error, result.found_b_m), (None, None));
}

#[test]
fn the_table_names_counts_shares_and_percentiles() {
    let text = scored(&two_stones(), &[9, 9, 1, 1, 1, 1, -1, -1, -1, -1, -1, -1, -1, -1]).to_string();
    for part in ["2 visible stones, 2 grains", "50.0 %", "1 on sand", "D50 2000.0 mm (found 1800.0)"] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
}
