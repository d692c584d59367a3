//! Several files are one surface: blocks that were cut from a mesh give what the whole mesh gives, byte for byte.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use gravelometer::error::Error;
use gravelometer::geometry::DVec3;
use gravelometer::inspect::inspect;
use gravelometer::open::{Frame, MemorySurface, Reach, Surface};
use gravelometer::pipeline::Control;
use gravelometer::progress::Silent;
use gravelometer::run::{Job, run};
use gravelometer::settings::{InputSettings, Settings};
use gravelometer::weld::{Part, WeldError, weld_parts};
use proptest::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use support::bed::{Rng, SPACING_M, bed, ply, write_ply};

/// Some of a surface's triangles, with the vertices that they use, numbered in the order in which they come up.
fn block(surface: &MemorySurface, triangles: impl Iterator<Item = usize>) -> MemorySurface {
    let mut numbers = HashMap::new();
    let mut block = MemorySurface::default();
    for t in triangles {
        let corners = surface.triangles[t].map(|v| {
            *numbers.entry(v).or_insert_with(|| {
                block.positions.push(surface.positions[v as usize]);
                block.colors.extend(surface.colors.get(v as usize));
                block.positions.len() as u64 - 1
            })
        });
        block.triangles.push(corners);
    }
    block
}

fn centroid(surface: &MemorySurface, triangle: usize) -> DVec3 {
    surface.corners(triangle as u64).iter().sum::<DVec3>() / 3.0
}

/// Blocks of a surface by what `of` says of each triangle's centroid; those without triangles are left out.
fn cut(surface: &MemorySurface, of: impl Fn(DVec3) -> usize) -> Vec<MemorySurface> {
    let mut blocks: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for t in 0..surface.triangles.len() {
        blocks.entry(of(centroid(surface, t))).or_default().push(t);
    }
    blocks.into_values().map(|triangles| block(surface, triangles.into_iter())).collect()
}

fn bounds(surface: &MemorySurface) -> (DVec3, DVec3) {
    let grow = |(min, max): (DVec3, DVec3), p: &DVec3| (min.min(*p), max.max(*p));
    surface.positions.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), grow)
}

/// Blocks of `columns` by `rows`, whose borders wander by `ragged` metres.
fn grid(surface: &MemorySurface, columns: usize, rows: usize, ragged: f64) -> Vec<MemorySurface> {
    let (min, max) = bounds(surface);
    let along = |value: f64, axis: usize, n: usize| {
        let share = (value - min[axis]) / (max[axis] - min[axis]);
        ((share * n as f64).floor().max(0.0) as usize).min(n - 1)
    };
    cut(surface, |p| {
        let wander = ragged * ((p.x * 23.0).sin() + (p.y * 31.0).sin() + (p.x * 210.0 + p.y * 170.0).sin());
        along(p.y + wander, 1, rows) * columns + along(p.x + wander, 0, columns)
    })
}

fn write_all(folder: &Path, blocks: &[MemorySurface]) -> Vec<PathBuf> {
    let write = |(i, block): (usize, &MemorySurface)| {
        let path = folder.join(format!("block{i}.ply"));
        write_ply(&path, block);
        path
    };
    blocks.iter().enumerate().map(write).collect()
}

fn job(inputs: Vec<PathBuf>, out: PathBuf, settings: Settings) -> Job {
    Job { inputs, out, settings, force: false, resume: false, work: None }
}

fn catalogue(inputs: Vec<PathBuf>, out: PathBuf, settings: &Settings) -> Vec<u8> {
    let done = run(&job(inputs, out.clone(), settings.clone()), &Silent, &Control::default()).unwrap();
    assert!(done.lost.is_empty());
    std::fs::read(out.join("grains.csv")).unwrap()
}

fn report(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap()
}

fn bed_settings() -> Settings {
    let mut settings = Settings::default();
    settings.segment.max_grain_m = 1.0;
    settings.segment.min_grain_area_m2 = 0.004;
    settings.raster.cell_m = 0.5;
    settings
}

/// A bed without the vertices that lie at one place on purpose: which of them is which cannot be told across a border.
fn sound_bed(seed: u64, columns: usize, rows: usize) -> MemorySurface {
    let mut bed = bed(seed, columns, rows);
    let mut first = HashMap::new();
    for triangle in &mut bed.triangles {
        for v in triangle {
            let place = bed.positions[*v as usize].to_array().map(f64::to_bits);
            *v = *first.entry(place).or_insert(*v);
        }
    }
    block(&bed, 0..bed.triangles.len())
}

/// Blocks one after the other as one surface, and what the weld needs to know of them.
fn joined(blocks: &[MemorySurface]) -> (MemorySurface, Vec<Part>) {
    let (mut all, mut parts) = (MemorySurface::default(), Vec::new());
    for (i, block) in blocks.iter().enumerate() {
        let (vertex, triangle) = (all.vertices(), all.triangles());
        all.positions.extend(&block.positions);
        all.colors.extend(&block.colors);
        all.triangles.extend(block.triangles.iter().map(|t| t.map(|v| v + vertex)));
        let (min, max) = bounds(block);
        let (vertices, triangles) = (vertex..all.vertices(), triangle..all.triangles());
        let name = format!("block{i}.ply");
        parts.push(Part { name, vertices, triangles, min, max, edge_m: Some(SPACING_M), step_m: 1e-15 });
    }
    (all, parts)
}

type Places = BTreeMap<[[u64; 3]; 3], usize>;

/// How often each triangle is there, by the places of its corners in their order.
fn by_place(surface: &dyn Surface) -> Places {
    let mut places = Places::new();
    for t in 0..surface.triangles() {
        *places.entry(surface.corners(t).map(|p| p.to_array().map(f64::to_bits))).or_default() += 1;
    }
    places
}

/// Edges between two places, and of how many vertices' pairs they are.
fn corners_used(surface: &dyn Surface) -> usize {
    let corners = (0..surface.triangles()).flat_map(|t| surface.triangle(t));
    corners.collect::<std::collections::BTreeSet<_>>().len()
}

const METRES: fn() -> Frame = Frame::metres;

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
        let (welded, facts) = weld_parts(&apart, &parts, &METRES(), 0.0, u64::MAX).unwrap();
        prop_assert_eq!(by_place(&welded), by_place(&whole));
        prop_assert_eq!(corners_used(&welded), whole.positions.len());
        prop_assert_eq!(facts.welded_vertices as usize, apart.positions.len() - whole.positions.len());
        prop_assert_eq!(facts.pairs.iter().map(|p| p.identical_triangles).sum::<u64>(), 0);
    }
}

#[test]
fn vertices_of_one_file_stay_apart_however_near_they_are() {
    let tolerance = 0.1 * SPACING_M;
    let triangle = |x: f64| MemorySurface {
        positions: [(x, 0.0), (x + 1e-9, 0.0), (x, 1.0), (x + 1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(),
        triangles: vec![[0, 2, 3], [1, 3, 2]],
        colors: Vec::new(),
    };
    let (apart, parts) = joined(&[triangle(0.0), triangle(4e-10)]);
    let (welded, facts) = weld_parts(&apart, &parts, &METRES(), tolerance, u64::MAX).unwrap();
    // The second file's lie between those of the first: each takes the nearest that is free.
    assert_eq!(welded.aliases(), [(4, 0), (5, 1), (6, 2), (7, 3)]);
    assert_eq!(facts.welded_vertices, 4);
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
    let (welded, _) = weld_parts(&apart, &parts, &METRES(), 1e-3, u64::MAX).unwrap();
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
    let refused = weld_parts(&apart, &parts, &METRES(), 0.0, 1 << 10).err().unwrap();
    let WeldError::Memory { needed, .. } = refused else { panic!("{refused}") };
    assert!(weld_parts(&apart, &parts, &METRES(), 0.0, needed).is_ok());
}

#[test]
fn blocks_of_a_bed_give_the_catalogue_of_the_whole_bed_in_whatever_order_they_come() {
    let folder = tempfile::tempdir().unwrap();
    let whole = sound_bed(4, 150, 110);
    let out = |name: &str| folder.path().join(name);
    let mut settings = bed_settings();
    let wanted = catalogue(write_all(&out(""), &[whole.clone()]), out("whole"), &settings);
    assert!(wanted.iter().filter(|&&b| b == b'\n').count() > 20);
    let mut paths = write_all(&out(""), &grid(&whole, 3, 2, 0.03));
    for (i, tile_size_m) in [0.0, 0.7].into_iter().enumerate() {
        settings.work.tile_size_m = tile_size_m;
        assert!(catalogue(paths.clone(), out(&format!("blocks{i}")), &settings) == wanted, "blocks change grains");
        paths.reverse();
        paths.swap(0, 3);
    }
    let facts = &report(&out("blocks0"))["facts"];
    assert!(facts["weld"]["welded_vertices"].as_u64().unwrap() > 300, "{facts}");
    assert!(facts["weld"]["tolerance_m"].as_f64().unwrap() > 0.0);
    assert_eq!(facts["warnings"].as_array().unwrap().len(), 0, "{facts}");
    assert!(report(&out("whole"))["facts"]["weld"].is_null());
}

#[test]
fn the_labelled_mesh_of_blocks_has_the_grain_of_every_face_in_the_order_of_the_files() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let mut settings = bed_settings();
    settings.output.labelled_mesh = true;
    let blocks = grid(&sound_bed(6, 90, 70), 2, 2, 0.0);
    // The whole mesh with its triangles in the order of the blocks.
    let mut whole = joined(&blocks).0;
    let mut first = HashMap::new();
    for v in whole.triangles.iter_mut().flatten() {
        *v = *first.entry(whole.positions[*v as usize].to_array().map(f64::to_bits)).or_insert(*v);
    }
    let wanted = catalogue(write_all(&out(""), &[whole.clone()]), out("whole"), &settings);
    assert!(catalogue(write_all(&out(""), &blocks), out("blocks"), &settings) == wanted);
    let labels = |name: &str, vertices: usize| -> Vec<i32> {
        let bytes = std::fs::read(out(name).join("labelled_mesh.ply")).unwrap();
        let header = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        // Three doubles, a colour and a number for each vertex; a list of three, a number and a colour for each face.
        let faces = &bytes[header + vertices * (24 + 3 + 4)..];
        faces.chunks_exact(13 + 4 + 3).map(|face| i32::from_le_bytes(face[13..17].try_into().unwrap())).collect()
    };
    let of_whole = labels("whole", whole.positions.len());
    assert_eq!(of_whole.len(), whole.triangles.len());
    assert!(of_whole.iter().filter(|&&label| label >= 0).count() > 1000);
    assert!(labels("blocks", whole.positions.len()) == of_whole);
}

#[test]
fn an_index_is_used_again_with_what_is_known_of_its_weld_and_never_with_another_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let paths = write_all(&out(""), &grid(&sound_bed(2, 60, 50), 2, 1, 0.0));
    let stages = |name: &str, weld_m: f64| -> Vec<String> {
        let mut settings = bed_settings();
        settings.input.weld_m = weld_m;
        let job = Job { work: Some(out("work")), ..job(paths.clone(), out(name), settings) };
        run(&job, &Silent, &Control::default()).unwrap().costs.stages.iter().map(|s| s.name.to_owned()).collect()
    };
    let made = |stages: &[String]| ["weld", "index"].map(|name| stages.iter().any(|s| s == name));
    assert_eq!(made(&stages("first", 0.0)), [true, true]);
    assert_eq!(made(&stages("second", 0.0)), [false, false]);
    let weld = |name: &str| report(&out(name))["facts"]["weld"].clone();
    assert!(weld("first")["welded_vertices"].as_u64().unwrap() > 50);
    assert_eq!(weld("first"), weld("second"));
    assert_eq!(made(&stages("third", 1e-4)), [true, true]);
    assert_eq!(weld("third")["tolerance_m"], 1e-4);
}

/// What a survey of these blocks is refused or warned with.
fn judged(blocks: &[MemorySurface]) -> Result<Vec<String>, WeldError> {
    let (apart, parts) = joined(blocks);
    let (_, facts) = weld_parts(&apart, &parts, &METRES(), 0.0, u64::MAX)?;
    Ok(gravelometer::weld::warnings(&facts, &parts).iter().map(ToString::to_string).collect())
}

fn moved(surface: &MemorySurface, by: DVec3) -> MemorySurface {
    let positions = surface.positions.iter().map(|&p| p + by).collect();
    MemorySurface { positions, ..surface.clone() }
}

/// Two blocks of a surface that overlap by so many metres in the middle.
fn overlapping(surface: &MemorySurface, by: f64) -> [MemorySurface; 2] {
    let (min, max) = bounds(surface);
    let middle = (min.x + max.x) / 2.0;
    let part = |wanted: &dyn Fn(f64) -> bool| {
        let inside = (0..surface.triangles.len()).filter(|&t| wanted(centroid(surface, t).x));
        block(surface, inside)
    };
    [part(&|x| x < middle + by / 2.0), part(&|x| x >= middle - by / 2.0)]
}

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
    let WeldError::Overlap { area_m2, place, .. } = judged(&overlapping(&bed, 0.4)).unwrap_err() else { panic!() };
    assert!((0.4..0.8).contains(&area_m2), "0.4 m of 1.6 m, less holes: {area_m2}");
    assert!(place.min[0] < 1.3 && place.max[0] > 1.1 && place.width_m() < 2.0, "{place:?}");
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
    assert_eq!(judged(&cut(&bed, hook)).unwrap(), [String::new(); 0]);
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
    assert_eq!(far, [String::new(); 0]);
}

#[test]
fn a_bank_that_hangs_over_the_bed_is_no_overlap_but_is_said() {
    let bed = sound_bed(9, 100, 80);
    let warnings = judged(&[bed.clone(), moved(&bed, DVec3::Z * 3.0)]).unwrap();
    assert!(warnings.iter().any(|w| w.contains("one lies above the other")), "{warnings:?}");
}

#[test]
fn a_run_on_overlapping_files_fails_before_anything_is_written_and_an_inspection_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let bed = sound_bed(5, 60, 50);
    let paths = write_all(folder.path(), &[bed.clone(), bed]);
    let out = folder.path().join("out");
    let refused = run(&job(paths.clone(), out.clone(), bed_settings()), &Silent, &Control::default()).unwrap_err();
    assert!(matches!(refused, Error::Weld(WeldError::Overlap { .. })), "{refused}");
    assert!(!out.join("grains.csv").exists());
    let inspection = inspect(&paths, &InputSettings::default()).unwrap();
    assert!(inspection.warnings.iter().any(|w| w.contains("a run would be refused")), "{inspection}");
    assert_eq!(inspection.weld, None);
}

#[test]
fn an_inspection_says_how_many_vertices_are_welded() {
    let folder = tempfile::tempdir().unwrap();
    let paths = write_all(folder.path(), &grid(&sound_bed(2, 60, 50), 2, 2, 0.0));
    let inspection = inspect(&paths, &InputSettings::default()).unwrap();
    assert!(inspection.weld.as_ref().is_some_and(|weld| weld.welded_vertices > 100), "{inspection}");
    assert!(inspection.to_string().contains("vertices welded between 4 files"), "{inspection}");
}

/// The Otira mesh, whose vertices are three doubles and a normal.
fn otira() -> Option<(PathBuf, MemorySurface)> {
    let path = support::data("otira/otira_poisson.ply")?;
    let (reach, _) = Reach::open(std::slice::from_ref(&path), &InputSettings::default(), &|_, _| {}).unwrap();
    let file = &reach.files()[0];
    let double = |record: &[u8], i: usize| f64::from_le_bytes(record[8 * i..8 * i + 8].try_into().unwrap());
    let position = |v: u64| DVec3::from_array([0, 1, 2].map(|i| double(file.vertex_record(v), i)));
    let surface = MemorySurface {
        positions: (0..reach.vertices()).map(position).collect(),
        triangles: (0..reach.triangles()).map(|t| reach.triangle(t)).collect(),
        colors: Vec::new(),
    };
    Some((path, surface))
}

fn otira_settings(preset: &str) -> Settings {
    Settings::load(Some(Path::new(preset)), &["segment.min_grain_area_m2=5e-3".to_owned()]).unwrap()
}

#[test]
fn six_blocks_of_the_otira_give_the_catalogue_of_the_whole_byte_for_byte() {
    let Some((path, surface)) = otira() else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let mut paths = write_all(folder.path(), &grid(&surface, 2, 3, 0.0));
    for (i, preset) in ["rheinwalt2025", "default"].into_iter().enumerate() {
        let mut settings = otira_settings(preset);
        let wanted = catalogue(vec![path.clone()], out(&format!("whole{i}")), &settings);
        settings.work.tile_size_m = [2.5, 0.0][i];
        let blocks = out(&format!("blocks{i}"));
        assert!(catalogue(paths.clone(), blocks.clone(), &settings) == wanted, "{preset}: blocks change grains");
        assert_eq!(report(&blocks)["facts"]["warnings"].as_array().unwrap().len(), 0);
        paths.rotate_left(2);
        paths.swap(1, 4);
    }
}

#[test]
fn ragged_borders_are_no_overlap_and_a_tenth_of_the_otira_twice_is() {
    let Some((_, surface)) = otira() else { return };
    assert_eq!(judged(&grid(&surface, 2, 3, 0.05)).unwrap(), [String::new(); 0]);
    let (min, max) = bounds(&surface);
    let refused = judged(&overlapping(&surface, 0.1 * (max.x - min.x))).unwrap_err();
    assert!(matches!(refused, WeldError::Overlap { .. }), "{refused}");
    assert!(judged(&overlapping(&surface, 1.5 * SPACING_M)).is_ok());
}

#[test]
fn blocks_that_are_rounded_differently_give_the_same_grains() {
    let Some((_, surface)) = otira() else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let [left, right] = overlapping(&surface, 0.0);
    let paths = write_all(folder.path(), &[left, right.clone()]);
    let doubles = catalogue(paths.clone(), out("doubles"), &otira_settings("rheinwalt2025"));
    // The right half in 32 bits.
    let text = String::from_utf8_lossy(&ply(&right)[..200]).replace("double", "float");
    let mut bytes = text[..text.find("end_header\n").unwrap() + 11].as_bytes().to_vec();
    let coordinates = right.positions.iter().flat_map(|p| p.to_array());
    coordinates.for_each(|v| bytes.extend((v as f32).to_le_bytes()));
    for t in &right.triangles {
        bytes.push(3);
        t.iter().for_each(|&v| bytes.extend((v as u32).to_le_bytes()));
    }
    std::fs::write(&paths[1], bytes).unwrap();
    let floats = catalogue(paths, out("floats"), &otira_settings("rheinwalt2025"));
    assert!(doubles != floats, "nothing was rounded");
    one_to_one(&doubles, &floats);
}

/// Every grain of one catalogue is one of the other, at the same place and of the same size but for rounding.
fn one_to_one(a: &[u8], b: &[u8]) {
    let grains = |bytes: &[u8]| -> Vec<[f64; 3]> {
        let mut reader = csv::Reader::from_reader(bytes);
        let header = reader.headers().unwrap().clone();
        let columns = ["centroid_x", "centroid_y", "b_axis_m"].map(|n| header.iter().position(|h| h == n).unwrap());
        reader.records().map(|r| columns.map(|c| r.as_ref().unwrap()[c].parse().unwrap())).collect()
    };
    let (a, b) = (grains(a), grains(b));
    assert_eq!(a.len(), b.len());
    let mut taken = vec![false; b.len()];
    for grain in &a {
        let distance = |other: &[f64; 3]| (0..3).map(|i| (grain[i] - other[i]).abs()).fold(0.0, f64::max);
        let nearest = (0..b.len()).min_by(|&i, &j| distance(&b[i]).total_cmp(&distance(&b[j]))).unwrap();
        assert!(distance(&b[nearest]) < 1e-3, "{grain:?} became {:?}", b[nearest]);
        assert!(!std::mem::replace(&mut taken[nearest], true), "{grain:?}");
    }
}
