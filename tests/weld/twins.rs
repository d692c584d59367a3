//! Vertices of different files at one place are one.

use crate::blocks::{cut, grid, joined, sound_bed, write_all};
use crate::support::bed::{Rng, SPACING_M};
use gravelometer::geometry::DVec3;
use gravelometer::open::{Frame, MemorySurface, Reach, Surface};
use gravelometer::settings::InputSettings;
use gravelometer::weld::{WeldError, weld_parts};
use proptest::prelude::*;
use std::collections::BTreeMap;

type Places = BTreeMap<[[u64; 3]; 3], usize>;

/// How often each triangle is there, by the places of its corners in their order.
fn by_place(surface: &dyn Surface) -> Places {
    let mut places = Places::new();
    for t in 0..surface.triangles() {
        *places.entry(surface.corners(t).map(|p| p.to_array().map(f64::to_bits))).or_default() += 1;
    }
    places
}

/// How many vertices the triangles use.
fn corners_used(surface: &dyn Surface) -> usize {
    let corners = (0..surface.triangles()).flat_map(|t| surface.triangle(t));
    corners.collect::<std::collections::BTreeSet<_>>().len()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn cutting_a_mesh_anyhow_and_welding_it_gives_the_same_triangles_and_the_same_vertices(
        seed in 0u64..1000, kind in 0usize..3, n in 2usize..5, m in 1usize..4,
    ) {
        let whole = sound_bed(seed, 40, 30);
        let mut rng = Rng(seed);
        let blocks = match kind {
            0 => grid(&whole, n, m, 0.0),
            1 => grid(&whole, n, m, 0.02),
            // Strips across, at random angles.
            _ => {
                let (turn, wide) = (rng.within(0.0, 6.3), rng.within(0.2, 0.5));
                cut(&whole, |p| ((p.x * turn.cos() + p.y * turn.sin() + 10.0) / wide) as usize)
            }
        };
        let (apart, parts) = joined(&blocks);
        let (welded, facts) = weld_parts(&apart, &parts, &Frame::metres(), 0.0, u64::MAX).unwrap();
        prop_assert_eq!(by_place(&welded), by_place(&whole));
        prop_assert_eq!(corners_used(&welded), whole.positions.len());
        prop_assert_eq!(facts.welded_vertices as usize, apart.positions.len() - whole.positions.len());
        prop_assert_eq!(facts.pairs.iter().map(|p| p.identical_triangles).sum::<u64>(), 0);
    }
}

#[test]
fn vertices_of_one_file_stay_apart_however_near_they_are() {
    let tolerance = 0.1 * SPACING_M;
    let triangles = |x: f64, y: f64| MemorySurface {
        positions: [(x, 0.0), (x + 1e-9, 0.0), (x, y), (x + 1.0, y)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(),
        triangles: vec![[0, 2, 3], [1, 3, 2]],
        colors: Vec::new(),
    };
    let (apart, parts) = joined(&[triangles(0.0, 1.0), triangles(4e-10, -1.0)]);
    let (welded, facts) = weld_parts(&apart, &parts, &Frame::metres(), tolerance, u64::MAX).unwrap();
    // The second file's lie between those of the first: each takes the nearest that is free.
    assert_eq!(welded.aliases(), [(4, 0), (5, 1)]);
    assert_eq!(facts.welded_vertices, 2);
}

#[test]
fn files_that_meet_in_a_corner_share_one_vertex_even_where_the_first_and_the_last_are_just_too_far_apart() {
    let at = |x: f64, y: f64, side: f64| MemorySurface {
        positions: vec![DVec3::new(x, y, 0.0), DVec3::new(x + side, y, 0.0), DVec3::new(x, y + side, 0.0)],
        triangles: vec![[0, 1, 2]],
        colors: Vec::new(),
    };
    let blocks = [at(0.0, 0.0, 1.0), at(8e-4, 0.0, -1.0), at(16e-4, 0.0, 2.0), at(0.0, 5e-4, -2.0)];
    let (apart, parts) = joined(&blocks);
    let (welded, _) = weld_parts(&apart, &parts, &Frame::metres(), 1e-3, u64::MAX).unwrap();
    assert_eq!(welded.aliases(), [(3, 0), (6, 0), (9, 0)]);
    assert_eq!(welded.triangle(3), [0, 10, 11]);
}

#[test]
fn a_single_file_costs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let paths = write_all(folder.path(), &[sound_bed(1, 20, 20)]);
    let (reach, _) = Reach::open(&paths, &InputSettings::default(), &|_, _| {}).unwrap();
    let (welded, facts) = gravelometer::weld::weld(&reach, 0.0, 0).unwrap();
    assert_eq!((welded.bytes(), facts), (0, None));
}

#[test]
fn too_little_memory_is_refused_with_what_is_needed() {
    let (apart, parts) = joined(&grid(&sound_bed(3, 40, 30), 2, 2, 0.0));
    let refused = weld_parts(&apart, &parts, &Frame::metres(), 0.0, 1 << 10).err().unwrap();
    let WeldError::Memory { needed, .. } = refused else { panic!("{refused}") };
    assert!(weld_parts(&apart, &parts, &Frame::metres(), 0.0, needed).is_ok());
}
