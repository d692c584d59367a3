//! What must hold on any scene, on boards that can be counted by hand.

use crate::board::Board;
use gravelometer::geometry::DVec3;
use gravelometer::validate::{Detection, Labels, Mostly, Reliability, Shown, TrueStone, Truth, score, shown};

const STONES: [&str; 5] = ["..........", ".aaaa.bb..", ".aaaa.bb..", ".aaaa.bb..", ".........."];

fn detection(found: usize, false_grains: usize, missed: usize) -> Detection {
    Detection { found, missed, false_grains }
}

#[test]
fn perfect_labels_score_one_whatever_their_numbers() {
    let truth = Board::new(&STONES);
    let renamed = ["..........", ".yyyy.cc..", ".yyyy.cc..", ".yyyy.cc..", ".........."];
    let found = truth.scored(&renamed);
    assert_eq!(found.judgement.by_overlap, detection(2, 0, 0));
    assert_eq!(found.judgement.by_majority, detection(2, 0, 0));
    let counts = found.score.detection_iou50;
    assert_eq!([counts.precision, counts.recall, counts.f1, counts.iou], [1.0; 4]);
    let area = found.score.area.unwrap();
    assert!([area.precision, area.recall, area.iou].iter().all(|m| m.mean == 1.0 && m.median == 1.0), "{area:?}");
    assert_eq!(found.score.matched.iter().map(|m| (m.pebble, m.segment)).collect::<Vec<_>>(), [(0, 24), (1, 2)]);
}

#[test]
fn the_box_of_a_patch_and_its_turn_are_those_of_its_corners() {
    // 4 x 3 squares: the box is 4 by 3, the stone 3 by 2 by 1, both along x and y.
    let found = Board::new(&STONES).scored(&STONES);
    let first = &found.score.matched[0];
    assert!((first.a_error - 1.0).abs() < 0.05 && (first.b_error - 1.0).abs() < 0.05, "{first:?}");
    assert!((first.c_error + 0.96).abs() < 0.05, "{first:?}");
    let turned = first.attitude.unwrap();
    assert!(turned.cumulative_angle < 2.0 && turned.a_angle < 2.0, "{turned:?}");
    let b = found.score.b_axis_mm.unwrap();
    assert_eq!(b.truth.to_array(), [2000.0; 3]);
}

#[test]
fn a_split_stone_is_over_segmentation() {
    let grains = ["..........", ".ccca.bb..", ".ccca.bb..", ".ccca.bb..", ".........."];
    let found = Board::new(&STONES).scored(&grains);
    assert_eq!(found.judgement.by_majority, detection(2, 1, 0));
    assert_eq!(found.judgement.by_overlap, detection(2, 1, 0), "9 of 12 are enough");
    let errors = found.score.errors;
    assert_eq!((errors.over_segmented_extra, errors.over_segmented_pebbles), (1, 1));
    assert_eq!(found.score.matched[0].segment, 2, "the larger piece is the match");
}

#[test]
fn a_merged_pair_counts_one_stone_as_under_segmented() {
    let grains = ["..........", ".aaaaaaa..", ".aaaaaaa..", ".aaaaaaa..", ".........."];
    let found = Board::new(&STONES).scored(&grains);
    assert_eq!(found.judgement.by_majority, detection(1, 0, 1));
    assert_eq!((found.score.errors.under_segmented, found.score.errors.missed), (1, 0));
    assert_eq!(found.judgement.merged, [1]);
}

#[test]
fn a_stone_of_which_less_than_a_quarter_is_in_another_grain_is_overlooked() {
    let stones = ["aaaa.bbb", "aaaa.bbb", "aaaa.bbb"];
    let two_of_nine = ["aaaaaa..", "aaaaaa..", "aaaa...."];
    let found = Board::new(&stones).scored(&two_of_nine);
    assert_eq!((found.judgement.merged.len(), found.judgement.overlooked.as_slice()), (0, [1].as_slice()));
}

#[test]
fn a_grain_on_sand_is_false() {
    let grains = ["cc........", ".aaaa.bb..", ".aaaa.bb..", ".aaaa.bb..", ".........."];
    let found = Board::new(&STONES).scored(&grains);
    assert_eq!(found.judgement.by_majority, detection(2, 1, 0));
    assert_eq!(found.judgement.by_overlap, detection(2, 1, 0));
    assert_eq!(found.score.errors.mostly_sand, 1);
}

#[test]
fn hidden_stones_and_membranes_are_held_against_nobody() {
    let board = Board::new(&STONES);
    let grains = Board::new(&["cc........", ".aaaa.bb..", ".aaaa.bb..", ".aaaa.bb..", ".........."]).labels();
    let mut truth = board.truth();
    truth.visible[1] = false;
    truth.unseen = vec![false; truth.triangles.len()];
    truth.unseen[0..3].fill(true);
    let found = score(&truth, &grains, 0.0);
    assert_eq!(found.judgement.by_majority, detection(1, 0, 0));
    assert_eq!(found.judgement.by_overlap, detection(1, 0, 0));
    assert_eq!((found.judgement.hidden_grains, found.score.errors.phantom_ignored), (1, 1));
    assert_eq!((found.score.visible, found.score.segments), (1, 3));
    // A quarter of the grain on a membrane is not enough.
    truth.unseen[1..3].fill(false);
    assert_eq!(score(&truth, &grains, 0.0).score.errors.mostly_sand, 1);
}

#[test]
fn grains_below_the_smallest_are_not_looked_at() {
    let board = Board::new(&STONES);
    let grains = Board::new(&["cc........", ".aaaa.bb..", ".aaaa.bb..", ".aaaa.bb..", ".........."]).labels();
    let found = score(&board.truth(), &grains, 2.5);
    assert_eq!((found.score.segments, found.judgement.by_majority), (2, detection(2, 0, 0)));
    assert_eq!(found.judgement.mostly[2], Mostly::Small);
}

#[test]
fn stones_that_the_border_cuts_are_found_but_not_sized() {
    let board = Board::new(&STONES);
    let mut truth = board.truth();
    truth.stones[0].is_cut = true;
    truth.stones[0].axes_m = [300.0, 200.0, 100.0];
    let found = score(&truth, &board.labels(), 0.0);
    assert_eq!(found.judgement.by_majority, detection(2, 0, 0));
    let b = found.score.b_axis_mm.unwrap();
    assert_eq!(b.truth.to_array(), [2000.0; 3]);
    assert!((b.segments.unwrap().d50 - 2000.0).abs() < 50.0, "only the grain of the whole stone: {b:?}");
    assert!((found.score.axes.unwrap().b.bias_percent).abs() < 3.0);
}

#[test]
fn a_reference_pebble_is_listed_also_where_another_stone_has_its_grain() {
    let grains = ["..........", ".aaaaaaa..", ".aaaaaaa..", ".aaaaaaa..", ".........."];
    let mut truth = Board::new(&STONES).truth();
    (truth.stones[0].reference, truth.stones[1].reference) = (2, 1);
    let found = score(&truth, &Board::new(&grains).labels(), 0.0);
    let references = found.score.reference_pebbles.unwrap();
    assert_eq!(
        references.rows.iter().map(|r| (r.reference, r.pebble, r.main)).collect::<Vec<_>>(),
        [(1, 1, 0), (2, 0, 1)]
    );
    // The grain has 21 squares, the stones 6 and 12 of them.
    assert!((references.rows[0].precision - 6.0 / 21.0).abs() < 0.01 && references.rows[0].recall == 1.0);
    assert_eq!(references.iou_over_08, 0);
}

#[test]
fn without_grains_every_stone_is_overlooked_and_nothing_divides_by_zero() {
    let found = Board::new(&STONES).scored(&[".........."; 5]);
    assert_eq!(found.judgement.by_majority, detection(0, 0, 2));
    assert_eq!((found.score.errors.missed, found.score.detection_iou50.f1), (2, 0.0));
    assert!(found.score.area.is_none() && found.score.b_axis_mm.is_none() && found.score.axes.is_none());
    let without_stones = Board::new(&[".........."; 5]).scored(&STONES);
    assert_eq!(without_stones.judgement.by_majority, detection(0, 2, 0));
}

#[test]
fn labels_of_vertices_give_a_triangle_to_the_grain_of_two_of_its_vertices() {
    let triangles = [[0, 1, 2], [1, 2, 3], [2, 3, 4], [0, 3, 2], [0, 2, 4]];
    let labels = Labels::of_vertices(vec![5, 5, 7, 7, -1], &triangles);
    assert_eq!(labels.of_triangle, [5, 7, 7, 7, -1]);
    let zero = Labels::of_triangles(vec![0, 1, -3]).zero_is_none();
    assert_eq!(zero.of_triangle, [-1, 1, -3]);
}

/// A cap of a ball of 20 mm: rings of points, all on the sphere.
fn ball(radius_m: f64) -> Truth {
    let (rings, around) = (20u32, 30u32);
    let mut points = vec![DVec3::new(0.1, 0.2, radius_m)];
    for i in 0..rings * around {
        let (lean, turn) = (1.2 * f64::from(i / around + 1) / f64::from(rings), f64::from(i % around) * 0.209_439_51);
        let out = DVec3::new(lean.sin() * turn.cos(), lean.sin() * turn.sin(), lean.cos());
        points.push(DVec3::new(0.1, 0.2, 0.0) + radius_m * out);
    }
    let at = |ring: u32, step: u32| 1 + ring * around + step % around;
    let mut triangles: Vec<[u32; 3]> = (0..around).map(|s| [0, at(0, s), at(0, s + 1)]).collect();
    for ring in 1..rings {
        for s in 0..around {
            triangles.push([at(ring - 1, s), at(ring, s), at(ring, s + 1)]);
            triangles.push([at(ring - 1, s), at(ring, s + 1), at(ring - 1, s + 1)]);
        }
    }
    let stone = TrueStone { radius_m: Some(radius_m), ..TrueStone::of_axes([2.0 * radius_m; 3]) };
    let count = triangles.len();
    Truth::new(points, triangles, vec![0; count], vec![stone])
}

#[test]
fn a_calibration_ball_without_noise_lies_on_its_sphere() {
    let truth = ball(0.02);
    let labels = Labels::of_triangles(vec![4; truth.triangles.len()]);
    let spheres = score(&truth, &labels, 0.0).score.spheres.expect("a ball");
    assert_eq!(spheres.n, 1);
    assert!(spheres.rmse_mm.max < 1e-9 && spheres.rmse_true_radius_mm.max < 1e-9, "{spheres:?}");
    assert!(spheres.radius_bias_mm.abs() < 1e-9, "{spheres:?}");
    let mut larger = ball(0.02);
    larger.stones[0].radius_m = Some(0.0195);
    let spheres = score(&larger, &labels, 0.0).score.spheres.expect("a ball");
    assert!((spheres.radius_bias_mm - 0.5).abs() < 1e-9 && (spheres.rmse_true_radius_mm.max - 0.5).abs() < 1e-9);
    // Too little of it is in the mesh to say.
    larger.stones[0].represented = Some(0.15);
    assert!(score(&larger, &labels, 0.0).score.spheres.is_none());
}

#[test]
fn the_map_shows_each_kind_of_error_by_its_colour() {
    let stones =
        Board::new(&["aaaa.bbbbb.", "aaaa.bbbbb.", ".....bbbbb.", "cc.dddddd..", "cc.dddddd..", "ee...f....."]);
    let grains =
        Board::new(&["aaah.mmmnn.", "aaah.mmmnn.", "....hmmmnn.", ".....pppppp", ".....pppppp", "ppp..s..qq."]);
    let mut truth = stones.truth();
    truth.visible[5] = false;
    let scored = score(&truth, &grains.labels(), 0.0);
    let of_square = |x: usize, y: usize| shown(&truth, &grains.labels(), &scored)[2 * (11 * y + x)];
    assert_eq!(
        (of_square(0, 0), of_square(3, 0), of_square(4, 2)),
        (Shown::Split, Shown::SplitFurther, Shown::GrainOnly)
    );
    assert_eq!((of_square(5, 0), of_square(8, 0)), (Shown::Split, Shown::SplitFurther));
    assert_eq!((of_square(0, 3), of_square(0, 5)), (Shown::Missed, Shown::Merged));
    assert_eq!(
        (of_square(3, 3), of_square(5, 3), of_square(9, 3)),
        (Shown::FoundStoneOnly, Shown::Found, Shown::GrainOnly)
    );
    assert_eq!((of_square(8, 5), of_square(10, 0), of_square(5, 5)), (Shown::False, Shown::Ground, Shown::Ignored));
}

#[test]
fn stated_confidence_is_held_against_the_share_that_is_right() {
    let grains = [(0.95, true), (0.97, true), (1.0, false), (0.31, false), (0.39, true), (0.0, false)];
    let found = Reliability::of(grains);
    assert_eq!(found.grains, 6);
    let bins: Vec<(f64, usize, f64)> = found.bins.iter().map(|b| (b.from, b.grains, b.share_right)).collect();
    assert_eq!(bins, [(0.0, 1, 0.0), (0.3, 2, 0.5), (0.9, 3, 2.0 / 3.0)]);
    assert!((found.bins[1].mean_confidence - 0.35).abs() < 1e-12);
    let expected = (2.0 * 0.15 + (2.92 - 2.0)) / 6.0;
    assert!((found.calibration_error - expected).abs() < 1e-12, "{}", found.calibration_error);
}
