//! The demonstration: make the scene, run the main job on it, score and draw what was found.

use super::{MIN_GRAIN_AREA_M2, Scene, SceneSettings, Score, make_scene, score, top_view, write_ply, write_png};
use super::{PictureError, write_truth_csv};
use crate::error::Error;
use crate::pipeline::Control;
use crate::progress::Progress;
use crate::run::{Job, Outcome, run};
use crate::settings::Settings;
use std::path::{Path, PathBuf};

/// Width of the pictures, pixels.
const PICTURE_PX: usize = 1200;
/// The files of the scene, beside the folder of results.
const FILES: [&str; 4] = ["scene.ply", "scene_truth.csv", "scene.png", "grains.png"];
const SAND: [u8; 3] = [214, 206, 190];

/// What to demonstrate.
#[derive(Debug, Clone)]
pub struct Demonstration {
    /// Folder for scene, results and pictures.
    pub out: PathBuf,
    /// Names the scene.
    pub seed: u64,
    /// Compute threads; 0 for all cores.
    pub threads: usize,
    /// Whether results that are there may be replaced.
    pub force: bool,
}

/// What came of it.
pub struct Shown {
    /// Stones found and how well they were sized.
    pub score: Score,
    /// What the run did.
    pub outcome: Outcome,
    /// The scene, its truth, and pictures of both.
    pub files: Vec<PathBuf>,
}

/// Why a demonstration failed, besides the run itself.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DemoError {
    /// A file of the scene cannot be written.
    #[error("{}: cannot write the sample scene: {source}\nhelp: name another folder with --out", path.display())]
    Scene {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The folder holds an earlier demonstration, or somebody's own files.
    #[error("{}: is there already\nhelp: name another folder with --out, or use --force to replace it", path.display())]
    Occupied {
        /// The first of them.
        path: PathBuf,
    },
    /// A picture cannot be written.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

/// Makes the scene, runs the main job on it with the preset `sandbox`, and scores the result.
///
/// # Errors
/// Those of the run; files of the scene that cannot be written.
pub fn demonstrate(what: &Demonstration, progress: &dyn Progress, control: &Control) -> Result<Shown, Error> {
    if !what.force
        && let Some(name) = FILES.into_iter().chain(["results"]).find(|name| what.out.join(name).exists())
    {
        return Err(DemoError::Occupied { path: what.out.join(name) }.into());
    }
    progress.note("making a gravel bed with known pebbles");
    let scene = make_scene(&SceneSettings { seed: what.seed, ..SceneSettings::default() });
    let path = |name: &str| what.out.join(name);
    let written = |name: &str, result: std::io::Result<()>| {
        result.map_err(|source| DemoError::Scene { path: what.out.join(name), source })
    };
    written("", std::fs::create_dir_all(&what.out))?;
    written("scene.ply", write_ply(&scene, &path("scene.ply")))?;
    written("scene_truth.csv", write_truth_csv(&scene, &path("scene_truth.csv")))?;

    let mut settings = Settings::load(Some(Path::new("sandbox")), &[])?;
    settings.segment.min_grain_area_m2 = MIN_GRAIN_AREA_M2;
    settings.work.threads = what.threads;
    settings.output.labelled_mesh = true;
    let (inputs, out) = (vec![path("scene.ply")], path("results"));
    let job = Job { inputs, out, settings, force: what.force, resume: false, work: None };
    let outcome = run(&job, progress, control)?;

    let mut grain_of_triangle = vec![-1i64; scene.triangles.len()];
    for numbered in &outcome.catalogue.grains {
        for &t in &numbered.grain.triangle_ids {
            grain_of_triangle[t as usize] = numbered.grain_id as i64;
        }
    }
    // Grains are numbered 1, 2, 3, ...
    let axes = |id: i64| outcome.catalogue.grains.get(id as usize - 1).map(|g| g.grain.axes_m);
    let score = score(&scene, &grain_of_triangle, &axes, MIN_GRAIN_AREA_M2);
    draw(&scene, &grain_of_triangle, &path("scene.png"), &path("grains.png"))?;
    let files = FILES.map(path).to_vec();
    Ok(Shown { score, outcome, files })
}

/// The scene as it was photographed, and its grains with the true stones' outlines in black.
fn draw(scene: &Scene, grain_of_triangle: &[i64], photo: &Path, grains: &Path) -> Result<(), DemoError> {
    let mean = |t: usize| {
        let corners = scene.triangles[t].map(|v| scene.colors[v as usize]);
        std::array::from_fn(|i| (corners.iter().map(|c| u16::from(c[i])).sum::<u16>() / 3) as u8)
    };
    write_png(&top_view(&scene.vertices, &scene.triangles, &mean, PICTURE_PX), photo)?;
    let of_grain = |t: usize| grain_color(grain_of_triangle[t]);
    let mut picture = top_view(&scene.vertices, &scene.triangles, &of_grain, PICTURE_PX);
    picture.draw_outlines(&|t| i64::from(scene.stone_of_triangle[t]), [0, 0, 0]);
    Ok(write_png(&picture, grains)?)
}

/// Colours that differ from one grain to the next: steps of the golden angle around a wheel of light hues.
fn grain_color(grain: i64) -> [u8; 3] {
    if grain < 0 {
        return SAND;
    }
    let hue = (grain as f64 * 0.618_033_988_75).fract() * 6.0;
    let ramp = |offset: f64| {
        let distance = ((hue + offset) % 6.0 - 3.0).abs();
        (90.0 + 150.0 * (distance - 1.0).clamp(0.0, 1.0)) as u8
    };
    [ramp(0.0), ramp(4.0), ramp(2.0)]
}
