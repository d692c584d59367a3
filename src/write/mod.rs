//! Writing: results become files, all of them or none.
//!
//! | file | content |
//! |---|---|
//! | `grains.gpkg` | GeoPackage: layers `grains`, `grain_centres`, `oversize`, `tiles`, `survey` |
//! | `grains.csv` | the table of grains; the only columns are those of [`columns::COLUMNS`] |
//! | `grain_size.tif` | Cloud-Optimised GeoTIFF of grain sizes, count and cover |
//! | `labelled_mesh.ply` | on request: the input mesh with a `grain_id` per face and vertex |
//! | `labelled_cloud.laz` | on request: the input points with the grain of each |
//! | `summary.json` | counts, areas and percentiles |
//! | `run.json` | program, version, settings, what came in, what was refused, what each stage cost |

mod atomic;
pub mod columns;
mod csv;
mod error;
mod extra_bytes;
mod gdal_calls;
mod gdal_options;
mod gdal_watch;
mod geotiff;
mod gpkg;
mod json;
mod labelled_cloud;
#[cfg(test)]
mod labelled_cloud_tests;
mod labelled_mesh;
mod layers;
mod laz_stream;
mod source;
mod wkb;

pub use atomic::{OUTPUTS, OutputFolder, REPORT, SCORES};
pub use error::WriteError;
pub use labelled_mesh::MeshSource;
pub use source::WholeMesh;

use crate::geometry::PlanBox;
use crate::index::Scale;
use crate::open::{Frame, Reach};
use crate::settings::Settings;
use crate::statistics::{Areas, GrainSizeRaster, Summary};
use crate::stitch::{Catalogue, TileReport};
use crate::store::fail_point;
use atomic::Pending;
use std::path::PathBuf;

/// Everything that a run found, ready to be written.
#[derive(Clone, Copy)]
pub struct Results<'a> {
    /// How local and map coordinates hang together.
    pub frame: &'a Frame,
    /// The settings of the run.
    pub settings: &'a Settings,
    /// The survey's scale.
    pub scale: &'a Scale,
    /// Boxes in plan, local metres, that hold all of the survey and little else.
    pub surveyed: &'a [PlanBox],
    /// Grains and oversize bodies. For a labelled mesh the grains carry their triangles.
    pub catalogue: &'a Catalogue,
    /// How each tile was worked.
    pub tiles: &'a [TileReport],
    /// Smallest visible surface of a grain that was held against the segments, m².
    pub smallest_grain_area_m2: f64,
    /// What else belongs into `run.json`: input files, what was refused or lost.
    pub facts: &'a serde_json::Value,
    /// What the run has cost so far, for `run.json`: an object, asked for when that file is written.
    pub costs: &'a (dyn Fn() -> serde_json::Value + Sync),
    /// The input's surface, if it or the points are to be written again with labels.
    pub mesh: Option<&'a dyn MeshSource>,
    /// The points, if they are to be written again with labels.
    pub cloud: Option<&'a Reach>,
}

impl Results<'_> {
    /// The files that are written, in order.
    pub(crate) fn names(&self) -> Vec<&'static str> {
        let is_wanted = |name: &&str| match *name {
            "labelled_mesh.ply" => self.mesh.is_some() && (self.settings.output.labelled_mesh || self.cloud.is_none()),
            "labelled_cloud.laz" => self.cloud.is_some() && self.mesh.is_some(),
            _ => true,
        };
        OUTPUTS.into_iter().filter(is_wanted).collect()
    }
}

/// Writes all results and returns their paths. `progress` hears the name of each file before it is written.
///
/// # Errors
/// Anything that keeps a file from being complete; then none of the final names has been touched, except
/// where renaming itself fails.
pub fn write_all(out: &OutputFolder, results: &Results, progress: &dyn Fn(&str)) -> Result<Vec<PathBuf>, WriteError> {
    out.publish(write_unnamed(out, results, progress)?)
}

/// Writes all results to the disk, but not yet under their final names.
pub(crate) fn write_unnamed(
    out: &OutputFolder,
    results: &Results,
    progress: &dyn Fn(&str),
) -> Result<Vec<Pending>, WriteError> {
    let raster = GrainSizeRaster::new(
        results.catalogue,
        results.frame,
        results.scale,
        &results.settings.raster,
        results.surveyed,
    )?;
    let areas = Areas { smallest_grain_m2: results.smallest_grain_area_m2, covered_m2: raster.covered_area_m2 };
    let summary = Summary::new(results.catalogue, results.settings, results.scale, &areas);
    let names = results.names();
    let mut written = Vec::with_capacity(names.len());
    for &name in &names {
        progress(name);
        let file = out.begin(name)?;
        match (name, results.mesh) {
            ("grains.gpkg", _) => gpkg::write(&file, results)?,
            ("grains.csv", _) => csv::write(&file, results)?,
            ("grain_size.tif", _) => geotiff::write(&file, results, &raster, &summary)?,
            ("labelled_mesh.ply", Some(mesh)) => labelled_mesh::write(&file, results, mesh)?,
            ("labelled_cloud.laz", Some(mesh)) => labelled_cloud::write(&file, results, mesh)?,
            ("summary.json", _) => json::write_summary(&file, &summary)?,
            _ => json::write_run(&file, results, &names)?,
        }
        written.push(file);
    }
    fail_point("results.before_sync");
    written.iter().try_for_each(Pending::sync)?;
    Ok(written)
}
