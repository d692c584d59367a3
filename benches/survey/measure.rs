//! One run of the program and what it cost, as it says itself in run.json.

use crate::Options;
use serde_json::Value;
use std::io::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// What is varied.
pub(crate) struct Case {
    /// The survey.
    pub(crate) bed: PathBuf,
    /// Compute threads.
    pub(crate) threads: usize,
    /// Budget for tiles, as the command line takes it.
    pub(crate) memory: String,
}

/// What a run cost.
#[derive(Clone)]
pub(crate) struct Figures {
    /// Triangles of the survey.
    pub(crate) triangles: u64,
    /// Grains found.
    pub(crate) grains: u64,
    /// Tiles.
    pub(crate) tiles: u64,
    /// CPU of the process from its start to its end, seconds.
    pub(crate) cpu_s: f64,
    /// The same by the clock.
    pub(crate) wall_s: f64,
    /// Most memory resident, MiB.
    pub(crate) peak_mib: f64,
    /// Triangles segmented for each of the survey.
    pub(crate) redundancy: f64,
    /// CPU seconds of each stage.
    pub(crate) stages: Vec<(String, f64)>,
}

impl Case {
    /// The bed's file name without its ending.
    pub(crate) fn bed_name(&self) -> String {
        self.bed.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Runs the program on the case.
    pub(crate) fn run(&self, options: &Options) -> Result<Figures> {
        let out = options.folder.join("results");
        let mut command = Command::new(env!("CARGO_BIN_EXE_gravelometer"));
        command.args(["run", "--force", "--config", &options.config, "--memory", &self.memory]);
        command.args(["--threads", &self.threads.to_string(), "--max-grain", &options.max_grain.to_string()]);
        command.arg("--out").arg(&out).arg(&self.bed);
        let (before_s, began) = (children_cpu_s(), Instant::now());
        let said = command.output()?;
        let (wall_s, after_s) = (began.elapsed().as_secs_f64(), children_cpu_s());
        if !said.status.success() {
            let why = String::from_utf8_lossy(&said.stderr).into_owned();
            return Err(Error::other(format!("{command:?} ended with {}:\n{why}", said.status)));
        }
        let figures = figures(&json(&out.join("run.json"))?, &json(&out.join("summary.json"))?, wall_s);
        let mut figures =
            figures.ok_or_else(|| Error::other("run.json lacks figures: does this system have /proc?"))?;
        // run.json is written before the program ends; what follows is in the time of the ended children.
        if let Some((before_s, after_s)) = before_s.zip(after_s) {
            figures.cpu_s = after_s - before_s;
        }
        Ok(figures)
    }
}

fn json(path: &Path) -> Result<Value> {
    Ok(serde_json::from_slice(&std::fs::read(path)?)?)
}

fn figures(run: &Value, summary: &Value, wall_s: f64) -> Option<Figures> {
    let facts = &run["facts"];
    let stage = |s: &Value| Some((s["name"].as_str()?.to_owned(), s["cpu_s"].as_f64()?));
    Some(Figures {
        triangles: facts["inputs"].as_array()?.iter().filter_map(|input| input["triangles"].as_u64()).sum(),
        grains: summary["grains"].as_u64()?,
        tiles: facts["tiles"].as_u64()?,
        cpu_s: run["cpu_s"].as_f64()?,
        wall_s,
        peak_mib: run["peak_memory_bytes"].as_u64()? as f64 / f64::from(1 << 20),
        redundancy: facts["segmented_per_triangle"].as_f64()?,
        stages: run["stages"].as_array()?.iter().map(stage).collect::<Option<_>>()?,
    })
}

/// CPU seconds of all children that have ended and been waited for: `cutime` and `cstime`, fields 16 and 17 of
/// proc_pid_stat(5), in hundredths of a second.
fn children_cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_ascii_whitespace().collect();
    let ticks = |field: usize| fields.get(field - 3)?.parse::<f64>().ok();
    Some((ticks(16)? + ticks(17)?) / 100.0)
}
