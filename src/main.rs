//! The program: parse, run, say what went wrong, exit.

use clap::Parser;
use gravelometer::cli::{Cli, Command, DemoArgs, InspectArgs, Log, RunArgs, SettingArgs, ValidateArgs};
use gravelometer::cli::{cost_table, report_error, reporter};
use gravelometer::demo::{Demonstration, demonstrate};
use gravelometer::error::{Error, ExitCode};
use gravelometer::pipeline::{Cancelled, Control, Interrupted, share_one_heap};
use gravelometer::progress::Progress;
use gravelometer::run::{Job, is_done, run};
use gravelometer::settings::{InputSettings, Method};
use gravelometer::validate::{Shown, Validated, validate};
use std::io::Write;
use std::time::Duration;

fn main() -> std::process::ExitCode {
    share_one_heap();
    let (log, result) = match Cli::parse().command {
        Command::Run(args) => (args.log, run_command(&args)),
        Command::Inspect(args) => (Log::Text, inspect_command(&args)),
        Command::Demo(args) => (args.log, demo_command(&args)),
        Command::Validate(args) => (Log::Text, validate_command(&args)),
        Command::Settings(args) => (Log::Text, settings_command(&args)),
    };
    let code = result.unwrap_or_else(|error| {
        report_error(log, &error);
        error.exit_code()
    });
    std::process::ExitCode::from(code as u8)
}

/// Time for a run that was interrupted to end by itself.
const GRACE: Duration = Duration::from_millis(1200);

/// The flag that Ctrl-C sets. A run that does not heed it soon is ended.
fn control(progress: &dyn Progress, log: Log) -> Control {
    let control = Control::default();
    let flag = control.clone();
    let set = ctrlc::set_handler(move || {
        match flag.cancel() {
            Cancelled::Work => {}
            Cancelled::Before => std::process::exit(ExitCode::Interrupted as i32),
            Cancelled::TooLate => return,
        }
        // What is kept on disk is whole at any moment, so a tile in flight need not be waited for.
        std::thread::sleep(GRACE);
        report_error(log, &Error::Interrupted(Interrupted));
        std::process::exit(ExitCode::Interrupted as i32);
    });
    if let Err(error) = set {
        progress.warn(&format!("Ctrl-C will end the run at once: {error}"));
    }
    control
}

fn run_command(args: &RunArgs) -> Result<ExitCode, Error> {
    let settings = args.settings.settings()?;
    let job = Job {
        inputs: args.inputs.clone(),
        out: args.out.clone(),
        settings,
        force: args.force,
        resume: args.resume,
        work: args.work_dir.clone(),
    };
    let progress = reporter(args.log);
    if is_done(&job)? {
        progress.note(&format!("{} holds the results of this run: nothing is left to do", job.out.display()));
        return Ok(ExitCode::Done);
    }
    let outcome = run(&job, &*progress, &control(&*progress, args.log))?;
    if args.log == Log::Text {
        progress.note(&cost_table(&outcome.costs, outcome.triangles));
    }
    progress.note(&format!(
        "{} grains{} in {}; halos included, {:.2} triangles were segmented for each of the survey{}",
        outcome.catalogue.grains.len(),
        match job.settings.segment.method {
            // What is too wide is not told from sand.
            Method::Valleys => String::new(),
            Method::Rheinwalt2025 => format!(" and {} oversize bodies", outcome.catalogue.oversize.len()),
        },
        job.out.display(),
        outcome.segmented_per_triangle,
        outcome.curvature_per_triangle.map_or_else(String::new, |n| format!(", and {n:.2} looked at for curvature"))
    ));
    if let Some([by_number, by_grid]) = outcome.b_axis_mm() {
        let sizes = |[d16, d50, d84]: [f64; 3]| format!("D16 {d16:.1} mm, D50 {d50:.1} mm, D84 {d84:.1} mm");
        progress.note(&format!("b axis, each grain counted once: {}; summary.json has more", sizes(by_number)));
        progress.note(&format!("b axis, as a pebble count at the knots of a grid finds it: {}", sizes(by_grid)));
    }
    if outcome.lost.is_empty() {
        return Ok(ExitCode::Done);
    }
    progress.warn(&format!(
        "{} tiles were lost; run.json names them, and the same command with --resume tries them again",
        outcome.lost.len()
    ));
    Ok(ExitCode::DoneWithLosses)
}

fn inspect_command(args: &InspectArgs) -> Result<ExitCode, Error> {
    let input = InputSettings {
        unit: args.unit.unwrap_or_default(),
        crs: args.crs.clone().unwrap_or_default(),
        offset: args.offset.map_or([0.0; 3], |o| o.0),
        offset_file: args.offset_file.as_ref().map_or_else(String::new, |path| path.to_string_lossy().into_owned()),
        ..InputSettings::default()
    };
    let inspection = gravelometer::inspect::inspect(&args.inputs, &input)?;
    if args.json {
        print(&serde_json::to_string_pretty(&inspection).expect("plain numbers and texts"));
    } else {
        print(&inspection.to_string());
    }
    Ok(ExitCode::Done)
}

fn settings_command(args: &SettingArgs) -> Result<ExitCode, Error> {
    let settings = args.settings()?;
    print(&settings.printed().expect("plain numbers and texts"));
    Ok(ExitCode::Done)
}

fn demo_command(args: &DemoArgs) -> Result<ExitCode, Error> {
    let what = Demonstration { out: args.out.clone(), seed: args.seed, threads: args.threads, force: args.force };
    let progress = reporter(args.log);
    let shown = demonstrate(&what, &*progress, &control(&*progress, args.log))?;
    print(&shown.score.to_string());
    print("\nThe scene, what is in it, and the results:");
    for file in shown.files.iter().chain(&shown.outcome.files) {
        print(&format!("  {}", file.display()));
    }
    print("Look at grains.png (true stones outlined in black), or open grains.gpkg in QGIS.");
    Ok(if shown.outcome.lost.is_empty() { ExitCode::Done } else { ExitCode::DoneWithLosses })
}

fn validate_command(args: &ValidateArgs) -> Result<ExitCode, Error> {
    let Validated { report, files, picture } = validate(&args.validation())?;
    print(&report.to_string());
    if !files.is_empty() {
        print("");
    }
    files.iter().for_each(|file| print(&file.display().to_string()));
    if picture.is_some() {
        let colors = Shown::ALL.map(Shown::legend).map(|(color, meaning)| format!("  {color:<13} {meaning}\n"));
        print(&format!("Colours of the picture, with the true stones outlined in black:\n{}", colors.concat()));
    }
    Ok(ExitCode::Done)
}

/// A text on standard output. That nobody reads it (`| head`) is no failure; a full disk is.
fn print(text: &str) {
    let written = writeln!(std::io::stdout().lock(), "{}", text.trim_end_matches('\n'));
    if let Err(error) = written
        && error.kind() != std::io::ErrorKind::BrokenPipe
    {
        let _ = writeln!(std::io::stderr().lock(), "error: cannot write to standard output: {error}");
        std::process::exit(ExitCode::Failed as i32);
    }
}
