//! The divergence of the whole survey: what the published method needs before any grain can be told.

use crate::curvature::{InstructionSet, Stencil};
use crate::cuts::curvature_core;
use crate::error::Error;
use crate::index::Index;
use crate::open::Reach;
use crate::passes::Survey;
use crate::pipeline::{Crew, LostJob};
use crate::progress::Progress;
use crate::resume::{Curvature, WorkFolder};
use crate::settings::Settings;
use crate::store::Column;
use crate::tile::Plan;

/// The divergence at every vertex, on disk.
pub struct Divergence {
    curvature: Curvature,
    /// Mean distance from a vertex to the nearest triangle centroid, m.
    pub spacing_m: f64,
    /// Triangles loaded for it for each triangle of the tiles that were not known: what halos cost.
    pub loaded_per_triangle: Option<f64>,
}

impl Divergence {
    /// Computes what is not known yet, tile by tile. `memory` in bytes.
    ///
    /// # Errors
    /// The disk says no, a tile is lost, or the run was interrupted.
    pub fn of(
        (reach, index): (&Reach, &Index),
        work: &WorkFolder,
        settings: &Settings,
        (crew, instructions, memory): (&Crew, InstructionSet, u64),
        progress: &dyn Progress,
    ) -> Result<Divergence, Error> {
        let mut curvature = work.curvature(reach, index, settings)?;
        let core = curvature_core(index, settings, crew.pool.current_num_threads(), memory);
        let plan = Plan::new(index, curvature.core(core)?);
        let survey = Survey { index, plan: &plan, instructions };
        let spacing_m = curvature.spacing_m(|| spacing_m(&survey, crew, progress))?;
        let stencil = Stencil::new(spacing_m, index.scale.mean_triangle_area_m2, &settings.curvature);
        let jobs = curvature.missing(index, &plan)?;
        let (mut loaded, mut owned) = (0, 0);
        let lost = survey.divergence(crew, &jobs, &stencil, progress, |job, core| {
            loaded += core.loaded;
            owned += survey.owned_triangles(job);
            curvature.add(plan.tiles[job].id, &core.runs, &core.values)
        })?;
        none_lost("curvature", lost)?;
        curvature.sync()?;
        let loaded_per_triangle = (owned > 0).then(|| loaded as f64 / owned as f64);
        Ok(Divergence { curvature, spacing_m, loaded_per_triangle })
    }

    /// By vertex, 1/m.
    pub fn column(&self) -> &Column<f64> {
        self.curvature.divergence()
    }
}

fn spacing_m(survey: &Survey, crew: &Crew, progress: &dyn Progress) -> Result<f64, Error> {
    let (spacing_m, lost) = survey.spacing(crew, progress)?;
    none_lost("spacing", lost)?;
    if spacing_m > 0.0 { Ok(spacing_m) } else { Err(Error::NoSpacing) }
}

/// A pass on which everything depends: none of its tiles may be lost.
fn none_lost(pass: &'static str, lost: Vec<LostJob>) -> Result<(), Error> {
    match lost.into_iter().next() {
        Some(lost) => Err(Error::TileFailed { pass, lost }),
        None => Ok(()),
    }
}
