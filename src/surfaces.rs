//! The surface of a survey: of meshes as it is, of point clouds as it is laid over them.

use crate::error::Error;
use crate::open::{DrapedCloud, Reach, Surface};
use crate::pipeline::return_free_memory;
use crate::progress::{Progress, Unit};
use crate::settings::Settings;
use crate::store::Shelf;
use crate::triangulate::{DrapeFigures, drape};

/// The surface of a survey.
#[derive(Debug)]
pub enum WholeSurface<'a> {
    /// Of meshes.
    Mesh(&'a Reach),
    /// Of point clouds, and what became of their points.
    Cloud(DrapedCloud<'a>, DrapeFigures),
}

/// Triangles that a cloud will have at most: each point has two.
pub fn triangles_to_expect(reach: &Reach) -> u64 {
    if reach.is_cloud() { 2 * reach.vertices() } else { reach.triangles() }
}

impl<'a> WholeSurface<'a> {
    /// The surface of a survey, in about `room` bytes, on all threads of the pool in which this runs.
    ///
    /// # Errors
    /// The cloud has none, or the disk says no.
    pub fn of(
        reach: &'a Reach,
        settings: &Settings,
        (shelf, room): (&Shelf, u64),
        progress: &dyn Progress,
    ) -> Result<WholeSurface<'a>, Error> {
        if !reach.is_cloud() {
            return Ok(WholeSurface::Mesh(reach));
        }
        progress.begin("surface", reach.vertices(), Unit::Vertices);
        let draped = drape(reach, &|point| !reach.is_skipped(point), &settings.surface, (shelf, room))?;
        reach.release();
        return_free_memory();
        progress.advance(reach.vertices());
        progress.end();
        Ok(WholeSurface::Cloud(DrapedCloud::new(reach, &draped.triangles, draped.wide)?, draped.figures))
    }

    /// What is indexed.
    pub fn surface(&self) -> &dyn Surface {
        match self {
            WholeSurface::Mesh(reach) => *reach,
            WholeSurface::Cloud(cloud, _) => cloud,
        }
    }

    /// The cloud and its triangles, if it is one.
    pub fn cloud(&self) -> Option<&DrapedCloud<'a>> {
        match self {
            WholeSurface::Mesh(_) => None,
            WholeSurface::Cloud(cloud, _) => Some(cloud),
        }
    }

    /// What became of the points of a cloud.
    pub fn figures(&self) -> Option<DrapeFigures> {
        match self {
            WholeSurface::Mesh(_) => None,
            WholeSurface::Cloud(_, figures) => Some(*figures),
        }
    }
}
