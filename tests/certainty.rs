//! The promise of the program: a grain is the same, bit for bit, whatever the tiles, the threads and the memory.
//!
//! The bed of `support::bed` is worked as one tile and as many, and everything that comes out is compared by
//! `==` and by its printed digits (which tell -0 from 0). Its triangles are shuffled, so that the lowest
//! triangle of a grain, by which a tile owns it, may lie anywhere in it.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use gravelometer::curvature::{InstructionSet, Stencil};
use gravelometer::geometry::DVec3;
use gravelometer::index::{BuildRoom, CellBlock, Index};
use gravelometer::open::MemorySurface;
use gravelometer::passes::{CoreValues, Recipe, Survey, Telling};
use gravelometer::progress::Silent;
use gravelometer::segment::state::State;
use gravelometer::segment::{Settled, segment};
use gravelometer::settings::{AreaRule, ConcaveRule, CurvatureSettings, SegmentSettings};
use gravelometer::stitch::{Catalogue, TileReport};
use gravelometer::store::{Column, Shelf};
use gravelometer::tile::{CoreSize, Owned, Plan, TileMesh, read_of};
use support::bed::{Rng, bed, shuffled};
use support::tiled::{self, ONE_TILE, Tiling, WANTED, assert_same, crew};

struct Worked {
    index: Index,
    divergence: Column<f64>,
}

/// Spacing and divergence, tiled, from an index that was built in little memory.
fn worked(surface: &MemorySurface, tiling: Tiling) -> Worked {
    let crew = crew(tiling);
    let room = BuildRoom { bytes: tiling.memory_bytes, wide: tiling.threads > 1 };
    let mut index = crew.pool.install(|| support::indexed_with(surface, room));
    let plan = Plan::new(&index, CoreSize::square(&index, tiling.tile_size_m));
    let instructions = InstructionSet::best();
    let (spacing_m, lost) = Survey { index: &index, plan: &plan, instructions }.spacing(&crew, &Silent).unwrap();
    assert!(lost.is_empty(), "{lost:?}");
    index.scale.spacing_m = spacing_m;
    let stencil = Stencil::new(spacing_m, index.scale.mean_triangle_area_m2, &CurvatureSettings::default());
    let folder = tempfile::tempdir().unwrap();
    let divergence = Shelf::new(folder.path()).unwrap().create("divergence", index.scale.vertices).unwrap();
    let jobs: Vec<usize> = (0..plan.tiles.len()).collect();
    let survey = Survey { index: &index, plan: &plan, instructions };
    let keep = |_, core: CoreValues| {
        let mut values = core.values.into_iter();
        core.runs
            .iter()
            .try_for_each(|run| divergence.write(run.start, values.by_ref().take((run.end - run.start) as usize)))
    };
    let lost = survey.divergence(&crew, &jobs, &stencil, &Silent, keep).unwrap();
    assert!(lost.is_empty(), "{lost:?}");
    Worked { index, divergence }
}

fn values(column: &Column<f64>) -> Vec<f64> {
    let mut values = Vec::new();
    column.read(0..column.len(), &mut values).unwrap();
    values
}

fn catalogue(worked: &Worked, settings: &SegmentSettings, tiling: Tiling) -> (Catalogue, Vec<TileReport>) {
    let method = Telling::Rheinwalt2025(&worked.divergence);
    tiled::catalogue(&worked.index, &Recipe { settings, method, wanted: WANTED, usual_width_m: None }, tiling)
}

fn settings(change: impl FnOnce(&mut SegmentSettings)) -> SegmentSettings {
    let mut settings = SegmentSettings {
        max_grain_m: 1.05,
        min_grain_area_m2: 0.006,
        min_grain_triangles: 25.0,
        ..SegmentSettings::default()
    };
    change(&mut settings);
    settings
}

fn recipes() -> Vec<(&'static str, SegmentSettings)> {
    vec![
        ("default", settings(|_| {})),
        ("no erosion", settings(|s| s.erosion_iterations = 0)),
        ("six rings of dilation", settings(|s| s.dilation_iterations = 6)),
        ("edge holes filled", settings(|s| s.fill_edge_holes = true)),
        ("triangle count", settings(|s| s.area_rule = AreaRule::TriangleCount)),
        ("flat bodies too, two rings off", settings(|s| (s.min_sphericity, s.erosion_iterations) = (0.0, 2))),
        ("narrow grains, mean concavity", settings(|s| (s.max_grain_m, s.concave_rule) = (0.3, ConcaveRule::Mean))),
        ("no holes filled, low triangles", settings(|s| (s.fill_holes, s.max_triangle_height_m) = (false, 0.04))),
        ("no limit", settings(|s| s.max_grain_m = 0.0)),
        (
            "all at once",
            settings(|s| {
                (s.max_grain_m, s.erosion_iterations, s.dilation_iterations) = (0.5, 0, 6);
                (s.fill_edge_holes, s.min_sphericity, s.concave_below) = (true, 0.0, 0.0);
            }),
        ),
    ]
}

/// What must have occurred for the comparison to say anything.
#[derive(Debug, Default)]
struct Seen {
    attempts: u32,
    tiles: usize,
    oversize: usize,
    wider_than_a_core: usize,
    over_a_core_border: usize,
    pierced: usize,
    at_edges: usize,
    tiles_without_triangles: usize,
    grains: usize,
}

impl Seen {
    fn add(&mut self, catalogue: &Catalogue, tiles: &[TileReport], core_m: f64) {
        self.attempts = self.attempts.max(tiles.iter().map(|t| t.attempts).max().unwrap());
        self.tiles = self.tiles.max(tiles.len());
        self.oversize += catalogue.oversize.len();
        self.grains += catalogue.grains.len();
        self.tiles_without_triangles += tiles.iter().filter(|t| t.core_triangles == 0).count();
        for g in catalogue.grains.iter().map(|g| &g.grain) {
            let points = || g.outline.iter().flatten().flatten().map(|p| p.map(|s| s as f64 * WANTED.outline_step_m));
            let span = |i: usize| points().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[i]), h.max(p[i])));
            let wide = (0..2).any(|i| span(i).1 - span(i).0 > core_m);
            self.wider_than_a_core += usize::from(wide);
            self.over_a_core_border +=
                usize::from(tiles.iter().any(|t| t.core.min[0] > span(0).0 && t.core.min[0] < span(0).1));
            self.pierced += usize::from(g.outline.iter().any(|polygon| polygon.len() > 1));
            self.at_edges += usize::from(g.touches_edge);
        }
    }
}

#[test]
fn every_recipe_gives_the_same_catalogue_bit_for_bit_whatever_the_tiles_threads_and_memory() {
    let mut rng = Rng(7);
    let mut seen = Seen::default();
    for (surface, random_tilings) in [(shuffled(&bed(1, 150, 120), 5), 3), (bed(2, 130, 100), 1)] {
        let reference = worked(&surface, ONE_TILE);
        let expected: Vec<Catalogue> = recipes().iter().map(|(_, r)| catalogue(&reference, r, ONE_TILE).0).collect();
        let mut tilings = vec![Tiling { tile_size_m: 0.0, threads: 3, memory_bytes: 1 }];
        for i in 0..random_tilings {
            let (threads, memory_bytes) = [(1, 1 << 30), (3, 1)][i % 2];
            tilings.push(Tiling { tile_size_m: rng.within(0.5, 1.6), threads, memory_bytes });
        }
        for (k, &tiling) in tilings.iter().enumerate() {
            let tiled = worked(&surface, tiling);
            assert_eq!(tiled.index.scale.spacing_m.to_bits(), reference.index.scale.spacing_m.to_bits());
            let bits = |d: &[f64]| d.iter().map(|d| d.to_bits()).collect::<Vec<_>>();
            assert!(bits(&values(&tiled.divergence)) == bits(&values(&reference.divergence)), "divergence, {tiling:?}");
            for (r, (name, recipe)) in recipes().iter().enumerate() {
                // The finest tiling is dear, most so without a limit: it takes every third recipe.
                if k == 0 && (recipe.max_grain_m == 0.0 || (r + random_tilings) % 3 != 0) {
                    continue;
                }
                let (found, tiles) = catalogue(&tiled, recipe, tiling);
                assert_same(&expected[r], &found, &format!("{name}, {tiling:?}, {} tiles", tiles.len()));
                seen.add(
                    &found,
                    &tiles,
                    Plan::new(&tiled.index, CoreSize::square(&tiled.index, tiling.tile_size_m)).core_m(&tiled.index)[0],
                );
            }
        }
    }
    println!("{seen:?}");
    assert!(seen.attempts > 1, "no tile had to be worked again: {seen:?}");
    assert!(seen.tiles > 60 && seen.tiles_without_triangles > 0, "{seen:?}");
    assert!(seen.oversize > 0 && seen.wider_than_a_core > 10 && seen.over_a_core_border > 100, "{seen:?}");
    assert!(seen.pierced > 0 && seen.at_edges > 10, "{seen:?}");
}

/// States after every step, the grains by global triangle ids, and what was found.
fn segmented(worked: &Worked, recipe: &SegmentSettings, mesh: &TileMesh) -> (Vec<Vec<State>>, Vec<Vec<u64>>, Settled) {
    let divergence = read_of(&worked.divergence, &mesh.vertex_runs).unwrap();
    let mut states = Vec::new();
    let found = segment(mesh, &divergence, &worked.index.scale, recipe, &mut |_, s| states.push(s.to_vec()));
    let ids = |t: &u32| mesh.triangle_id(*t);
    (states, found.grains.iter().map(|g| g.triangles.iter().map(ids).collect()).collect(), found)
}

/// The first halo is generous, so that the passes seldom meet the cut. Here halos are as thin as they come:
/// most of a tile is unknown, and the little that it claims to know must be so. Every grain of the core is
/// either found, or its lowest triangle is named as unsettled.
#[test]
fn what_a_tile_with_a_thin_halo_claims_to_know_is_true_after_every_step() {
    let surface = shuffled(&bed(6, 150, 120), 9);
    let worked = worked(&surface, ONE_TILE);
    let grid = &worked.index.grid;
    let mut rng = Rng(31);
    let (mut known, mut unknown, mut settled, mut owned) = (0u64, 0u64, 0u64, 0u64);
    let (mut found_early, mut sought_further) = (0usize, 0usize);
    for (name, recipe) in recipes() {
        let all = TileMesh::load(&worked.index, Owned::Cells(&grid.all()), &grid.all()).unwrap();
        let (truth, grains, _) = segmented(&worked, &recipe, &all);
        for _ in 0..90 {
            let mut side = |n: u32| {
                let first = rng.below(n as usize) as u32;
                first..(first + 2 + 2 * rng.below(3) as u32).min(n)
            };
            let core = CellBlock { columns: side(grid.columns), rows: side(grid.rows) };
            let block = grid.grown(&core, 2 * rng.below(5) as u32);
            let mesh = TileMesh::load(&worked.index, Owned::Cells(&core), &block).unwrap();
            let (states, found, what) = segmented(&worked, &recipe, &mesh);
            let ids: Vec<u64> = (0..mesh.triangles.len() as u32).map(|t| mesh.triangle_id(t)).collect();
            for (step, (seen, truth)) in states.iter().zip(&truth).enumerate() {
                for (state, &id) in seen.iter().zip(&ids) {
                    let wrong = *state != State::Unknown && *state != truth[id as usize];
                    assert!(!wrong, "{name}, step {step}, triangle {id}: {state:?}, core {core:?}, loaded {block:?}");
                    unknown += u64::from(*state == State::Unknown);
                    known += u64::from(*state != State::Unknown);
                }
            }
            let unsettled: Vec<u64> = what.unsettled.iter().map(|&t| ids[t as usize]).collect();
            assert!(unsettled.windows(2).all(|w| w[0] < w[1]), "{unsettled:?}");
            assert!(what.unsettled.iter().all(|&t| mesh.in_core[t as usize]), "{unsettled:?}");
            let own = |g: &&Vec<u64>| ids.binary_search(&g[0]).is_ok_and(|t| mesh.in_core[t]);
            let expected: Vec<&Vec<u64>> = grains.iter().filter(own).collect();
            let (later, now): (Vec<&Vec<u64>>, Vec<&Vec<u64>>) =
                expected.iter().partition(|g| unsettled.binary_search(&g[0]).is_ok());
            assert_eq!(now, found.iter().collect::<Vec<_>>(), "{name}, core {core:?}, loaded {block:?}");
            if what.unsettled.is_empty() {
                assert!(later.is_empty());
                settled += 1;
                owned += expected.len() as u64;
            } else {
                found_early += now.len();
                sought_further += later.len();
            }
        }
    }
    println!("{known} states known, {unknown} unknown; {settled} of 900 tiles settled, with {owned} grains");
    println!("in the others {found_early} grains are found at once, {sought_further} not");
    assert!(known > unknown && unknown > 10_000 && settled > 50 && owned > 20);
    assert!(found_early > 50 && sought_further > 50, "{found_early} and {sought_further}");
}

/// The survey numbers its vertices and triangles by where they lie, not by where they stand in the file.
#[test]
fn the_order_of_the_file_does_not_change_a_bit_of_any_grain() {
    let first = bed(3, 130, 100);
    let without_inputs = |mut catalogue: Catalogue| {
        catalogue.grains.iter_mut().for_each(|g| g.grain.triangle_ids.clear());
        catalogue
    };
    for dilation in [0, 3] {
        let recipe = settings(|s| s.dilation_iterations = dilation);
        let expected = without_inputs(catalogue(&worked(&first, ONE_TILE), &recipe, ONE_TILE).0);
        assert!(expected.grains.len() > 20, "{}", expected.grains.len());
        for seed in [11, 12] {
            let other = shuffled(&first, seed);
            let tiling = Tiling { tile_size_m: 0.7, threads: 2, memory_bytes: 1 << 30 };
            let other = catalogue(&worked(&other, tiling), &recipe, tiling).0;
            assert_same(&expected, &without_inputs(other), &format!("{dilation} rings, seed {seed}"));
        }
    }
}

#[test]
fn a_survey_that_needs_no_cut_is_one_tile_however_little_of_its_box_it_fills() {
    let mut surface = bed(5, 30, 30);
    let first = surface.positions.len() as u64;
    let far: Vec<DVec3> = surface.positions.iter().map(|&p| p + DVec3::new(9.0, 9.0, 0.0)).collect();
    let again: Vec<[u64; 3]> = surface.triangles.iter().map(|t| t.map(|v| v + first)).collect();
    surface.positions.extend(far);
    surface.triangles.extend(again);
    surface.colors.clear();
    let index = support::indexed(&surface);
    let all = surface.triangles.len() as f64;
    assert_eq!(Plan::new(&index, CoreSize::holding(&index, all, 1)).tiles.len(), 1);
    assert!(Plan::new(&index, CoreSize::holding(&index, all / 2.0, 1)).tiles.len() > 1);
}
