//! What is refused, and what is said, of the borders between files.

use crate::blocks::{bounds, cut, grid, judged, moved, otira, overlapping, sound_bed};
use crate::support::bed::SPACING_M;
use gravelometer::geometry::DVec3;
use gravelometer::open::{MemorySurface, Surface};
use gravelometer::weld::WeldError;

#[test]
fn ground_that_is_in_two_files_is_refused_with_both_names_and_the_area() {
    let bed = sound_bed(5, 100, 80);
    for blocks in [[bed.clone(), bed.clone()], overlapping(&bed, 0.2), [bed.clone(), moved(&bed, DVec3::splat(0.007))]]
    {
        let refused = judged(&blocks).unwrap_err();
        assert!(matches!(&refused, WeldError::Overlap { .. }), "{refused}");
        let text = refused.to_string();
        assert!(text.contains("block0.ply and block1.ply") && text.contains("m²") && text.contains("help:"), "{text}");
    }
    let blocks = overlapping(&bed, 0.4);
    let WeldError::Overlap { area_m2, place, .. } = judged(&blocks).unwrap_err() else { panic!() };
    let area = |surface: &MemorySurface| -> f64 {
        let corners = (0..surface.triangles()).map(|t| surface.corners(t));
        corners.map(|[a, b, c]| (b - a).cross(c - a).z / 2.0).sum()
    };
    let twice_m2 = area(&blocks[0]) + area(&blocks[1]) - area(&bed);
    assert!((0.7..1.1).contains(&(area_m2 / twice_m2)), "{area_m2} of {twice_m2}");
    let (min, max) = bounds(&bed);
    let middle = (min.x + max.x) / 2.0;
    assert!((middle - place.min[0] - 0.2).abs() < 0.17 && (place.max[0] - middle - 0.2).abs() < 0.17, "{place:?}");
}

#[test]
fn a_strip_that_is_one_triangle_wide_may_be_in_two_files() {
    let warnings = judged(&overlapping(&sound_bed(5, 100, 80), 1.2 * SPACING_M)).unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("triangles are in both"), "{warnings:?}");
}

#[test]
fn a_reach_that_winds_may_come_into_the_boxes_of_others() {
    let bed = sound_bed(7, 120, 120);
    // Three hooks around each other, whose boxes all contain the middle.
    let hook = |p: DVec3| {
        let (x, y) = (p.x - 1.2, p.y - 1.2);
        ((y.atan2(x) + 7.0 * x.hypot(y)).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU * 3.0) as usize
    };
    assert_eq!(judged(&cut(&bed, hook)).unwrap(), Vec::<String>::new());
}

#[test]
fn files_that_should_touch_and_do_not_are_named() {
    let bed = sound_bed(8, 100, 80);
    let [left, right] = overlapping(&bed, 0.0);
    let gap = judged(&[left.clone(), moved(&right, DVec3::X * 0.15)]).unwrap();
    assert!(gap.iter().any(|w| w.contains("block1.ply: touches no other file; block0.ply is 0.1")), "{gap:?}");
    let slip = judged(&[left.clone(), moved(&right, DVec3::new(0.0, 0.007, 0.0))]).unwrap();
    assert!(slip.iter().any(|w| w.contains("lie side by side") && w.contains("counts twice")), "{slip:?}");
    let far = judged(&[left, moved(&right, DVec3::X * 50.0)]).unwrap();
    assert_eq!(far, Vec::<String>::new());
}

#[test]
fn a_bank_that_hangs_over_the_bed_is_no_overlap_but_is_said() {
    let bed = sound_bed(9, 100, 80);
    let warnings = judged(&[bed.clone(), moved(&bed, DVec3::Z * 3.0)]).unwrap();
    assert!(warnings.iter().any(|w| w.contains("one lies above the other")), "{warnings:?}");
}

#[test]
fn ragged_borders_are_no_overlap_and_a_tenth_of_the_otira_twice_is() {
    let Some((_, surface)) = otira() else { return };
    assert_eq!(judged(&grid(&surface, 2, 3, 0.05)).unwrap(), Vec::<String>::new());
    let board = |p: DVec3| (((p.x / 0.5).floor() + (p.y / 0.5).floor()) as i64).rem_euclid(2) as usize;
    assert_eq!(judged(&cut(&surface, board)).unwrap(), Vec::<String>::new());
    let (min, max) = bounds(&surface);
    let refused = judged(&overlapping(&surface, 0.1 * (max.x - min.x))).unwrap_err();
    assert!(matches!(refused, WeldError::Overlap { .. }), "{refused}");
    assert!(judged(&overlapping(&surface, 1.5 * SPACING_M)).is_ok());
}
