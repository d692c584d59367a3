//! A whole validation: files in, scores, tables and a map out.

use super::error::ValidateError;
use super::grain_table::{GrainTable, Reliability, SizedBy, grain_table_file};
use super::judgement::Mostly;
use super::labels::{Labels, label_file, read_labels};
use super::map::draw;
use super::score::{Score, Scored, score};
use super::truth::{Truth, TruthFiles, TruthRule, read_truth};
use crate::picture::write_png;
use crate::store::write_atomically;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Names of the results in the folder of a run: scores and picture. A run that replaces its results removes them, and knows
/// them as `write::SCORES`.
pub const WRITTEN: [&str; 2] = ["validation.json", "validation.png"];

/// What to validate.
#[derive(Debug, Clone, Default)]
pub struct Validation {
    /// Output folder of a run with a labelled mesh, or a file of labels.
    pub run: PathBuf,
    /// Folder of the known stones.
    pub truth: PathBuf,
    /// Which triangles belong to a stone.
    pub rule: TruthRule,
    /// Whether the label 0 is no grain.
    pub zero_is_none: bool,
    /// Stones count from this connected area on, m², in place of those that the table calls visible.
    pub visible_area_m2: Option<f64>,
    /// Grains below this area, m², are not looked at.
    pub min_area_m2: f64,
    /// Where the scores go; for the folder of a run, into that by default.
    pub json: Option<PathBuf>,
    /// Where the map goes; the same.
    pub picture: Option<PathBuf>,
}

/// All scores of a validation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Folder of the known stones.
    pub scene: String,
    /// File of the labels.
    pub labels: String,
    /// Which triangles belong to a stone.
    pub truth: TruthRule,
    /// Smallest connected area of stones that count, m², if it was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visible_area_m2: Option<f64>,
    /// Smallest area of grains that count, m².
    pub min_area_m2: f64,
    /// The score of the labels.
    #[serde(flatten)]
    pub score: Score,
    /// Which stones and grains went wrong.
    pub astray: Astray,
    /// Sizes by the least-squares ellipsoid of the run's table.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ellipsoid: Option<SizedBy>,
    /// Sizes by the fitted shape of the run's table.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit: Option<SizedBy>,
    /// How far the confidence of the run's table can be trusted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reliability: Option<Reliability>,
    /// What the true labels themselves get, without the list of stones: errors that are not the segmentation's.
    pub perfect_labels: Score,
}

/// Stones and grains that went wrong by majority: to look at one by one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Astray {
    /// Stones in another stone's grain, rows of `truth.csv` from 0.
    pub merged_stones: Vec<usize>,
    /// Other stones that were missed, the same.
    pub overlooked_stones: Vec<usize>,
    /// Ids of further grains on stones that were found.
    pub further_grains: Vec<i64>,
    /// Ids of grains that are mostly sand.
    pub sand_grains: Vec<i64>,
}

impl Astray {
    fn of(scored: &Scored) -> Astray {
        let judgement = &scored.judgement;
        let ids = |is_wanted: &dyn Fn(usize, Mostly) -> bool| {
            let grains = judgement.mostly.iter().enumerate().filter(|&(grain, &kind)| is_wanted(grain, kind));
            grains.map(|(grain, _)| scored.overlaps.grain_ids[grain]).collect()
        };
        let is_match = |grain: usize, stone: usize| judgement.matches.get(&stone) == Some(&grain);
        Astray {
            merged_stones: judgement.merged.clone(),
            overlooked_stones: judgement.overlooked.clone(),
            further_grains: ids(&|grain, kind| matches!(kind, Mostly::Stone(stone) if !is_match(grain, stone))),
            sand_grains: ids(&|_, kind| kind == Mostly::Sand),
        }
    }
}

/// What came of a validation. `Display` of the report gives tables.
#[derive(Debug)]
pub struct Validated {
    /// All scores.
    pub report: Report,
    /// Files that were written.
    pub files: Vec<PathBuf>,
    /// The map, if one was drawn.
    pub picture: Option<PathBuf>,
}

/// Scores a run, or a file of labels, against known stones.
///
/// # Errors
/// Files that are missing, damaged, or do not fit each other; results that cannot be written.
pub fn validate(what: &Validation) -> Result<Validated, ValidateError> {
    let label_file = label_file(&what.run)?;
    let TruthFiles { truth, reach, mut files } = read_truth(&what.truth, what.rule, what.visible_area_m2)?;
    let labels = read_labels(&label_file, &reach, &truth.triangles)?;
    let labels = if what.zero_is_none { labels.zero_is_none() } else { labels };
    let table_file = grain_table_file(&what.run);
    let table = table_file.as_deref().map(GrainTable::read).transpose()?;
    files.push(label_file.clone());
    files.extend(table_file);

    let in_run = |name: &str| what.run.is_dir().then(|| what.run.join(name));
    let json = what.json.clone().or_else(|| in_run(WRITTEN[0]));
    let picture = what.picture.clone().or_else(|| in_run(WRITTEN[1]));
    spare(&files, json.as_deref(), "scores")?;
    spare(&files, picture.as_deref(), "picture")?;

    let scored = score(&truth, &labels, what.min_area_m2);
    let report = report(what, &label_file, &truth, &scored, table.as_ref());
    if let Some(path) = &json {
        let mut text = serde_json::to_string_pretty(&report).expect("plain numbers and texts");
        text.push('\n');
        write_atomically(path, text.as_bytes())?;
    }
    if let Some(path) = &picture {
        write_png(&draw(&truth, &labels, &scored), path)?;
    }
    Ok(Validated { report, files: json.into_iter().chain(picture.clone()).collect(), picture })
}

fn report(what: &Validation, label_file: &Path, truth: &Truth, scored: &Scored, table: Option<&GrainTable>) -> Report {
    let true_labels = truth.stone_of_triangle.iter().map(|&stone| i64::from(stone)).collect();
    let perfect = score(truth, &Labels::of_triangles(true_labels), what.min_area_m2).score;
    Report {
        scene: what.truth.display().to_string(),
        labels: label_file.display().to_string(),
        truth: what.rule,
        visible_area_m2: what.visible_area_m2,
        min_area_m2: what.min_area_m2,
        score: scored.score.clone(),
        astray: Astray::of(scored),
        ellipsoid: table.and_then(|table| table.ellipsoid(truth, scored)),
        fit: table.and_then(|table| table.fit(truth, scored)),
        reliability: table.and_then(|table| table.reliability(scored)),
        perfect_labels: Score { matched: Vec::new(), ..perfect },
    }
}

/// Refuses to write over what was read, under whatever name.
fn spare(inputs: &[PathBuf], output: Option<&Path>, what: &'static str) -> Result<(), ValidateError> {
    let Some(output) = output else { return Ok(()) };
    let Ok(real) = output.canonicalize() else { return Ok(()) };
    if inputs.iter().any(|input| input.canonicalize().is_ok_and(|input| input == real)) {
        return Err(ValidateError::OutputIsInput { path: output.to_owned(), what });
    }
    Ok(())
}
