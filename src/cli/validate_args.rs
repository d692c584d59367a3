//! The command line of `validate`.

use crate::validate::{Shown, TruthRule, Validation};
use clap::Args;
use std::path::PathBuf;

/// What is said behind the options.
pub(super) fn teaching() -> String {
    let legend: String = Shown::ALL
        .into_iter()
        .map(|shown| {
            let (color, meaning) = shown.legend();
            format!("  {color:<13} {meaning}\n")
        })
        .collect();
    format!("{TEACHING}{legend}  black lines   outlines of the true stones")
}

const TEACHING: &str = "\
Example:
  gravelometer run scene/mesh.ply -o found --min-grain-area 1e-4 --labelled-mesh
  gravelometer validate found scene

What TRUTH holds:
  mesh.ply    the surface that was segmented, metres
  truth.npz   of NumPy, one int32 for each triangle of the mesh, in its order:
    tri_id      the stone of the triangle, the row of truth.csv from 0; -1: sand
    tri_strict  optional: the same without the rims of stones; -2: a membrane over space that no camera saw
  truth.csv   one row for each stone, also hidden ones:
    A,B,C              needed: full lengths along the axes of the whole stone, m (bounding box of its full model)
    visible            1: the stone counts, 0: too little of it shows; without this column all stones count
    component_area     largest area of the stone that hangs together in the mesh, m², for --visible-area
    cut                1: the border of the scene cuts the stone: found or not, but neither its size nor its attitude
    r00,r01,...,r22    unit vectors along A (r00,r01,r02), B and C, for the orientation
    ref                number of a reference pebble, from 1, that is listed by itself; 0: none
    represented_ratio  share of the stone's whole surface that is in the mesh, 0 to 1
    radius             of a calibration ball, m: a sphere is fitted to its grain
    id                 if there, the number of the row, from 0
  From labels of each triangle, in a list: numpy.savez('truth.npz', tri_id=numpy.array(labels, 'int32'))

How stones are counted (Rheinwalt, Purinton & Bookhagen 2025):
  by majority  found if some grain is mostly the stone; further such grains are over-segmentation (false), grains that are
               mostly sand are false, a missed stone of which another grain holds a quarter is under-segmentation
  by overlap   found if intersection over union of the areas of grain and stone is 0.5 or more
  Grains on hidden stones, or on membranes over unseen space, are held against nobody. Where only some stones are known,
  give all other ground one more row of truth.csv, with visible 0.
  `true labels would give`: the same scores for the truth itself, measured in the same way. Stones are partly buried and
  meshes are smooth, so that these have errors of size and attitude too, for which no segmentation is to blame.

Colours of the picture:
";

/// Arguments of `validate`.
#[derive(Debug, Args)]
pub struct ValidateArgs {
    /// Output folder of a run with --labelled-mesh; or labels by themselves: .npy with a whole number for each triangle or
    /// vertex (negative: no grain), or PLY whose faces or vertices have a number called segment, label, grain_id, segment_id,
    /// grain, instance, instance_id or id
    pub run: PathBuf,
    /// Folder of the known stones: mesh.ply, truth.npz, truth.csv
    pub truth: PathBuf,
    /// Which triangles belong to a stone
    #[arg(long = "truth", value_enum, default_value = "best", id = "rule", value_name = "RULE")]
    pub rule: TruthRule,
    /// The label 0 is no grain, as in label files that know no negative numbers
    #[arg(long)]
    pub zero_is_none: bool,
    /// Stones count from this connected area in the mesh on, m², in place of those that truth.csv calls visible
    #[arg(long, value_name = "M2", value_parser = area)]
    pub visible_area: Option<f64>,
    /// Grains smaller than this are not looked at, m²
    #[arg(long, value_name = "M2", default_value_t = 0.0, value_parser = area)]
    pub min_area: f64,
    /// Write all scores as JSON [default: validation.json in RUN, if that is a folder]
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Draw found, missed, split and merged stones from above, as PNG [default: validation.png in RUN, if that is a folder]
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
}

/// An area of 0 or more, m².
fn area(text: &str) -> Result<f64, String> {
    let area: f64 = text.parse().map_err(|_| "is no number".to_owned())?;
    if area.is_finite() && area >= 0.0 { Ok(area) } else { Err("must be 0 or more, m²".to_owned()) }
}

impl ValidateArgs {
    /// What they ask for.
    pub fn validation(&self) -> Validation {
        Validation {
            run: self.run.clone(),
            truth: self.truth.clone(),
            rule: self.rule,
            zero_is_none: self.zero_is_none,
            visible_area_m2: self.visible_area,
            min_area_m2: self.min_area,
            json: self.json.clone(),
            picture: self.picture.clone(),
        }
    }
}
