//! The three passes over all tiles: spacing, curvature, grains.
//!
//! Each works every tile's core with a halo, and widens the halo where the cut could have mattered. The
//! first two look a few triangles around and store one number for each vertex, so that the third, which
//! looks as far as a grain is wide, need not compute curvature again in every halo.

use crate::curvature::{Stencil, divergence, nearest_centroid_m};
use crate::geometry::{DVec3, ExactSum};
use crate::index::{CellBlock, Index};
use crate::measure::{Wanted, measure};
use crate::open::Surface;
use crate::pipeline::{Crew, Interrupted, LostJob, Reservation, Stages, over_jobs};
use crate::progress::{Progress, Unit};
use crate::segment::{Settled, segment};
use crate::settings::SegmentSettings;
use crate::stitch::{TileFinding, TileReport};
use crate::tile::{NormalField, Plan, Tile, TileMesh};

/// A value at each point, or none where something beyond the field could change it.
type PointValues<'f> = dyn Fn(&NormalField, &[DVec3]) -> Vec<Option<f64>> + Sync + 'f;

/// The survey as the passes see it.
pub struct Survey<'a> {
    /// Vertices and triangles.
    pub surface: &'a dyn Surface,
    /// Where they are.
    pub index: &'a Index,
    /// How they are cut into tiles.
    pub plan: &'a Plan,
}

impl Survey<'_> {
    fn tile(&self, job: usize) -> &Tile {
        &self.plan.tiles[job]
    }

    /// The core with a halo of at least this many metres, whole cells.
    fn with_halo(&self, core: &CellBlock, halo_m: f64) -> CellBlock {
        let cells = (halo_m / self.index.grid.cell_m).ceil().clamp(0.0, f64::from(u32::MAX));
        self.index.grid.grown(core, cells as u32)
    }

    fn triangles_in(&self, block: &CellBlock) -> u64 {
        self.index.triangles.count(&self.index.grid, block)
    }

    fn vertices_in_use(&self) -> u64 {
        self.index.valence.iter().filter(|&&n| n > 0).count() as u64
    }

    /// Vertices of the core that triangles use: ids, and positions in local metres. A stray one may be far
    /// away, and nobody asks for its curvature.
    fn core_vertices(&self, tile: &Tile) -> (Vec<u64>, Vec<DVec3>) {
        let mut ids = self.index.vertices.in_block(&self.index.grid, &tile.core);
        ids.retain(|&v| self.index.valence[v as usize] > 0);
        let points = ids.iter().map(|&v| self.surface.position(v)).collect();
        (ids, points)
    }

    /// Mean distance from a vertex to the nearest triangle centroid, over all vertices that triangles
    /// use, metres; an exact mean.
    ///
    /// # Errors
    /// When interrupted.
    pub fn spacing(&self, crew: &Crew, progress: &dyn Progress) -> Result<Pass<f64>, Interrupted> {
        let side_m = self.index.scale.mean_triangle_area_m2.sqrt();
        let (mut sum, mut count) = (ExactSum::ZERO, 0u64);
        progress.begin("spacing", self.vertices_in_use(), Unit::Vertices);
        let nearest = |field: &NormalField, points: &[DVec3]| nearest_centroid_m(field, points, side_m);
        let lost = self.per_vertex(crew, 3.0 * side_m, &nearest, |_, values| {
            values.iter().for_each(|&d| sum.add(d));
            count += values.len() as u64;
            progress.advance(values.len() as u64);
        })?;
        progress.end();
        Ok(Pass { result: sum.value() / count.max(1) as f64, lost })
    }

    /// Divergence of the normal field at every vertex that a triangle uses, by vertex id, 1/m; 0 for others.
    ///
    /// # Errors
    /// When interrupted.
    pub fn divergence(
        &self,
        crew: &Crew,
        stencil: &Stencil,
        progress: &dyn Progress,
    ) -> Result<Pass<Vec<f64>>, Interrupted> {
        let mut result = vec![0.0; self.index.scale.vertices as usize];
        progress.begin("curvature", self.vertices_in_use(), Unit::Vertices);
        let values = |field: &NormalField, points: &[DVec3]| divergence(field, points, stencil);
        let lost = self.per_vertex(crew, stencil.reach_m(), &values, |ids, values| {
            ids.iter().zip(&values).for_each(|(&v, &d)| result[v as usize] = d);
            progress.advance(values.len() as u64);
        })?;
        progress.end();
        Ok(Pass { result, lost })
    }

    /// One value for every vertex of every core that triangles use, from a halo that is widened until it is
    /// certain.
    fn per_vertex(
        &self,
        crew: &Crew,
        halo_m: f64,
        values: &PointValues,
        mut collect: impl FnMut(&[u64], Vec<f64>),
    ) -> Result<Vec<LostJob>, Interrupted> {
        let first = |job: usize| self.with_halo(&self.tile(job).core, halo_m);
        let stages = Stages {
            footprint_bytes: |job| NormalField::footprint_bytes(self.triangles_in(&first(job))),
            load: |job| NormalField::load(self.surface, self.index, &first(job)),
            work: |job, field: NormalField, reservation: &mut Reservation| {
                let (ids, points) = self.core_vertices(self.tile(job));
                let mut found = values(&field, &points);
                drop(field);
                let mut wider_m = halo_m;
                while found.contains(&None) {
                    wider_m = 2.0 * wider_m.max(self.index.grid.cell_m);
                    let block = self.with_halo(&self.tile(job).core, wider_m);
                    reservation.grow_to(NormalField::footprint_bytes(self.triangles_in(&block)));
                    let field = NormalField::load(self.surface, self.index, &block);
                    let open: Vec<usize> = (0..found.len()).filter(|&i| found[i].is_none()).collect();
                    let again: Vec<DVec3> = open.iter().map(|&i| points[i]).collect();
                    for (i, value) in open.into_iter().zip(values(&field, &again)) {
                        found[i] = value;
                    }
                }
                (ids, found.into_iter().flatten().collect::<Vec<f64>>())
            },
        };
        over_jobs(crew, self.plan.tiles.len(), &stages, |_, (ids, values)| collect(&ids, values))
    }

    /// Grains, oversize bodies and a report from every tile, in the order of the plan.
    ///
    /// # Errors
    /// When interrupted.
    pub fn grains(
        &self,
        crew: &Crew,
        recipe: &Recipe,
        progress: &dyn Progress,
    ) -> Result<Pass<Vec<TileFinding>>, Interrupted> {
        let halo_m = self.first_halo_m(recipe.settings);
        let first = |job: usize| self.with_halo(&self.tile(job).core, halo_m);
        let mut findings = Vec::new();
        progress.begin("grains", self.index.scale.triangles, Unit::Triangles);
        let stages = Stages {
            footprint_bytes: |job| TileMesh::footprint_bytes(self.triangles_in(&first(job))),
            load: |job| TileMesh::load(self.surface, self.index, &self.tile(job).core, &first(job)),
            work: |job, mesh: TileMesh, reservation: &mut Reservation| {
                self.work_until_settled(self.tile(job), mesh, halo_m, recipe, reservation)
            },
        };
        let lost = over_jobs(crew, self.plan.tiles.len(), &stages, |_, finding: TileFinding| {
            progress.advance(finding.report.core_triangles);
            findings.push(finding);
        })?;
        progress.end();
        Ok(Pass { result: findings, lost })
    }

    /// Where a tile's first halo ends, metres: enough for most grains, not for the widest allowed. Wider
    /// ones cost the few tiles that meet them a second attempt.
    pub fn first_halo_m(&self, settings: &SegmentSettings) -> f64 {
        if settings.max_grain_m == 0.0 {
            return f64::INFINITY;
        }
        let rings = settings.erosion_iterations + settings.dilation_iterations + 2;
        0.35 * settings.max_grain_m + f64::from(rings) * 3.0 * self.index.scale.mean_edge_m
    }

    fn work_until_settled(
        &self,
        tile: &Tile,
        mut mesh: TileMesh,
        mut halo_m: f64,
        recipe: &Recipe,
        reservation: &mut Reservation,
    ) -> TileFinding {
        let mut attempts = 1;
        loop {
            let divergence: Vec<f64> = mesh.vertex_ids.iter().map(|&v| recipe.divergence[v as usize]).collect();
            let found = segment(&mesh, &divergence, &self.index.scale, recipe.settings, &mut |_, _| {});
            if found.is_complete() {
                return self.publish(tile, &mesh, found, recipe, (halo_m, attempts));
            }
            let whole = mesh.triangle_ids.len() as u64 == self.index.scale.triangles;
            let (unsettled, open) = (found.unsettled.len(), found.oversize_open);
            assert!(!whole, "{unsettled} core triangles and {open} edges are unknown in the whole survey");
            halo_m *= 1.5;
            attempts += 1;
            let block = self.with_halo(&tile.core, halo_m);
            reservation.grow_to(TileMesh::footprint_bytes(self.triangles_in(&block)));
            // The narrower mesh goes before the wider one comes.
            drop(std::mem::take(&mut mesh));
            mesh = TileMesh::load(self.surface, self.index, &tile.core, &block);
        }
    }

    fn publish(
        &self,
        tile: &Tile,
        mesh: &TileMesh,
        found: Settled,
        recipe: &Recipe,
        (halo_m, attempts): (f64, u32),
    ) -> TileFinding {
        use rayon::prelude::*;
        let color = |v: u64| self.surface.color(v);
        let grains: Vec<_> =
            found.grains.par_iter().map(|segment| measure(mesh, segment, recipe.wanted, &color)).collect();
        let core = self.index.grid.outline(&tile.core);
        let extent = self.index.grid.outline(&self.index.grid.all());
        TileFinding {
            report: TileReport {
                tile: tile.id,
                core,
                core_triangles: mesh.in_core.iter().filter(|&&c| c).count() as u64,
                loaded_triangles: mesh.triangle_ids.len() as u64,
                halo_m: halo_m.min(extent.width_m()),
                attempts,
                grains: grains.len() as u64,
            },
            grains,
            oversize: found.oversize,
        }
    }
}

/// What the grain pass applies to every tile.
pub struct Recipe<'a> {
    /// What makes a grain.
    pub settings: &'a SegmentSettings,
    /// Divergence of every vertex of the survey, 1/m.
    pub divergence: &'a [f64],
    /// What to measure.
    pub wanted: Wanted,
}

/// What a pass found, and the tiles it lost to panics.
pub struct Pass<T> {
    /// Of all tiles that were done.
    pub result: T,
    /// Tiles that panicked, by their place in the plan.
    pub lost: Vec<LostJob>,
}
