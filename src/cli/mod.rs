//! The command line: what the user typed becomes a job, what the job says becomes bars, lines or JSON.

mod cost_table;
mod report;
mod validate_args;

pub use cost_table::cost_table;
pub use report::{report_error, reporter};
pub use validate_args::ValidateArgs;

use crate::settings::{Method, Settings, SettingsError, Unit};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  failed; earlier results are untouched
    2  the command line or the settings cannot be used
    3  done with losses: tiles failed, run.json names them
  130  interrupted";

const RUN_EXAMPLES: &str = "\
Examples:
  A drone survey in New Zealand, its mesh shifted to a local origin:
    gravelometer run reach.ply -o reach --config drone --crs EPSG:2193 --offset 1480000,5250000,700

  A sandbox scan in millimetres, stones of at least 1 cm² visible, with the labelled mesh:
    gravelometer run box.ply -o box --config sandbox --unit mm --min-grain-area 1e-4 --labelled-mesh

  All blocks of a folder, shifted as OpenDroneMap's coords.txt says, which names the CRS as well:
    gravelometer run blocks -o reach --config drone --offset-file odm_georeferencing/coords.txt

What is written to OUT:
  grains.gpkg        outlines, centres, oversize bodies, tiles, survey (open in QGIS)
  grains.csv         one row for each grain, units in the column names
  grain_size.tif     D16, D50, D84, D90, mean b axis, count, cover (Cloud-Optimised GeoTIFF)
  summary.json       counts and percentiles of the whole survey
  run.json           version, settings, inputs, warnings, lost tiles, CPU time of each stage, peak memory
  labelled_mesh.ply  with --labelled-mesh: the input, or the surface of a cloud, with a grain_id for each face
  labelled_cloud.laz with --labelled-cloud: the input points with a grain_id for each, -1 in no grain (also for points
                     at the very place of another one); of one LAS file in its own coordinates, else on the map

The grains do not depend on --tile-size, --threads and --memory, byte for byte; how the work was cut is in layer tiles
of grains.gpkg and in run.json.";

/// Every pebble of a gravel river bed, from a 3D survey.
#[derive(Debug, Parser)]
#[command(version, about, after_help = EXIT_CODES, propagate_version = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Find and measure every grain of a survey
    #[command(after_long_help = format!("{RUN_EXAMPLES}\n\n{EXIT_CODES}"))]
    Run(RunArgs),
    /// Say what a survey holds, what it can show and which settings suit it
    Inspect(InspectArgs),
    /// Make a sample scene with known pebbles, run on it, and say how many were found
    Demo(DemoArgs),
    /// Score a run against known stones: which were found, how well they are sized and laid
    #[command(after_long_help = validate_args::teaching())]
    Validate(ValidateArgs),
    /// Print the settings that a run would use, as a settings file
    Settings(SettingArgs),
}

/// How progress is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Log {
    /// Bars on a terminal, plain lines elsewhere
    Text,
    /// One JSON object a line
    Json,
}

/// Arguments of `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Files of one survey: triangle meshes (PLY) or point clouds (LAS, LAZ, COPC, PLY without faces); a folder, for all
    /// such files right in it; a pattern in quotes, such as "blocks/*.ply"; @LIST for a text file with one path on a line
    #[arg(required = true)]
    pub inputs: Vec<PathBuf>,
    /// Folder for the results; made if missing
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,
    /// Replace results that are in OUT
    #[arg(long)]
    pub force: bool,
    /// Go on where an interrupted run in OUT stopped (also after a crash or a full disk); begin if there is none
    #[arg(long)]
    pub resume: bool,
    /// Folder for the index and what else is needed again, about 55 bytes for each triangle; it is kept, so that
    /// later runs on the same survey with other settings are quicker [default: in OUT, removed at the end]
    #[arg(long, value_name = "DIR")]
    pub work_dir: Option<PathBuf>,
    /// How progress is told on standard error
    #[arg(long, value_enum, default_value = "text")]
    pub log: Log,
    /// Settings.
    #[command(flatten)]
    pub settings: SettingArgs,
}

/// Arguments that set parameters.
#[derive(Debug, Args, Default)]
pub struct SettingArgs {
    /// Settings file (TOML), or the name of a preset: default, sandbox, mast, drone, laser-scan,
    /// rheinwalt2025
    #[arg(long, value_name = "FILE", help_heading = "Settings")]
    pub config: Option<PathBuf>,
    /// Set any key of the settings file, such as valleys.valley_depth=0.05; may be given again
    #[arg(long, value_name = "SECTION.KEY=VALUE", help_heading = "Settings")]
    pub set: Vec<String>,
    /// Coordinate reference system: EPSG:n, WKT, or a file that holds WKT [input.crs; default: that of the offset file,
    /// else of a .prj file beside the input, else none]
    #[arg(long, value_name = "CRS", help_heading = "Coordinates")]
    pub crs: Option<String>,
    /// Shift added to the coordinates to reach the CRS, in its units [input.offset; default: 0,0,0]
    #[arg(long, value_name = "E,N[,Z]", allow_hyphen_values = true, value_parser = offset, help_heading = "Coordinates")]
    pub offset: Option<Offset>,
    /// File that holds the shift, and often the CRS: coords.txt of OpenDroneMap, PROJECT_offset.xyz of Pix4D, SHIFT.txt,
    /// or two or three plain numbers [input.offset_file; default: none]
    #[arg(long, value_name = "FILE", help_heading = "Coordinates")]
    pub offset_file: Option<PathBuf>,
    /// Unit of the input's coordinates; ft is the international foot, us-ft the US survey foot [input.unit; default:
    /// that of the CRS, metres without one]
    #[arg(long, value_enum, value_name = "UNIT", help_heading = "Coordinates")]
    pub unit: Option<Unit>,
    /// How stones are told apart: along valleys, or as published [segment.method; default: valleys]
    #[arg(long, value_enum, value_name = "METHOD", help_heading = "Grains")]
    pub method: Option<Method>,
    /// Widest grain, metres; wider bodies are no grains; 0: no limit [segment.max_grain_m;
    /// default: 2]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, help_heading = "Grains")]
    pub max_grain: Option<f64>,
    /// Smallest grain, m² of visible surface; on a coarse mesh never less than 50 mean triangles
    /// (segment.min_grain_triangles), which the run says [segment.min_grain_area_m2; default: 1e-4]
    #[arg(long, value_name = "M2", allow_negative_numbers = true, help_heading = "Grains")]
    pub min_grain_area: Option<f64>,
    /// Side of a tile's core, metres; 0: from the memory [work.tile_size_m; default: 0]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, help_heading = "Work")]
    pub tile_size: Option<f64>,
    /// Compute threads; 0: all cores [work.threads; default: 0]
    #[arg(long, value_name = "N", help_heading = "Work")]
    pub threads: Option<usize>,
    /// Most memory to use, such as 2GiB; empty or 0: half of what is there [work.memory; default: empty]
    #[arg(long, value_name = "SIZE", help_heading = "Work")]
    pub memory: Option<String>,
    /// Also write the input mesh, or the surface of a cloud, with a grain_id for each face [output.labelled_mesh; default:
    /// false]
    #[arg(long, help_heading = "Output")]
    pub labelled_mesh: bool,
    /// Also write the points of a cloud with a grain_id for each, as LAZ [output.labelled_cloud; default: false]
    #[arg(long, help_heading = "Output")]
    pub labelled_cloud: bool,
}

/// East, north and up shift, map units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Offset(pub [f64; 3]);

fn offset(text: &str) -> Result<Offset, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok([e, n]) => Ok(Offset([*e, *n, 0.0])),
        Ok([e, n, z]) => Ok(Offset([*e, *n, *z])),
        _ => Err("expected east,north or east,north,up, such as 1480000,5250000,700".into()),
    }
}

/// A number as TOML has it.
fn number(value: f64) -> String {
    if value.is_nan() { "nan".into() } else { format!("{value:?}") }
}

impl SettingArgs {
    /// Defaults, overlaid by the settings file, by `--set`, and by the other flags.
    ///
    /// # Errors
    /// Those of [`Settings::load`].
    pub fn settings(&self) -> Result<Settings, SettingsError> {
        let mut all = self.set.clone();
        let word = |text: &str| toml::Value::String(text.to_owned()).to_string();
        let mut set = |key: &str, value: Option<String>| all.extend(value.map(|v| format!("{key}={v}")));
        set("input.crs", self.crs.as_deref().map(word));
        set("input.offset", self.offset.map(|o| format!("{:?}", o.0)));
        let offset_file = self.offset_file.as_ref().map(|path| path.to_string_lossy());
        set("input.offset_file", offset_file.as_deref().map(word));
        set("input.unit", self.unit.and_then(|u| u.to_possible_value().map(|v| word(v.get_name()))));
        set("segment.method", self.method.and_then(|m| m.to_possible_value().map(|v| word(v.get_name()))));
        set("segment.max_grain_m", self.max_grain.map(number));
        set("segment.min_grain_area_m2", self.min_grain_area.map(number));
        set("work.tile_size_m", self.tile_size.map(number));
        set("work.threads", self.threads.map(|v| v.to_string()));
        set("work.memory", self.memory.as_deref().map(word));
        set("output.labelled_mesh", self.labelled_mesh.then(|| "true".into()));
        set("output.labelled_cloud", self.labelled_cloud.then(|| "true".into()));
        Settings::load(self.config.as_deref(), &all)
    }
}

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub struct InspectArgs {
    /// Files of one survey: triangle meshes (PLY) or point clouds (LAS, LAZ, COPC, PLY without faces); a folder, for all
    /// such files right in it; a pattern in quotes, such as "blocks/*.ply"; @LIST for a text file with one path on a line
    #[arg(required = true)]
    pub inputs: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Coordinate reference system: EPSG:n, WKT, or a file that holds WKT [default: that of the offset file, else of a
    /// .prj file beside the input, else none]
    #[arg(long, value_name = "CRS")]
    pub crs: Option<String>,
    /// Shift added to the coordinates to reach the CRS, in its units
    #[arg(long, value_name = "E,N[,Z]", allow_hyphen_values = true, value_parser = offset)]
    pub offset: Option<Offset>,
    /// File that holds the shift, and often the CRS: coords.txt of OpenDroneMap, PROJECT_offset.xyz of Pix4D, SHIFT.txt,
    /// or two or three plain numbers
    #[arg(long, value_name = "FILE")]
    pub offset_file: Option<PathBuf>,
    /// Unit of the input's coordinates; ft is the international foot, us-ft the US survey foot [default: that of the
    /// CRS, metres without one]
    #[arg(long, value_enum, value_name = "UNIT")]
    pub unit: Option<Unit>,
}

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Folder for the scene and the results
    #[arg(short, long, value_name = "OUT", default_value = "gravelometer-demo")]
    pub out: PathBuf,
    /// Seed of the scene
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Compute threads; 0: all cores
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Replace results that are in OUT
    #[arg(long)]
    pub force: bool,
    /// How progress is told on standard error
    #[arg(long, value_enum, default_value = "text")]
    pub log: Log,
}
