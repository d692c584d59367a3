//! The page that shows the river: from files to files.

use crate::costs::{Costs, Meter};
use crate::curvature::Stencil;
use crate::error::Error;
use crate::index::{BuildRoom, Index};
use crate::measure::Wanted;
use crate::open::Reach;
use crate::passes::{Recipe, Survey};
use crate::pipeline::{Budget, Control, Crew, Interrupted, LostJob, memory_there_bytes};
use crate::progress::{Progress, Unit};
use crate::segment::smallest_grain_area_m2;
use crate::settings::Settings;
use crate::statistics::RasterGrid;
use crate::stitch::{Catalogue, TileReport, stitch};
use crate::store::Shelf;
use crate::tile::{NormalField, Plan, TileMesh};
use crate::write::{OutputFolder, Results, WholeMesh, WriteError, write_all};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// What to run.
#[derive(Debug, Clone)]
pub struct Job {
    /// Files of one survey.
    pub inputs: Vec<PathBuf>,
    /// Folder for the results.
    pub out: PathBuf,
    /// Every parameter.
    pub settings: Settings,
    /// Whether results that are there may be replaced.
    pub force: bool,
}

/// What a run did.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The files written.
    pub files: Vec<PathBuf>,
    /// What was found. Grains carry their triangles when a labelled mesh was asked for.
    pub catalogue: Catalogue,
    /// Tiles whose grains are missing.
    pub lost: Vec<LostJob>,
    /// Triangles segmented for each triangle of the survey: what halos cost.
    pub segmented_per_triangle: f64,
    /// Triangles of the survey.
    pub triangles: u64,
    /// What each stage cost.
    pub costs: Costs,
}

/// Runs a job: opens the survey, works it tile by tile, and writes the results.
///
/// The result does not depend on `settings.work`: neither on the tile size, nor on the threads, nor on the
/// memory. Nothing is written under its final name before everything is complete.
///
/// # Errors
/// Whatever keeps the results from being complete; see [`Error`].
pub fn run(job: &Job, progress: &dyn Progress, control: &Control) -> Result<Outcome, Error> {
    let meter = Meter::new(progress);
    let progress: &dyn Progress = &meter;
    let settings = &job.settings;
    settings.check()?;
    let folder = OutputFolder::create(&job.out, job.force, &[])?;
    folder.spare(&job.inputs)?;
    let crew = crew(settings, control)?;

    // open
    let (reach, warnings) = crew.pool.install(|| open(job, progress))?;
    control.check()?;
    let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    warnings.iter().for_each(|w| progress.warn(w));

    // index
    progress.begin("index", reach.triangles(), Unit::Triangles);
    let shelf = Shelf::new(&job.out.join("work"))?;
    let room = BuildRoom { bytes: crew.budget.total_bytes() / 2, ..BuildRoom::default() };
    let mut index = crew.pool.install(|| Index::build(&reach, &shelf, room))?;
    progress.advance(reach.triangles());
    progress.end();
    control.check()?;
    check_outputs(&reach, &index, settings)?;

    // plan
    let plans = plans(&index, settings, &crew);
    let plan = &plans.grains;
    progress.note(&format!(
        "{} tiles of {:.3} m, {} threads, {} MiB of memory for tiles",
        plan.tiles.len(),
        plan.tile_size_m,
        crew.pool.current_num_threads(),
        crew.budget.total_bytes() >> 20
    ));

    // tile by tile: spacing, curvature, then segment and measure
    let (spacing_m, lost) =
        Survey { index: &index, plan: &plans.curvature }.spacing(&crew, progress).map_err(|_| Interrupted)?;
    none_lost("spacing", lost)?;
    index.scale.spacing_m = spacing_m;
    let stencil = Stencil::new(index.scale.spacing_m, index.scale.mean_triangle_area_m2, &settings.curvature);
    let divergence = shelf.create("divergence", index.scale.vertices)?;
    let survey = Survey { index: &index, plan: &plans.curvature };
    let jobs: Vec<usize> = (0..plans.curvature.tiles.len()).collect();
    none_lost(
        "curvature",
        survey
            .divergence(&crew, &jobs, &stencil, &divergence, progress, |_, _| Ok::<_, ()>(()))
            .map_err(|_| Interrupted)?,
    )?;
    let outline_step_m = reach.frame().outline_step_m();
    let wanted = Wanted { outline_step_m, triangle_ids: settings.output.labelled_mesh };
    let recipe = Recipe { settings: &settings.segment, divergence: &divergence, wanted };
    let survey = Survey { index: &index, plan };
    let jobs: Vec<usize> = (0..plan.tiles.len()).collect();
    let mut findings = Vec::new();
    let found_lost = survey
        .grains(&crew, &jobs, &recipe, progress, |_, finding| {
            findings.push(finding);
            Ok::<_, ()>(())
        })
        .map_err(|_| Interrupted)?;
    let tile = |lost: &LostJob| plan.tiles[lost.job].id;
    found_lost.iter().for_each(|lost| progress.warn(&format!("tile {} is lost: {}", tile(lost), lost.message)));

    // stitch
    let touch_steps = (TOUCH_EDGES * index.scale.mean_edge_m / outline_step_m) as i64;
    let (catalogue, tiles) = stitch(findings, touch_steps);

    // statistics and write
    let mut facts = facts(&reach, &index, plan, &warnings, &found_lost);
    let segmented_per_triangle = segmented_per_triangle(&tiles);
    facts["segmented_per_triangle"] = segmented_per_triangle.into();
    let mesh = WholeMesh::new(&reach);
    let surveyed = index.triangles.occupied(&index.grid);
    let results = Results {
        frame: reach.frame(),
        settings,
        scale: &index.scale,
        surveyed: &surveyed,
        catalogue: &catalogue,
        tiles: &tiles,
        smallest_grain_area_m2: smallest_grain_area_m2(&index.scale, &settings.segment),
        facts: &facts,
        costs: &|| serde_json::json!(meter.costs()),
        mesh: settings.output.labelled_mesh.then_some(&mesh),
    };
    let files = write(&folder, &results, progress)?;
    let (lost, triangles, costs) = (found_lost, reach.triangles(), meter.costs());
    Ok(Outcome { files, catalogue, lost, segmented_per_triangle, triangles, costs })
}

/// Outlines within this many mean edges touch: grains are separated by a valley of a few triangles.
const TOUCH_EDGES: f64 = 4.0;
/// Share of the memory that is there for tiles in flight, unless a budget is set.
const SHARE_OF_MEMORY: f64 = 0.5;
/// Budget where the system does not tell what is there, bytes.
const MEMORY_IF_UNKNOWN: u64 = 2 << 30;

fn crew(settings: &Settings, control: &Control) -> Result<Crew, Error> {
    let threads = settings.work.threads;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("worker-{i}"))
        .build()
        .map_err(|source| Error::Threads { threads, source })?;
    let bytes = settings.memory_bytes().unwrap_or_else(|| {
        memory_there_bytes().map_or(MEMORY_IF_UNKNOWN, |there| (there as f64 * SHARE_OF_MEMORY) as u64)
    });
    Ok(Crew { pool, budget: Budget::new(bytes), control: control.clone() })
}

fn open(job: &Job, progress: &dyn Progress) -> Result<(Reach, Vec<crate::open::Warning>), Error> {
    let bytes: u64 = job.inputs.iter().filter_map(|p| std::fs::metadata(p).ok()).map(|m| m.len()).sum();
    progress.begin("open", bytes, Unit::Bytes);
    let told = AtomicU64::new(0);
    let opened = Reach::open(&job.inputs, &job.settings.input, &|done, _| {
        let before = told.fetch_max(done, Ordering::Relaxed);
        progress.advance(done.saturating_sub(before));
    });
    progress.end();
    Ok(opened?)
}

/// How the survey is cut, for each kind of pass.
struct Plans {
    curvature: Plan,
    grains: Plan,
}

/// Largest cores, triangles.
const LARGEST_CORE: f64 = 8e6;
const LARGEST_CURVATURE_CORE: f64 = 2e6;
/// Triangles that a core's halo may add to it.
const WITH_HALO: f64 = 1.3;

fn plans(index: &Index, settings: &Settings, crew: &Crew) -> Plans {
    let threads = crew.pool.current_num_threads() as f64;
    let triangles = index.scale.triangles as f64;
    let memory = crew.budget.total_bytes() as f64 / threads / WITH_HALO;
    let cut = |bytes: u64, least: f64, most: f64| {
        let shared = if threads > 1.0 { triangles / (3.0 * threads) } else { triangles };
        Plan::side_m(index, (memory / bytes as f64).min(shared.max(least)).min(most))
    };
    let chosen = |side_m: f64| if settings.work.tile_size_m > 0.0 { settings.work.tile_size_m } else { side_m };
    Plans {
        curvature: Plan::new(index, chosen(cut(NormalField::footprint_bytes(1), 2.5e5, LARGEST_CURVATURE_CORE))),
        grains: Plan::new(index, chosen(cut(TileMesh::footprint_bytes(1), 1e6, LARGEST_CORE))),
    }
}

/// Refuses what cannot be written before the long work begins.
fn check_outputs(reach: &Reach, index: &Index, settings: &Settings) -> Result<(), Error> {
    if settings.raster.cell_m > 0.0 {
        RasterGrid::new(reach.frame(), &index.scale, settings.raster.cell_m)?;
    }
    if settings.output.labelled_mesh && reach.vertices() > u64::from(u32::MAX) {
        return Err(WriteError::TooManyVertices { vertices: reach.vertices() }.into());
    }
    Ok(())
}

/// A pass on which everything depends: none of its tiles may be lost.
fn none_lost(pass: &'static str, lost: Vec<LostJob>) -> Result<(), Error> {
    match lost.into_iter().next() {
        Some(lost) => Err(Error::TileFailed { pass, lost }),
        None => Ok(()),
    }
}

fn write(folder: &OutputFolder, results: &Results, progress: &dyn Progress) -> Result<Vec<PathBuf>, Error> {
    let files = crate::write::OUTPUTS.len() - usize::from(results.mesh.is_none());
    progress.begin("write", files as u64, Unit::Files);
    let written = write_all(folder, results, &|_| progress.advance(1));
    progress.end();
    Ok(written?)
}

fn segmented_per_triangle(tiles: &[TileReport]) -> f64 {
    let (loaded, owned) = tiles.iter().fold((0, 0), |(l, o), t| (l + t.segmented_triangles, o + t.core_triangles));
    loaded as f64 / owned.max(1) as f64
}

/// What else belongs into `run.json`.
fn facts(reach: &Reach, index: &Index, plan: &Plan, warnings: &[String], lost: &[LostJob]) -> serde_json::Value {
    let absolute = |p: &Path| std::path::absolute(p).unwrap_or_else(|_| p.to_owned()).display().to_string();
    let inputs: Vec<_> = reach
        .files()
        .iter()
        .map(|f| {
            serde_json::json!({
                "path": absolute(f.path()),
                "bytes": f.bytes(),
                "vertices": f.vertices(),
                "faces": f.faces(),
                "triangles": f.triangles(),
                "fingerprint": f.fingerprint(),
            })
        })
        .collect();
    let lost: Vec<_> = lost
        .iter()
        .map(|l| {
            let core = index.grid.outline(&plan.tiles[l.job].core);
            serde_json::json!({ "tile": plan.tiles[l.job].id, "core_min_m": core.min, "core_max_m": core.max, "message": l.message })
        })
        .collect();
    serde_json::json!({
        "inputs": inputs,
        "warnings": warnings,
        "lost_tiles": lost,
        "tiles": plan.tiles.len(),
        "tile_size_m": plan.tile_size_m,
        "mean_edge_m": index.scale.mean_edge_m,
        "mean_triangle_area_m2": index.scale.mean_triangle_area_m2,
        "spacing_m": index.scale.spacing_m,
        "zero_area_triangles": index.scale.zero_area_triangles,
    })
}
