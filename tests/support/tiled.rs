//! The grain pass over a survey that is cut in some way.

use gravelometer::curvature::InstructionSet;
use gravelometer::index::Index;
use gravelometer::measure::Wanted;
use gravelometer::passes::{Recipe, Survey};
use gravelometer::pipeline::{Budget, Control, Crew};
use gravelometer::progress::Silent;
use gravelometer::stitch::{Catalogue, TileReport, stitch};
use gravelometer::tile::{CoreSize, Plan};
use std::convert::Infallible;

pub const WANTED: Wanted = Wanted {
    outline_step_m: 1.0 / 1_048_576.0,
    shape_prior: gravelometer::settings::ShapePrior::RIVER_GRAVEL,
    triangle_ids: true,
};

#[derive(Debug, Clone, Copy)]
pub struct Tiling {
    pub tile_size_m: f64,
    pub threads: usize,
    pub memory_bytes: u64,
}

pub const ONE_TILE: Tiling = Tiling { tile_size_m: 1e9, threads: 3, memory_bytes: 1 << 30 };

pub fn crew(tiling: Tiling) -> Crew {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(tiling.threads).build().unwrap();
    Crew { pool, budget: Budget::new(tiling.memory_bytes), control: Control::default() }
}

/// What a survey's grains are when it is cut so.
pub fn catalogue(index: &Index, recipe: &Recipe, tiling: Tiling) -> (Catalogue, Vec<TileReport>) {
    let plan = Plan::new(index, CoreSize::square(index, tiling.tile_size_m));
    let survey = Survey { index, plan: &plan, instructions: InstructionSet::best() };
    let jobs: Vec<usize> = (0..plan.tiles.len()).collect();
    let mut findings = Vec::new();
    let collect = |_, finding| {
        findings.push(finding);
        Ok::<_, Infallible>(())
    };
    let lost = survey.grains(&crew(tiling), &jobs, recipe, &Silent, collect).unwrap();
    assert!(lost.is_empty(), "{tiling:?}: {lost:?}");
    let touch_steps = (4.0 * index.scale.mean_edge_m / WANTED.outline_step_m) as i64;
    let (catalogue, tiles) = stitch(findings, touch_steps);
    every_triangle_has_one_owner(index, &catalogue, &tiles);
    (catalogue, tiles)
}

fn every_triangle_has_one_owner(index: &Index, catalogue: &Catalogue, tiles: &[TileReport]) {
    assert_eq!(tiles.iter().map(|t| t.core_triangles).sum::<u64>(), index.scale.triangles);
    assert_eq!(tiles.iter().map(|t| t.grains).sum::<u64>(), catalogue.grains.len() as u64);
    let mut owner = vec![0u64; index.scale.triangles as usize];
    for (i, g) in catalogue.grains.iter().enumerate() {
        assert_eq!((g.grain_id, g.grain.triangles), (i as u64 + 1, g.grain.triangle_ids.len() as u64));
        for &t in &g.grain.triangle_ids {
            assert_eq!(owner[t as usize], 0, "triangle {t} is in two grains");
            owner[t as usize] = g.grain_id;
        }
    }
}

pub fn assert_same(expected: &Catalogue, found: &Catalogue, what: &str) {
    assert_eq!(expected.grains.len(), found.grains.len(), "number of grains, {what}");
    for (e, f) in expected.grains.iter().zip(&found.grains) {
        assert!(e == f && format!("{e:?}") == format!("{f:?}"), "{what}:\n{e:?}\n{f:?}");
    }
    assert_eq!(format!("{:?}", expected.oversize), format!("{:?}", found.oversize), "{what}");
}
