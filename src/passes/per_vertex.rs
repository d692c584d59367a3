//! One number for every vertex: spacing and curvature.

use super::{Survey, TileError};
use crate::curvature::{Certain, Stencil, divergence, nearest_centroid_m};
use crate::geometry::{DVec3, ExactSum};
use crate::index::{CellBlock, Index};
use crate::pipeline::{Crew, Interrupted, LostJob, Reservation, Stages, Stopped, over_jobs};
use crate::progress::{Progress, Unit};
use crate::store::StoreError;
use crate::tile::NormalField;
use std::convert::Infallible;
use std::ops::Range;

/// A value at each point, or none where something beyond the field could change it.
type PointValues<'f> = dyn Fn(&NormalField, &[DVec3]) -> Vec<Certain> + Sync + 'f;

/// How the field of a block is loaded.
type Load = fn(&Index, &CellBlock) -> Result<NormalField, StoreError>;

/// The values at the vertices of a tile's core.
#[derive(Debug, Clone, PartialEq)]
pub struct CoreValues {
    /// Runs of the survey's vertices.
    pub runs: Vec<Range<u64>>,
    /// The values of all of them, behind one another.
    pub values: Vec<f64>,
    /// Triangles that were loaded for them, halos and second looks included.
    pub loaded: u64,
}

impl Survey<'_> {
    /// Mean distance from a vertex to the nearest triangle centroid, metres: an exact mean. And the tiles that
    /// were lost.
    ///
    /// # Errors
    /// When interrupted.
    pub fn spacing(&self, crew: &Crew, progress: &dyn Progress) -> Result<(f64, Vec<LostJob>), Interrupted> {
        let side_m = self.index.scale.mean_triangle_area_m2.sqrt();
        let mut sum = ExactSum::ZERO;
        let nearest =
            |field: &NormalField, points: &[DVec3]| nearest_centroid_m(field, points, side_m, self.instructions);
        let stages = Stages {
            at_once: crew.pool.current_num_threads(),
            footprint_bytes: |job| self.field_bytes(job, 3.0 * side_m),
            work: |job, reservation: &mut Reservation| {
                let core = self.of_core(job, 3.0 * side_m, (NormalField::load_centroids, &nearest), reservation)?;
                let mut sum = ExactSum::ZERO;
                core.values.iter().for_each(|&d| sum.add(d));
                Ok::<_, TileError>((core.values.len() as u64, sum))
            },
        };
        let all: Vec<usize> = (0..self.plan.tiles.len()).collect();
        progress.begin("spacing", self.index.scale.vertices, Unit::Vertices);
        let lost = over_jobs(crew, &all, &stages, |_, (vertices, of_tile)| {
            sum.merge(of_tile);
            progress.advance(vertices);
            Ok(())
        });
        progress.end();
        let lost = lost.map_err(|_: Stopped<Infallible>| Interrupted)?;
        Ok((sum.value() / self.index.scale.vertices.max(1) as f64, lost))
    }

    /// Divergence of the normal field at every vertex, 1/m, for the tiles of `jobs`. `collect` gets from every
    /// tile, in their order, the values of its core.
    ///
    /// # Errors
    /// When interrupted, or when `collect` fails, as on a full disk.
    pub fn divergence<C>(
        &self,
        crew: &Crew,
        jobs: &[usize],
        stencil: &Stencil,
        progress: &dyn Progress,
        mut collect: impl FnMut(usize, CoreValues) -> Result<(), C>,
    ) -> Result<Vec<LostJob>, Stopped<C>> {
        let values = |field: &NormalField, points: &[DVec3]| divergence(field, points, stencil, self.instructions);
        let stages = Stages {
            at_once: crew.pool.current_num_threads(),
            footprint_bytes: |job| self.field_bytes(job, stencil.reach_m()),
            work: |job, reservation: &mut Reservation| {
                self.of_core(job, stencil.reach_m(), (NormalField::load, &values), reservation)
            },
        };
        let vertices = |job: usize| self.index.vertices.count(&self.index.grid, self.core(job));
        progress.begin("curvature", jobs.iter().map(|&job| vertices(job)).sum(), Unit::Vertices);
        let lost = over_jobs(crew, jobs, &stages, |job, core: CoreValues| {
            progress.advance(core.values.len() as u64);
            collect(job, core)
        });
        progress.end();
        lost
    }

    fn field_bytes(&self, job: usize, halo_m: f64) -> u64 {
        NormalField::footprint_bytes(self.triangles_in(&self.with_halo(self.core(job), halo_m)))
    }

    /// The value at every vertex of a core, from a halo that is widened until all are certain.
    fn of_core(
        &self,
        job: usize,
        halo_m: f64,
        (load, values): (Load, &PointValues),
        reservation: &mut Reservation,
    ) -> Result<CoreValues, TileError> {
        let (index, core) = (self.index, self.core(job));
        let runs = index.vertices.ranges(&index.grid, core);
        let mut points = Vec::with_capacity(index.vertices.count(&index.grid, core) as usize);
        for run in &runs {
            index.positions().read(run.clone(), &mut points)?;
        }
        let field = load(index, &self.with_halo(core, halo_m))?;
        let mut loaded = field.centroids.len() as u64;
        let mut found = values(&field, &points);
        drop(field);
        let mut wider_m = halo_m;
        while !found.iter().all(|value| value.is_known()) {
            wider_m = 2.0 * wider_m.max(index.grid.cell_m);
            let block = self.with_halo(core, wider_m);
            reservation
                .change_to(NormalField::footprint_bytes(self.triangles_in(&block)))
                .map_err(|over| TileError::TooWide { halo_m: wider_m, over })?;
            let field = load(index, &block)?;
            loaded += field.centroids.len() as u64;
            let open: Vec<usize> = (0..found.len()).filter(|&i| !found[i].is_known()).collect();
            let whole = field.centroids.len() as u64 == index.scale.triangles;
            let again: Vec<DVec3> = open.iter().map(|&i| points[i]).collect();
            for (i, value) in open.into_iter().zip(values(&field, &again)) {
                found[i] = value;
            }
            let unknown = found.iter().filter(|value| !value.is_known()).count();
            assert!(unknown == 0 || !whole, "the values of {unknown} vertices are no numbers, though all is loaded");
        }
        Ok(CoreValues { runs, values: found.into_iter().filter_map(Certain::value).collect(), loaded })
    }
}
