//! The program: parse, run, say what went wrong, exit.

use clap::Parser;
use gravelometer::cli::{Cli, Command, DemoArgs, InspectArgs, RunArgs, SettingArgs, reporter};
use gravelometer::demo::{Demonstration, demonstrate};
use gravelometer::error::{Error, ExitCode};
use gravelometer::pipeline::Control;
use gravelometer::run::{Job, run};
use gravelometer::settings::InputSettings;

fn main() -> std::process::ExitCode {
    let result = match Cli::parse().command {
        Command::Run(args) => run_command(&args),
        Command::Inspect(args) => inspect_command(&args),
        Command::Demo(args) => demo_command(&args),
        Command::Settings(args) => settings_command(&args),
    };
    let code = result.unwrap_or_else(|error| {
        eprintln!("error: {error}");
        error.exit_code()
    });
    std::process::ExitCode::from(code as u8)
}

/// The flag that Ctrl-C sets. A second Ctrl-C ends the process at once.
fn control() -> Control {
    let control = Control::default();
    let flag = control.clone();
    let set = ctrlc::set_handler(move || {
        if flag.cancel() {
            std::process::exit(ExitCode::Interrupted as i32);
        }
        eprintln!("stopping after the tiles in flight; press Ctrl-C again to stop at once");
    });
    if let Err(error) = set {
        eprintln!("warning: Ctrl-C will end the run at once: {error}");
    }
    control
}

fn run_command(args: &RunArgs) -> Result<ExitCode, Error> {
    let settings = args.settings.settings()?;
    let job = Job { inputs: args.inputs.clone(), out: args.out.clone(), settings, force: args.force };
    let progress = reporter(args.log);
    let outcome = run(&job, &*progress, &control())?;
    progress.note(&format!(
        "{} grains and {} oversize bodies in {}; {:.2} triangles segmented for each of the survey",
        outcome.catalogue.grains.len(),
        outcome.catalogue.oversize.len(),
        job.out.display(),
        outcome.segmented_per_triangle
    ));
    if outcome.lost.is_empty() {
        return Ok(ExitCode::Done);
    }
    progress.warn(&format!("{} tiles were lost; run.json names them", outcome.lost.len()));
    Ok(ExitCode::DoneWithLosses)
}

fn inspect_command(args: &InspectArgs) -> Result<ExitCode, Error> {
    let input = InputSettings {
        unit: args.unit.unwrap_or_default(),
        crs: args.crs.clone().unwrap_or_default(),
        offset: args.offset.map_or([0.0; 3], |o| o.0),
    };
    let inspection = gravelometer::inspect::inspect(&args.inputs, &input)?;
    if args.json {
        println!("{}", serde_json::to_string_pretty(&inspection).expect("plain numbers and texts"));
    } else {
        println!("{inspection}");
    }
    Ok(ExitCode::Done)
}

fn settings_command(args: &SettingArgs) -> Result<ExitCode, Error> {
    let settings = args.settings()?;
    print!("{}", toml::to_string(&settings).expect("plain numbers and texts"));
    Ok(ExitCode::Done)
}

fn demo_command(args: &DemoArgs) -> Result<ExitCode, Error> {
    let what = Demonstration { out: args.out.clone(), seed: args.seed, threads: args.threads, force: args.force };
    let progress = reporter(args.log);
    let shown = demonstrate(&what, &*progress, &control())?;
    println!("{}", shown.score);
    println!("\nThe scene, what is in it, and the results:");
    for file in shown.files.iter().chain(&shown.outcome.files) {
        println!("  {}", file.display());
    }
    println!("Look at grains.png (true stones outlined in black), or open grains.gpkg in QGIS.");
    Ok(if shown.outcome.lost.is_empty() { ExitCode::Done } else { ExitCode::DoneWithLosses })
}
