//! The surface of a survey: of meshes as it is, several files welded into one; of point clouds as it is laid over them.

use crate::error::Error;
use crate::forecast;
use crate::open::{DrapedCloud, OpenError, Reach, Surface};
use crate::pipeline::{Control, return_free_memory};
use crate::progress::{Progress, Unit};
use crate::settings::Settings;
use crate::store::Shelf;
use crate::triangulate::{DrapeError, DrapeFigures, drape};
use crate::weld::{self, WeldFacts, Welded, parts, weld};

/// The surface of a survey.
#[derive(Debug)]
pub enum WholeSurface<'a> {
    /// Of meshes, and what welding them gave.
    Mesh(Welded<'a>, Option<WeldFacts>),
    /// Of point clouds, and what became of their points.
    Cloud(DrapedCloud<'a>, DrapeFigures),
}

/// Coordinates that step by more than so many distances between points are no places of points any more. Points on an
/// exact grid step by one.
const COARSEST_STEP_IN_SPACINGS: f64 = 2.0;

fn check_steps(reach: &Reach, spacing_m: f64) -> Result<(), OpenError> {
    for file in reach.files() {
        let step_m = file.coordinate_step().unwrap_or(0.0) * reach.frame().metres_per_input_unit;
        if step_m > COARSEST_STEP_IN_SPACINGS * spacing_m {
            return Err(OpenError::CloudStep { path: file.path().display().to_string(), step_m, spacing_m });
        }
    }
    Ok(())
}

/// Triangles that a cloud will have at most: each point has two.
pub fn triangles_to_expect(reach: &Reach) -> u64 {
    if reach.is_cloud() { 2 * reach.vertices() } else { reach.triangles() }
}

impl<'a> WholeSurface<'a> {
    /// The surface of a survey, in about `room` bytes, on all threads of the pool in which this runs.
    ///
    /// # Errors
    /// Files hold the same ground, the cloud has no surface, the memory is too small, or the disk says no.
    pub fn of(
        reach: &'a Reach,
        settings: &Settings,
        (shelf, room): (&Shelf, u64),
        (progress, control): (&dyn Progress, &Control),
    ) -> Result<WholeSurface<'a>, Error> {
        if !reach.is_cloud() {
            return welded(reach, settings.input.weld_m, forecast::weld_bytes(reach, room), progress);
        }
        progress.begin("surface", reach.vertices(), Unit::Vertices);
        let tell = |points| {
            progress.advance(points);
            control.check().map_err(|_| DrapeError::Stopped)
        };
        let draped = drape(reach, &|point| !reach.is_skipped(point), &settings.surface, (shelf, room), &tell);
        control.check()?;
        if let Err(DrapeError::NoTriangles { typical_m, .. }) = draped {
            check_steps(reach, typical_m)?;
        }
        let draped = draped?;
        reach.release();
        return_free_memory();
        progress.end();
        check_steps(reach, draped.figures.spacing_m)?;
        if settings.input.unit == crate::settings::Unit::Auto {
            let warning = reach.looks_like_millimetres(draped.figures.spacing_m);
            warning.iter().for_each(|warning| progress.warn(&warning.to_string()));
        }
        Ok(WholeSurface::Cloud(DrapedCloud::new(reach, &draped.triangles, draped.wide)?, draped.figures))
    }

    /// What is indexed.
    pub fn surface(&self) -> &dyn Surface {
        match self {
            WholeSurface::Mesh(welded, _) => welded,
            WholeSurface::Cloud(cloud, _) => cloud,
        }
    }

    /// The cloud and its triangles, if it is one.
    pub fn cloud(&self) -> Option<&DrapedCloud<'a>> {
        match self {
            WholeSurface::Mesh(..) => None,
            WholeSurface::Cloud(cloud, _) => Some(cloud),
        }
    }

    /// What became of the points of a cloud.
    pub fn figures(&self) -> Option<DrapeFigures> {
        match self {
            WholeSurface::Mesh(..) => None,
            WholeSurface::Cloud(_, figures) => Some(*figures),
        }
    }

    /// What welding meshes gave; none of a single file.
    pub fn weld_facts(&self) -> Option<&WeldFacts> {
        match self {
            WholeSurface::Mesh(_, facts) => facts.as_ref(),
            WholeSurface::Cloud(..) => None,
        }
    }

    /// Memory that knowing which vertices were welded takes, bytes.
    pub fn welded_bytes(&self) -> u64 {
        match self {
            WholeSurface::Mesh(welded, _) => welded.bytes(),
            WholeSurface::Cloud(..) => 0,
        }
    }
}

/// Meshes as one surface. Says nothing of a single one.
fn welded<'a>(
    reach: &'a Reach,
    weld_m: f64,
    room_bytes: u64,
    progress: &dyn Progress,
) -> Result<WholeSurface<'a>, Error> {
    let several = reach.files().len() > 1;
    if several {
        progress.begin("weld", reach.triangles(), Unit::Triangles);
    }
    let done = weld(reach, weld_m, room_bytes);
    if several {
        progress.advance(reach.triangles());
        progress.end();
    }
    let (welded, facts) = done?;
    Ok(WholeSurface::Mesh(welded, facts))
}

/// Says what welding gave, and returns what is odd about it.
pub fn tell_of_weld(reach: &Reach, facts: Option<&WeldFacts>, progress: &dyn Progress) -> Vec<String> {
    let Some(facts) = facts else { return Vec::new() };
    progress.note(&facts.summary());
    let warnings: Vec<String> = weld::warnings(facts, &parts(reach)).iter().map(ToString::to_string).collect();
    warnings.iter().for_each(|w| progress.warn(w));
    warnings
}
