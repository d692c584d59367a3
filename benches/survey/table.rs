//! The table: a dated section for each bench, one row for each case, never overwritten. The rows of a bed are
//! appended when it is done, so that an interrupted bench keeps those that were.

use crate::Options;
use crate::measure::{Case, Figures};
use gravelometer::curvature::InstructionSet;
use std::fmt::Write as _;
use std::io::{Result, Write};
use std::process::Command;

const HEAD: &str = "\
# Whole runs

Made by `tools/bench`, which appends and never overwrites; `tools/bench --help` says how to read it. Every figure is
a median; rates are millions of survey triangles for each second of CPU.
";

type Row = (Case, Vec<Figures>);

/// A section that grows.
pub(crate) struct Section {
    /// What comes before its first row: the time and the commit at which the bench began.
    heading: Option<String>,
    /// Columns of stages, known from the first run.
    stages: Vec<String>,
}

impl Section {
    /// Of a bench that begins.
    pub(crate) fn begin(options: &Options) -> Section {
        Section { heading: Some(heading(options)), stages: Vec::new() }
    }

    /// Appends the rows of one bed.
    pub(crate) fn append(&mut self, options: &Options, rows: &[Row]) -> Result<()> {
        let mut file = std::fs::OpenOptions::new().append(true).create(true).open(&options.results)?;
        let mut text = String::new();
        if let (Some(heading), Some((_, figures))) = (self.heading.take(), rows.first()) {
            self.stages = figures[0].stages.iter().map(|(name, _)| name.clone()).collect();
            let head = if file.metadata()?.len() == 0 { HEAD } else { "" };
            text = format!("{head}\n{heading}{}", columns(&self.stages));
        }
        for row in rows {
            let _ = writeln!(text, "| {} |", cells(row, rows, &self.stages).join(" | "));
        }
        file.write_all(text.as_bytes())?;
        file.sync_all()
    }
}

fn heading(options: &Options) -> String {
    format!(
        "## {}\n\n* {}, {} cores, {:?}\n* gravelometer {}, commit {}\n\
         * settings `{}`, max_grain_m {}; {} runs of each\n\n",
        said("date", &["-u", "+%Y-%m-%d %H:%M UTC"]),
        processor(),
        std::thread::available_parallelism().map_or(0, usize::from),
        InstructionSet::best(),
        env!("CARGO_PKG_VERSION"),
        commit(),
        options.config,
        options.max_grain,
        options.repeats,
    )
}

fn columns(stages: &[String]) -> String {
    let before = ["bed", "triangles", "grains", "tiles", "threads", "budget", "CPU s", "us/triangle"];
    let after = ["peak MiB", "wall s", "speed-up", "redundancy"];
    let names: Vec<String> = before
        .iter()
        .map(|&name| name.to_owned())
        .chain(stages.iter().map(|stage| format!("{stage} M/s")))
        .chain(after.iter().map(|&name| name.to_owned()))
        .collect();
    format!("| {} |\n|---{}|\n", names.join(" | "), "|---:".repeat(names.len() - 1))
}

fn cells((case, figures): &Row, rows: &[Row], stages: &[String]) -> Vec<String> {
    let any = &figures[0];
    let (cpu_s, wall_s) = (median(figures, |f| f.cpu_s), median(figures, |f| f.wall_s));
    let mut cells = vec![
        case.bed_name(),
        any.triangles.to_string(),
        any.grains.to_string(),
        any.tiles.to_string(),
        case.threads.to_string(),
        case.memory.clone(),
        format!("{cpu_s:.2}"),
        format!("{:.3}", cpu_s * 1e6 / any.triangles as f64),
    ];
    for stage in stages {
        let of_stage = |f: &Figures| f.stages.iter().find(|(name, _)| name == stage).map_or(f64::NAN, |(_, s)| *s);
        // A stage below the clock's hundredth has no rate.
        let stage_s = median(figures, of_stage);
        cells.push(if stage_s >= 0.01 { format!("{:.2}", any.triangles as f64 / stage_s / 1e6) } else { "-".into() });
    }
    let alone = rows.iter().find(|(c, _)| c.threads == 1 && c.bed == case.bed && c.memory == case.memory);
    cells.push(format!("{:.0}", median(figures, |f| f.peak_mib)));
    cells.push(format!("{wall_s:.2}"));
    cells.push(alone.map_or("-".into(), |(_, f)| format!("{:.2}", median(f, |f| f.wall_s) / wall_s)));
    cells.push(format!("{:.2}", median(figures, |f| f.redundancy)));
    cells
}

fn median(figures: &[Figures], of: impl Fn(&Figures) -> f64) -> f64 {
    let mut values: Vec<f64> = figures.iter().map(of).collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) / 2.0 }
}

/// What a command prints, or that it is unknown: a table without a commit is better than none.
fn said(program: &str, args: &[&str]) -> String {
    let output = Command::new(program).args(args).output().ok().filter(|o| o.status.success());
    output.map_or("unknown".into(), |o| String::from_utf8_lossy(&o.stdout).trim().to_owned())
}

/// The commit, and whether the sources differ from it. That this table has grown is no difference.
fn commit() -> String {
    let differs = Command::new("git").args(["diff", "--quiet", "HEAD", "--", ".", ":!benches/results.md"]).status();
    let dirty = if differs.is_ok_and(|status| status.code() == Some(1)) { "-dirty" } else { "" };
    said("git", &["rev-parse", "--short", "HEAD"]) + dirty
}

fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = text.lines().find(|line| line.starts_with("model name"));
    line.and_then(|line| line.split_once(": ")).map_or("unknown processor".into(), |(_, name)| name.trim().to_owned())
}
