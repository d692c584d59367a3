//! The promise of the program for the method `valleys`: a grain is the same, bit for bit, whatever the tiles, the threads
//! and the memory. As `certainty.rs` does for the published method.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use gravelometer::geometry::DVec3;
use gravelometer::index::{BuildRoom, CellBlock, Index};
use gravelometer::open::MemorySurface;
use gravelometer::passes::{Recipe, Telling};
use gravelometer::segment::valleys::segment_along_valleys;
use gravelometer::settings::{SegmentSettings, ValleySettings};
use gravelometer::stitch::{Catalogue, TileReport};
use gravelometer::tile::{CoreSize, Owned, Plan, TileMesh};
use support::bed::{Rng, bed, shuffled};
use support::tiled::{self, ONE_TILE, Tiling, WANTED, assert_same};

type How = (&'static str, SegmentSettings, ValleySettings);

fn how(name: &'static str, change: impl FnOnce(&mut SegmentSettings, &mut ValleySettings)) -> How {
    let mut segment = SegmentSettings {
        max_grain_m: 1.05,
        min_grain_area_m2: 0.004,
        min_grain_triangles: 12.0,
        ..SegmentSettings::default()
    };
    // The edges of this bed are a tenth of a stone, so that the default reaches would span most of it.
    let mut valleys = ValleySettings {
        normal_passes: 2,
        growth_edges: 4.0,
        refill_edges: 2.5,
        join_reach_edges: 6.0,
        sand_delay_edges: 1.5,
        valley_depth: 0.03,
        second_depth: 0.15,
        second_passes: 3,
        second_seed_triangles: 2.0,
        bridge_edges: 0.5,
        seed_share: 2.0,
        ..ValleySettings::default()
    };
    change(&mut segment, &mut valleys);
    (name, segment, valleys)
}

fn all_hows() -> Vec<How> {
    vec![
        how("shorter reaches", |_, _| {}),
        how("default reaches", |_, v| *v = ValleySettings::default()),
        how("nothing smoothed, no bridges cut", |_, v| (v.normal_passes, v.bridge_edges) = (0, 0.0)),
        how("many joins", |_, v| (v.join_rise, v.join_swallowed) = (0.3, 2.0)),
        how("no joins, no growth", |_, v| (v.join_reach, v.growth_edges) = (0.0, 0.0)),
        how("everything is a stone", |_, v| v.stone_score = -10.0),
        how("most is sand", |_, v| v.stone_score = 1.4),
        how("sand starts very late", |s, v| {
            (v.sand_delay_edges, v.growth_edges, v.join_reach, v.join_rise) = (8.0, 10.0, 0.6, 0.3);
            (s.min_grain_triangles, v.stone_score) = (12.0, 1.1);
        }),
        how("sand never starts, nothing smoothed", |_, v| {
            (v.sand_delay_edges, v.growth_edges, v.normal_passes, v.stone_score) = (9.0, 3.0, 0, 1.0);
        }),
        how("narrow grains", |s, _| s.max_grain_m = 0.3),
        how("no limit", |s, _| s.max_grain_m = 0.0),
        how("no second look", |_, v| v.second_passes = 0),
        how("the second look finds most", |_, v| {
            (v.seed_share, v.second_seed_share, v.growth_edges, v.second_depth) = (1.0, 0.05, 2.0, 0.3);
            v.stone_score = -10.0;
        }),
        how("tiny seeds, plain smoothing", |s, v| {
            (s.min_grain_area_m2, v.seed_share, v.crease, v.valley_depth) = (0.002, 0.1, 10.0, 0.03);
        }),
    ]
}

fn catalogue(index: &Index, (_, settings, valleys): &How, tiling: Tiling) -> (Catalogue, Vec<TileReport>) {
    let recipe = Recipe { settings, method: Telling::Valleys(valleys), wanted: WANTED, usual_width_m: None };
    tiled::catalogue(index, &recipe, tiling)
}

fn indexed(surface: &MemorySurface, tiling: Tiling) -> Index {
    let room = BuildRoom { bytes: tiling.memory_bytes, wide: tiling.threads > 1 };
    tiled::crew(tiling).pool.install(|| support::indexed_with(surface, room))
}

#[test]
fn every_setting_gives_the_same_catalogue_bit_for_bit_whatever_the_tiles_threads_and_memory() {
    let mut rng = Rng(17);
    let (mut grains, mut joined, mut attempts, mut tiles, mut wide) = (0, 0, 0, 0, 0);
    for (surface, random_tilings) in [(shuffled(&bed(1, 150, 120), 5), 3), (bed(2, 130, 100), 1)] {
        let reference = indexed(&surface, ONE_TILE);
        let expected: Vec<Catalogue> = all_hows().iter().map(|how| catalogue(&reference, how, ONE_TILE).0).collect();
        let grains_of = |name: &str| {
            let place = all_hows().iter().position(|how| how.0 == name).unwrap();
            expected[place].grains.len()
        };
        let looks = ["no second look", "shorter reaches", "the second look finds most"].map(grains_of);
        println!("{looks:?} grains without the second look, with it, and mostly from it");
        assert!(looks[0] < looks[1] && 2 * looks[0] < looks[2], "{looks:?}");
        let mut tilings = vec![Tiling { tile_size_m: 0.25, threads: 3, memory_bytes: 1 }];
        for i in 0..random_tilings {
            let (threads, memory_bytes) = [(1, 1 << 30), (3, 1)][i % 2];
            tilings.push(Tiling { tile_size_m: rng.within(0.5, 1.6), threads, memory_bytes });
        }
        for (k, &tiling) in tilings.iter().enumerate() {
            let index = indexed(&surface, tiling);
            let core_m = Plan::new(&index, CoreSize::square(&index, tiling.tile_size_m)).core_m(&index)[0];
            for (r, how) in all_hows().iter().enumerate() {
                // The finest tiling is dear, most so without a limit: it takes every third setting.
                if k == 0 && (how.1.max_grain_m == 0.0 || (r + random_tilings) % 3 != 0) {
                    continue;
                }
                let (found, reports) = catalogue(&index, how, tiling);
                assert_same(&expected[r], &found, &format!("{}, {tiling:?}, {} tiles", how.0, reports.len()));
                grains += found.grains.len();
                attempts = attempts.max(reports.iter().map(|t| t.attempts).max().unwrap());
                tiles = tiles.max(reports.len());
                let pieces = |g: &&gravelometer::stitch::NumberedGrain| g.grain.outline.len() > 1;
                joined += found.grains.iter().filter(pieces).count();
                wide += found.grains.iter().filter(|g| g.grain.axes_m[0] > core_m).count();
            }
        }
    }
    println!("{grains} grains, {joined} in pieces, {wide} wider than a core; {attempts} attempts, {tiles} tiles");
    assert!(grains > 1000 && joined > 20 && wide > 10, "{grains} grains, {joined} in pieces, {wide} wide");
    assert!(attempts > 1 && tiles > 60, "{attempts} attempts, {tiles} tiles");
}

/// Three domes of a metre side by side, the middle one so rough that most of it counts as valley.
fn domes(rough: bool) -> MemorySurface {
    let n = 140;
    let mut surface = MemorySurface::default();
    let mut rng = Rng(3);
    for j in 0..=n {
        for i in 0..=n {
            let mut place = |k: usize| (k as f64 + rng.within(-0.2, 0.2)) / n as f64 - 0.5;
            let (x, y) = (place(i), place(j));
            let from = [-0.33, 0.0, 0.33].map(|centre| (x - centre).powi(2) + y * y);
            let top = -2.0 * from[0].min(from[1]).min(from[2]);
            let waves = [[1.0, 0.0], [0.5, 0.866], [0.5, -0.866]].map(|[u, v]| (200.0 * (u * x + v * y)).sin());
            let rise = 0.004 * (waves.iter().sum::<f64>() + rng.within(-1.0, 1.0));
            let is_rough = rough && from[1] < from[0].min(from[2]);
            surface.positions.push(DVec3::new(x, y, top + if is_rough { rise } else { 0.0 }));
        }
    }
    surface.triangles = grid(n);
    surface
}

/// Two triangles for each square of so many on each side, vertices row by row.
fn grid(n: usize) -> Vec<[u64; 3]> {
    let at = |i: usize, j: usize| (j * (n + 1) + i) as u64;
    let of_square = |(i, j): (usize, usize)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).flat_map(of_square).collect()
}

#[test]
fn the_second_look_finds_a_rough_dome_between_two_smooth_ones_and_changes_nothing_where_all_are_smooth() {
    let found = |surface: &MemorySurface, second_passes: u32| {
        let segment = SegmentSettings { min_grain_area_m2: 0.02, ..SegmentSettings::default() };
        let how = ("domes", segment, ValleySettings { second_passes, ..ValleySettings::default() });
        catalogue(&indexed(surface, ONE_TILE), &how, ONE_TILE).0
    };
    let wide = |catalogue: &Catalogue| catalogue.grains.iter().filter(|g| g.grain.surface_area_m2 > 0.2).count();
    let (rough, smooth) = (domes(true), domes(false));
    assert_eq!([0, 12].map(|passes| wide(&found(&rough, passes))), [2, 3]);
    let [without, with] = [0, 12].map(|passes| found(&smooth, passes));
    assert_eq!(wide(&with), 3);
    assert_same(&without, &with, "smooth domes");
}

/// A level sheet that is furrowed from one side: the furrows are valleys, and what they leave bends downward everywhere.
fn furrowed() -> MemorySurface {
    let n = 140;
    let mut surface = MemorySurface::default();
    for j in 0..=n {
        for i in 0..=n {
            let across = (i % 14) as f64 - 7.0;
            let along = ((j as f64 - 15.0) / 15.0).clamp(0.0, 1.0);
            surface.positions.push(DVec3::new(i as f64, j as f64, -0.02 * along * across * across) / n as f64);
        }
    }
    surface.triangles = grid(n);
    surface
}

#[test]
fn a_level_sheet_is_no_stone_though_what_its_furrows_leave_bends_downward_everywhere() {
    let segment = SegmentSettings { min_grain_area_m2: 0.02, ..SegmentSettings::default() };
    let how = ("sheet", segment, ValleySettings::default());
    let wide = |surface: &MemorySurface| {
        let found = catalogue(&indexed(surface, ONE_TILE), &how, ONE_TILE).0;
        found.grains.iter().filter(|g| g.grain.surface_area_m2 > 0.2).count()
    };
    assert_eq!([wide(&furrowed()), wide(&domes(false))], [0, 3]);
}

/// A dome of a metre whose eastern third lies lower, behind a ledge that gets lower towards the north and ends at some y.
fn ledged(ledge: f64, end: f64) -> MemorySurface {
    let n = 140;
    let mut surface = MemorySurface::default();
    for j in 0..=n {
        for i in 0..=n {
            let [x, y] = [i, j].map(|k| k as f64 / n as f64 - 0.5);
            let high = ((end - y) / 0.3).clamp(0.0, 1.0);
            let below = ((x - 0.17) / 0.02).clamp(0.0, 1.0);
            surface.positions.push(DVec3::new(x, y, -2.0 * (x * x + y * y) - ledge * high * below));
        }
    }
    surface.triangles = grid(n);
    surface
}

#[test]
fn a_dome_with_a_ledge_that_runs_out_on_its_face_is_one_stone_and_with_a_high_one_all_across_it_two() {
    let segment = SegmentSettings { min_grain_area_m2: 0.02, ..SegmentSettings::default() };
    // Bridges are cut that are wider than usual, so that the ledge parts what it does not reach.
    let wide = |ledge: f64, end: f64, join_reach: f64| {
        let how = (
            "ledge",
            segment.clone(),
            ValleySettings { join_reach, bridge_edges: 5.0, refill_edges: 12.0, ..ValleySettings::default() },
        );
        let found = catalogue(&indexed(&ledged(ledge, end), ONE_TILE), &how, ONE_TILE).0;
        found.grains.iter().filter(|g| g.grain.surface_area_m2 > 0.1).count()
    };
    let joined = ValleySettings::default().join_reach;
    assert_eq!([0.25, 0.3].map(|end| [wide(0.14, end, 0.0), wide(0.14, end, joined)]), [[2, 1]; 2]);
    assert_eq!(wide(0.3, 1.0, joined), 2);
}

/// A coarse dome that is torn along its middle: each side has vertices of its own at the same places.
fn torn() -> MemorySurface {
    let n = 16;
    let mut surface = MemorySurface { triangles: grid(n), ..MemorySurface::default() };
    for j in 0..=n {
        for i in 0..=n {
            let [x, y] = [i, j].map(|k| k as f64 / n as f64 - 0.5);
            surface.positions.push(DVec3::new(x, y, -1.2 * (x * x + y * y)));
        }
    }
    let vertices = surface.positions.len() as u64;
    surface.positions.extend_from_within(..);
    let east = |t: &[u64; 3]| t.iter().all(|v| v % (n as u64 + 1) >= n as u64 / 2);
    surface.triangles.iter_mut().filter(|t| east(t)).for_each(|t| *t = t.map(|v| v + vertices));
    surface
}

#[test]
fn a_reach_of_nothing_joins_not_even_the_sides_of_a_tear() {
    let segment = SegmentSettings { min_grain_area_m2: 0.02, ..SegmentSettings::default() };
    let grains = |change: fn(&mut ValleySettings)| {
        let mut valleys = ValleySettings { refill_edges: 12.0, ..ValleySettings::default() };
        change(&mut valleys);
        catalogue(&indexed(&torn(), ONE_TILE), &("tear", segment.clone(), valleys), ONE_TILE).0.grains.len()
    };
    assert_eq!([grains(|_| ()), grains(|v| v.join_reach = 0.0), grains(|v| v.join_reach_edges = 0.0)], [1, 2, 2]);
}

/// Halos as thin as they come: most of a tile is unknown, and the little that it claims to know must be so. Every grain of
/// the core is either found, or its lowest triangle is named as unsettled.
#[test]
fn what_a_tile_with_a_thin_halo_publishes_is_true_and_what_it_does_not_is_named() {
    let index = indexed(&shuffled(&bed(6, 150, 120), 9), ONE_TILE);
    let grid = &index.grid;
    let mut rng = Rng(41);
    let (mut settled, mut owned, mut early, mut later_on) = (0, 0, 0, 0);
    for (name, segment, valleys) in all_hows() {
        let grains = |mesh: &TileMesh| {
            let found = segment_along_valleys(mesh, &index.scale, &segment, &valleys);
            let ids = |t: &u32| mesh.triangle_id(*t);
            let grains: Vec<(Vec<u64>, _)> =
                found.grains.iter().map(|g| (g.triangles.iter().map(ids).collect(), g.evidence)).collect();
            (grains, found.unsettled)
        };
        let (truth, open) = grains(&TileMesh::load(&index, Owned::Cells(&grid.all()), &grid.all()).unwrap());
        assert!(open.is_empty(), "{name}: {} triangles are unknown though all are loaded", open.len());
        for _ in 0..90 {
            let mut side = |n: u32| {
                let first = rng.below(n as usize) as u32;
                first..(first + 2 + 2 * rng.below(3) as u32).min(n)
            };
            let core = CellBlock { columns: side(grid.columns), rows: side(grid.rows) };
            let block = grid.grown(&core, 3 * rng.below(7) as u32);
            let mesh = TileMesh::load(&index, Owned::Cells(&core), &block).unwrap();
            let (found, unsettled) = grains(&mesh);
            assert!(unsettled.is_sorted_by(|a, b| a < b) && unsettled.iter().all(|&t| mesh.in_core[t as usize]));
            let unsettled: Vec<u64> = unsettled.iter().map(|&t| mesh.triangle_id(t)).collect();
            let own = |g: &&(Vec<u64>, _)| mesh.triangle_runs.local(g.0[0]).is_some_and(|t| mesh.in_core[t as usize]);
            let named = |g: &(Vec<u64>, _)| unsettled.binary_search(&g.0[0]).is_ok();
            let later: Vec<_> = truth.iter().filter(own).filter(|g| named(g)).collect();
            let now: Vec<_> = truth.iter().filter(own).filter(|g| !named(g)).collect();
            assert_eq!(now, found.iter().collect::<Vec<_>>(), "{name}, core {core:?}, loaded {block:?}");
            if unsettled.is_empty() {
                assert!(later.is_empty());
                (settled, owned) = (settled + 1, owned + now.len());
            } else {
                (early, later_on) = (early + now.len(), later_on + later.len());
            }
        }
    }
    println!(
        "{settled} of {} tiles settled, with {owned} grains; in the others {early} are found at once, {later_on} not",
        90 * all_hows().len()
    );
    assert!(settled > 50 && owned > 20 && early > 30 && later_on > 50, "{settled} {owned} {early} {later_on}");
}
