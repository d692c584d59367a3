//! Whole runs of the program over survey size, threads and memory, appended to a table. `--help` tells all.
//!
//! The beds are made here, from a seed: `bed` is the surface, `make` the file. `measure` runs the program and
//! reads what it says about its costs, `table` writes it down.
#![allow(missing_docs, clippy::unwrap_used)]

mod bed;
mod make;
mod measure;
mod random;
mod stones;
mod table;

use clap::Parser;
use measure::{Case, Figures};
use std::io::Result;
use std::path::{Path, PathBuf};

const HELP: &str = "\
Examples:
  The usual table, beds of 1 and 10 million triangles on 1 and 2 threads:
    tools/bench

  Does memory stay within bounds? 100 million triangles under two budgets, once each:
    tools/bench --sizes 100 --threads 2 --memory 512MiB,2GiB --repeats 1

  Does the order of the file matter?
    tools/bench --sizes 10 && tools/bench --sizes 10 --shuffle

  Only a bed (2 GB), and a table of its stones beside it, bed.csv:
    tools/bench --make bed.ply --millions 100

How to read the table:
  CPU is user and system time of all threads, to the hundredth of a second. Compare CPU, not wall time, where
  others use the machine too. The rate of a stage is triangles of the survey (whatever the stage itself counts)
  for each second of CPU. Peak memory is what was resident, mapped parts of the input included, which the
  system takes back when it needs to. Redundancy is triangles segmented for each triangle of the survey.
  Each figure is the median of its repeats; the cases take turns, so that a busy minute meets all of them.";

/// Times whole runs of gravelometer on beds made from a seed, and appends the figures to a table
#[derive(Debug, Parser)]
#[command(name = "tools/bench", after_help = HELP)]
struct Options {
    /// Sizes of the beds, millions of triangles
    #[arg(long, value_delimiter = ',', default_value = "1,10", value_parser = millions)]
    sizes: Vec<f64>,
    /// Numbers of compute threads
    #[arg(long, value_delimiter = ',', default_value = "1,2")]
    threads: Vec<usize>,
    /// Budgets for tiles in flight
    #[arg(long, value_delimiter = ',', default_value = "1GiB")]
    memory: Vec<String>,
    /// Runs of each case; the table has the median
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    repeats: u32,
    /// Settings file or preset
    #[arg(long, default_value = "configs/rheinwalt2025.toml")]
    config: String,
    /// Widest grain, metres. No stone of these beds is wider than 0.1. 0 is no limit, as in the preset, and makes
    /// the whole survey one tile, whatever the budget
    #[arg(long, default_value_t = 0.1)]
    max_grain: f64,
    /// Beds with vertices and triangles in random order
    #[arg(long)]
    shuffle: bool,
    /// Seed of the beds
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder where beds are kept, so that each is made once, and where runs write their results
    #[arg(long, default_value = "target/bench")]
    folder: PathBuf,
    /// Table to which a dated section is appended
    #[arg(long, default_value = "benches/results.md")]
    results: PathBuf,
    /// Only make a bed, in this file, and stop
    #[arg(long, value_name = "FILE")]
    make: Option<PathBuf>,
    /// Size of that bed, millions of triangles
    #[arg(long, default_value_t = 1.0, requires = "make", value_parser = millions)]
    millions: f64,
    /// Given by `cargo bench`, and only by it.
    #[arg(long, hide = true)]
    bench: bool,
}

fn millions(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(n) if n > 0.0 && n <= 2000.0 => Ok(n),
        _ => Err("expected millions of triangles, more than 0 and at most 2000".into()),
    }
}

fn main() -> Result<()> {
    let options = Options::parse();
    if let Some(path) = &options.make {
        return make(&options, options.millions, path);
    }
    if !options.bench {
        eprintln!("nothing measured: `cargo bench --bench survey` or tools/bench does");
        return Ok(());
    }
    let mut section = table::Section::begin(&options);
    for &size in &options.sizes {
        let order = if options.shuffle { "-shuffled" } else { "" };
        let name = format!("bed-{size}M-seed{}{order}", options.seed);
        let bed = options.folder.join(format!("{name}.ply"));
        if !bed.exists() {
            make(&options, size, &bed)?;
        }
        section.append(&options, &measured(&options, &bed)?)?;
    }
    eprintln!("appended to {}", options.results.display());
    Ok(())
}

fn make(options: &Options, size: f64, path: &Path) -> Result<()> {
    let began = std::time::Instant::now();
    let triangles = make::make(path, options.seed, (size * 1e6).round() as u64, options.shuffle)?;
    eprintln!("{}: {triangles} triangles in {:.1} s", path.display(), began.elapsed().as_secs_f64());
    Ok(())
}

/// All cases of one bed, each with the figures of its repeats.
fn measured(options: &Options, bed: &Path) -> Result<Vec<(Case, Vec<Figures>)>> {
    let mut rows = Vec::new();
    for memory in &options.memory {
        for &threads in &options.threads {
            let case = Case { bed: bed.to_owned(), threads, memory: memory.clone() };
            rows.push((case, Vec::new()));
        }
    }
    for repeat in 1..=options.repeats {
        for (case, figures) in &mut rows {
            let measured = case.run(options)?;
            eprintln!(
                "{}, {} threads, {}, {repeat} of {}: {:.2} s CPU, {:.2} s wall, {:.0} MiB, {} grains",
                case.bed_name(),
                case.threads,
                case.memory,
                options.repeats,
                measured.cpu_s,
                measured.wall_s,
                measured.peak_mib,
                measured.grains
            );
            figures.push(measured);
        }
    }
    Ok(rows)
}
