//! The page that shows the river: from files to files.

use crate::costs::{Costs, Meter};
use crate::curvature::InstructionSet;
use crate::cuts::{GrainCores, grain_cores};
use crate::divergence::Divergence;
use crate::error::Error;
use crate::facts::{facts, oddities, oddities_of_cloud, raised_limit};
use crate::forecast;
use crate::index::{BuildRoom, Index};
use crate::measure::Wanted;
use crate::open::{Reach, Surface, resolve_inputs};
use crate::opening::open_survey;
use crate::passes::{Probe, Recipe, Survey, Telling};
use crate::pipeline::{Budget, Control, Crew, LostJob, beside, memory_there_bytes, return_free_memory};
use crate::progress::{Progress, Unit};
use crate::resume::{ResumeError, WORK, WorkFolder, changes_since_finished, whole_identity};
use crate::segment::smallest_grain_area_m2;
use crate::settings::{Instructions, Method, Settings};
use crate::statistics::{RasterGrid, Sizes};
use crate::stitch::{Catalogue, TileReport, leave_out, stitch};
use crate::store::Shelf;
use crate::surfaces::{WholeSurface, tell_of_weld};
use crate::tile::Plan;
use crate::write::{OutputFolder, REPORT, Results, WholeMesh, WriteError, write_unnamed};
use std::path::PathBuf;

/// What to run.
#[derive(Debug, Clone)]
pub struct Job {
    /// Files of one survey, or folders, patterns and lists of them; see [`resolve_inputs`].
    pub inputs: Vec<PathBuf>,
    /// Folder for the results.
    pub out: PathBuf,
    /// Every parameter.
    pub settings: Settings,
    /// Whether results that are there may be replaced.
    pub force: bool,
    /// Whether to go on where an interrupted run stopped. Without one, the run begins as usual.
    pub resume: bool,
    /// Folder for what is needed again: it stays, and later runs on the same survey use it. Otherwise it is a
    /// folder in `out`, and goes when the run is done.
    pub work: Option<PathBuf>,
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
    /// Triangles loaded for curvature for each triangle of the tiles whose curvature was not known: what halos cost.
    pub curvature_per_triangle: Option<f64>,
    /// Triangles of the survey.
    pub triangles: u64,
    /// What each stage cost.
    pub costs: Costs,
}

impl Outcome {
    /// D16, D50 and D84 of the b axis, area-by-number and then grid-by-number, millimetres; none without grains.
    pub fn b_axis_mm(&self) -> Option<[[f64; 3]; 2]> {
        let sizes = Sizes::new(self.catalogue.grains.iter().map(|g| 1e3 * g.grain.axes_m[1]));
        let of = |base: fn(&Sizes, f64) -> Option<f64>| {
            let [d16, d50, d84] = [16.0, 50.0, 84.0].map(|percent| base(&sizes, percent));
            Some([d16?, d50?, d84?])
        };
        Some([of(Sizes::area_by_number)?, of(Sizes::grid_by_number)?])
    }
}

/// Whether a job that is to be resumed is done already: its results are there, from the same inputs and settings.
///
/// # Errors
/// An input cannot be read, or the results that are there are those of another run.
pub fn is_done(job: &Job) -> Result<bool, Error> {
    let report = job.out.join(REPORT);
    if !job.resume || job.force || WorkFolder::holds_run(job.work.as_deref(), &job.out) || !report.is_file() {
        return Ok(false);
    }
    job.settings.check()?;
    let inputs = resolve_inputs(&job.inputs)?;
    let open = || Reach::open(&inputs.paths, &job.settings.input, &|_, _| {});
    let (reach, _) = pool(&job.settings)?.install(open)?;
    match changes_since_finished(&job.out, REPORT, &reach, &job.settings) {
        Some(changes) if changes.is_empty() => Ok(true),
        Some(changes) => Err(ResumeError::Finished { path: job.out.clone(), changes }.into()),
        None => Ok(false),
    }
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
    let inputs = resolve_inputs(&job.inputs)?;
    // Where there is nothing to resume, results that are there are not those of an interrupted run.
    let resumed = job.resume && WorkFolder::holds_run(job.work.as_deref(), &job.out);
    let folder = OutputFolder::create(&job.out, job.force || resumed, &[WORK])?;
    folder.spare(&inputs.paths)?;
    let mut work = WorkFolder::open(job.work.as_deref(), &job.out)?;
    let (pool, memory) = (pool(settings)?, memory_bytes(settings));
    let (threads, instructions) = (pool.current_num_threads(), instructions(settings)?);
    let labelled = settings.output.labelled_mesh || settings.output.labelled_cloud;

    // open
    let (reach, warnings) = pool.install(|| open_survey(&inputs, &settings.input, progress))?;
    control.check()?;
    let mut warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    warnings.extend(settings.without_effect());
    warnings.iter().for_each(|w| progress.warn(w));
    let mut findings = work.begin(&reach, settings, job.resume)?;

    check_labels(&reach, settings)?;

    // index
    let room = forecast::room(&reach, memory)?;
    let budget = (room.bytes, forecast::fixed_bytes(&reach));
    let crew = Crew { pool, budget: Budget::strict(room.bytes), control: control.clone() };
    let earlier = work.index(&reach, settings)?;
    let made = earlier.is_none();
    let surface = |shelf: &Shelf| {
        crew.pool.install(|| WholeSurface::of(&reach, settings, (shelf, room.bytes), (progress, control)))
    };
    let mut whole = None;
    let mut index = match earlier {
        Some(index) => index,
        None => {
            let disk = forecast::disk(&reach, room, &work.path().display().to_string(), work.free_bytes())?;
            progress.note(&format!("the index takes {} MiB in {}", disk >> 20, work.path().display()));
            let surface = whole.insert(surface(&work.surface_shelf()?)?);
            control.check()?;
            let room = forecast::index_room(&reach, room, surface.welded_bytes())?;
            let index = make_index(surface.surface(), &work, room, &crew, progress)?;
            // Nothing of an index is kept that may be partly of another file.
            reach.check_unchanged(false)?;
            work.note_weld(surface.weld_facts())?;
            work.note_figures(surface.figures().as_ref())?;
            index
        }
    };

    raised_limit(&index.scale, &settings.segment).iter().for_each(|raised| progress.note(raised));
    let weld = work.weld_facts();
    warnings.extend(tell_of_weld(&reach, weld.as_ref(), progress));

    // plan; the disk takes the index meanwhile, also that of a run that is to stop
    // Labels go back onto the surface; nothing else needs it any more.
    whole = whole.filter(|whole| labelled && whole.cloud().is_some());
    let keep = || if made { work.keep_index(&reach, settings, &index) } else { Ok(()) };
    let (kept, planned) = beside(keep, || {
        control.check()?;
        check_outputs(&reach, &index, settings)?;
        let cores = plan_grains(&index, settings, (threads, budget), progress)?;
        // tile by tile: curvature, if the method asks for that of the whole survey
        let divergence = match settings.segment.method {
            Method::Valleys => None,
            Method::Rheinwalt2025 => {
                let means = (&crew, instructions, budget.0);
                Some(Divergence::of((&reach, &index), &work, settings, means, progress)?)
            }
        };
        Ok::<_, Error>((cores, divergence))
    });
    kept.inspect_err(|_| work.give_up_index())?;
    let (cores, divergence) = planned?;
    index.scale.spacing_m = divergence.as_ref().map_or(0.0, |d| d.spacing_m);
    let curvature_per_triangle = divergence.as_ref().and_then(|d| d.loaded_per_triangle);

    // tile by tile: segment and measure
    let outline_step_m = reach.frame().outline_step_m();
    let wanted = Wanted { outline_step_m, shape_prior: settings.measure.shape_prior(), triangle_ids: labelled };
    let method = match &divergence {
        None => Telling::Valleys(&settings.valleys),
        Some(divergence) => Telling::Rheinwalt2025(divergence.column()),
    };
    let recipe = Recipe { settings: &settings.segment, method, wanted, usual_width_m: None };
    let largest = Plan::new(&index, cores.largest);
    let survey = Survey { index: &index, plan: &largest, instructions };
    let probe = match cores.divisible || largest.tiles.len() > 1 {
        true => crew.pool.install(|| survey.probe(&recipe))?,
        false => Probe::default(),
    };
    let recipe = Recipe { usual_width_m: probe.usual_width_m, ..recipe };
    let plan = Plan::new(&index, findings.core(cores.size(&index, threads, probe.usual_width_m))?);
    let survey = Survey { index: &index, plan: &plan, instructions };
    // An interrupted run may have had more memory, and larger tiles.
    forecast::tiles_bytes(&survey, settings, threads, budget)?;
    let jobs = findings.missing(&plan);
    if jobs.len() < plan.tiles.len() {
        progress.note(&format!("{} of {} tiles are done already", plan.tiles.len() - jobs.len(), plan.tiles.len()));
    }
    let lost = survey.grains(&crew, &jobs, &recipe, progress, |_, finding| findings.add(&finding))?;
    findings.sync()?;
    let tile = |lost: &LostJob| plan.tiles[lost.job].id;
    lost.iter().for_each(|lost| progress.warn(&format!("tile {} is lost: {}", tile(lost), lost.message)));

    // stitch
    let touch_steps = (TOUCH_EDGES * index.scale.mean_edge_m / outline_step_m) as i64;
    let mut found = findings.all(&plan)?;
    let left_out = leave_out(&mut found, settings.measure.min_confidence);
    if left_out > 0 {
        let least = settings.measure.min_confidence;
        progress.note(&format!(
            "{left_out} grains are left out: their confidence is below measure.min_confidence = {least}"
        ));
    }
    let (catalogue, tiles) = stitch(found, touch_steps);

    // statistics and write
    let figures = work.figures();
    let odd = figures.iter().flat_map(oddities_of_cloud).chain(oddities(
        &catalogue,
        (left_out, reach.is_cloud()),
        &index.scale,
        settings,
    ));
    odd.for_each(|odd| {
        progress.warn(&odd);
        warnings.push(odd);
    });
    let mut facts = facts(&reach, &index, &plan, &warnings, &lost);
    let segmented_per_triangle = segmented_per_triangle(&tiles, probe.segmented);
    facts["segmented_per_triangle"] = segmented_per_triangle.into();
    facts["curvature_per_triangle"] = curvature_per_triangle.into();
    facts["grains_below_min_confidence"] = left_out.into();
    facts["identity"] = whole_identity(&reach, settings).into();
    facts["weld"] = serde_json::json!(weld);
    facts["surface"] = serde_json::json!(figures);
    if labelled && reach.is_cloud() && whole.is_none() {
        whole = Some(surface(&work.surface_shelf()?)?);
    }
    let mesh = WholeMesh::new(&reach, whole.as_ref().and_then(WholeSurface::cloud));
    let scale = index.scale;
    let surveyed = index.triangles.occupied(&index.grid);
    let results = Results {
        frame: reach.frame(),
        settings,
        scale: &scale,
        surveyed: &surveyed,
        catalogue: &catalogue,
        tiles: &tiles,
        smallest_grain_area_m2: smallest_grain_area_m2(&scale, &settings.segment),
        facts: &facts,
        costs: &|| serde_json::json!(meter.costs()),
        mesh: labelled.then_some(&mesh),
        cloud: settings.output.labelled_cloud.then_some(&reach),
    };
    let files = crew.pool.install(|| write(&folder, &results, progress, control, &reach))?;
    if lost.is_empty() {
        drop((index, divergence, findings));
        work.finish();
    }
    let (triangles, costs) = (scale.triangles, meter.costs());
    Ok(Outcome { files, catalogue, lost, segmented_per_triangle, curvature_per_triangle, triangles, costs })
}

/// Outlines within this many mean edges touch: grains are separated by a valley of a few triangles.
const TOUCH_EDGES: f64 = 4.0;
/// Share of the memory that is there, unless a budget is set.
const SHARE_OF_MEMORY: f64 = 0.5;
/// Budget where the system does not tell what is there, bytes.
const MEMORY_IF_UNKNOWN: u64 = 2 << 30;

fn pool(settings: &Settings) -> Result<rayon::ThreadPool, Error> {
    let threads = settings.work.threads;
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("worker-{i}"))
        .build()
        .map_err(|source| Error::Threads { threads, source })
}

fn instructions(settings: &Settings) -> Result<InstructionSet, Error> {
    let wanted = match settings.work.instructions {
        Instructions::Auto => return Ok(InstructionSet::best()),
        Instructions::Avx512 => InstructionSet::Avx512,
        Instructions::Avx2 => InstructionSet::Avx2,
        Instructions::Scalar => InstructionSet::Scalar,
    };
    let available = InstructionSet::available();
    if available.contains(&wanted) { Ok(wanted) } else { Err(Error::Instructions { wanted, available }) }
}

fn memory_bytes(settings: &Settings) -> u64 {
    settings.memory_bytes().unwrap_or_else(|| {
        memory_there_bytes().map_or(MEMORY_IF_UNKNOWN, |there| (there as f64 * SHARE_OF_MEMORY) as u64)
    })
}

fn make_index(
    surface: &dyn Surface,
    work: &WorkFolder,
    room: BuildRoom,
    crew: &Crew,
    progress: &dyn Progress,
) -> Result<Index, Error> {
    progress.begin("index", surface.triangles(), Unit::Triangles);
    let index = crew.pool.install(|| work.make_index(|shelf| Index::build(surface, shelf, room)))?;
    return_free_memory();
    progress.advance(surface.triangles());
    progress.end();
    Ok(index)
}

/// How the survey is cut for the grain pass, and whether that fits. `budget` is the memory for tiles and what else is
/// taken, bytes.
fn plan_grains(
    index: &Index,
    settings: &Settings,
    (threads, budget): (usize, (u64, u64)),
    progress: &dyn Progress,
) -> Result<GrainCores, Error> {
    let cores = grain_cores(index, settings, threads, budget.0);
    let grains = Plan::new(index, cores.largest);
    let survey = Survey { index, plan: &grains, instructions: InstructionSet::best() };
    let tiles_bytes = forecast::tiles_bytes(&survey, settings, threads, budget)?;
    progress.note(&format!(
        "{} tiles{} of {:.3} x {:.3} m, {threads} threads; peak memory about {} MiB of {} MiB",
        grains.tiles.len(),
        if cores.divisible { " or more" } else { "" },
        grains.core_m(index)[0],
        grains.core_m(index)[1],
        (tiles_bytes + budget.1) >> 20,
        (budget.0 + budget.1) >> 20
    ));
    Ok(cores)
}

/// Refuses what cannot be written before the long work begins.
fn check_outputs(reach: &Reach, index: &Index, settings: &Settings) -> Result<(), Error> {
    if settings.raster.cell_m > 0.0 {
        RasterGrid::new(reach.frame(), &index.scale, settings.raster.cell_m)?;
    }
    Ok(())
}

/// Refuses labels that cannot be written before anything is worked.
fn check_labels(reach: &Reach, settings: &Settings) -> Result<(), Error> {
    if settings.output.labelled_cloud && !reach.is_cloud() {
        return Err(WriteError::NoCloud.into());
    }
    if settings.output.labelled_mesh && reach.vertices() > u64::from(u32::MAX) {
        return Err(WriteError::TooManyVertices { vertices: reach.vertices() }.into());
    }
    Ok(())
}

fn write(
    folder: &OutputFolder,
    results: &Results,
    progress: &dyn Progress,
    control: &Control,
    reach: &Reach,
) -> Result<Vec<PathBuf>, Error> {
    let files = results.names().len();
    progress.begin("write", files as u64, Unit::Files);
    let written = write_unnamed(folder, results, &|_| progress.advance(1));
    progress.end();
    let written = written?;
    // Labels go beside what the files hold, which was read once more for them. Extra attributes of a labelled cloud come from
    // its file, which is opened again.
    if results.mesh.is_some() || results.cloud.is_some() {
        let opened_again = results.cloud.is_some_and(|reach| matches!(reach.files(), [only] if only.is_las()));
        reach.check_unchanged(opened_again)?;
    }
    control.commit()?;
    Ok(folder.publish(written)?)
}

fn segmented_per_triangle(tiles: &[TileReport], probed: u64) -> f64 {
    let (loaded, owned) = tiles.iter().fold((probed, 0), |(l, o), t| (l + t.segmented_triangles, o + t.core_triangles));
    loaded as f64 / owned.max(1) as f64
}
