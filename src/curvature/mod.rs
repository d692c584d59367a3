//! Curvature: the divergence of the surface's normal field.
//!
//! Twice the mean curvature is the divergence of the unit normals, 2H = div n with outward normals
//! (Rheinwalt, Purinton & Bookhagen 2025, ESurf 13, 923-940, eq. 1 and 2, who write -div n for inward
//! ones): positive where the surface is convex, 1/m; a sphere of radius r has 2/r.
//!
//! The normals are extended into space by inverse-distance weighting of the `neighbours` nearest
//! triangle normals, and differenced between six points at +-x, +-y, +-z from the vertex, at a distance
//! of `stencil_spacings` times the survey's mean vertex-to-centroid distance: one distance for the whole
//! survey, as in the authors' program (the text has one for each triangle).
//!
//! The neighbours are the nearest by (distance², global triangle id), from coordinates that know no tile, and
//! they are summed exactly: a value is the same bits in every tile that is certain of it, on every processor.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod block;
mod buffer;
mod certain;
mod grid;
mod instruction_set;
mod kernel;
mod lanes;
mod nearest;
mod neighbours;
mod sheet;
mod thresholds;
mod visits;
mod weights;

pub use certain::Certain;
pub use instruction_set::InstructionSet;
pub use neighbours::{Neighbour, Neighbours};

use crate::geometry::DVec3;
use crate::settings::CurvatureSettings;
use crate::tile::NormalField;
use grid::Grid;
use instruction_set::Work;
use lanes::Lanes;
use neighbours::Reserve;
use rayon::prelude::*;
use sheet::Sheet;
use visits::Visits;
use weights::Weighting;

/// What the stencil needs to know about the whole survey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stencil {
    /// Mean distance from a vertex to the nearest centroid, metres; also the smallest distance that
    /// weighs, so that a centroid at a stencil point does not outweigh all others.
    pub spacing_m: f64,
    /// Distance from the vertex to the six stencil points, metres.
    pub offset_m: f64,
    /// Normals averaged at each stencil point.
    pub neighbours: usize,
    /// Side of the square with a mean triangle's area, metres.
    pub side_m: f64,
}

impl Stencil {
    /// The stencil of a survey.
    pub fn new(spacing_m: f64, mean_triangle_area_m2: f64, settings: &CurvatureSettings) -> Stencil {
        Stencil {
            spacing_m,
            offset_m: spacing_m * settings.stencil_spacings,
            neighbours: settings.neighbours,
            side_m: mean_triangle_area_m2.sqrt(),
        }
    }

    /// How far a value usually looks, metres: where a tile's first halo ends. Sparse places look further.
    pub fn reach_m(&self) -> f64 {
        self.offset_m + 2.2 * self.typical_radius_m()
    }

    /// Radius of the disc that holds the neighbours on an evenly meshed sheet.
    fn typical_radius_m(&self) -> f64 {
        (self.neighbours as f64 / std::f64::consts::PI).sqrt() * self.side_m
    }

    /// Radius at which the search for neighbours starts: enough for most vertices.
    fn first_radius_m(&self) -> f64 {
        1.15 * self.typical_radius_m().hypot(self.offset_m)
    }
}

/// Distance from each point to the nearest centroid of the field, metres; none where a centroid beyond
/// what was loaded could be nearer. The instruction set must be available.
pub fn nearest_centroid_m(field: &NormalField, points: &[DVec3], side_m: f64, set: InstructionSet) -> Vec<Certain> {
    let reserve = Reserve::new(field, side_m);
    let Some(sheet) = Sheet::new(field, side_m) else {
        return points.par_iter().map(|&p| reserve.nearest_m(p, side_m).into()).collect();
    };
    let visits = Visits::new(sheet.columns(), points, |p| sheet.column(p));
    let job = nearest::Job { sheet: &sheet, field, points, side_m, reserve: &reserve };
    set.run(NearestPass { job: &job, visits: &visits })
}

/// Divergence of the normal field at each point, 1/m, positive where convex; none where something beyond
/// what was loaded could change it. The instruction set must be available.
pub fn divergence(field: &NormalField, points: &[DVec3], stencil: &Stencil, set: InstructionSet) -> Vec<Certain> {
    let weighting = Weighting::new(stencil.offset_m, stencil.spacing_m);
    let reserve = Reserve::new(field, stencil.side_m);
    let few = field.centroids.len() < 2 * stencil.neighbours || stencil.neighbours > MOST_NEIGHBOURS;
    let side_m = CELL_REACHES * (stencil.typical_radius_m() + stencil.offset_m);
    let Some(grid) = Some(side_m).filter(|_| !few).and_then(|side_m| Grid::new(field, side_m)) else {
        return points.par_iter().map(|&p| reserve.divergence(p, stencil, &weighting).into()).collect();
    };
    let visits = Visits::new(grid.columns(), points, |p| grid.column(p));
    let job = kernel::Job { grid: &grid, field, points, stencil, weighting, reserve: &reserve };
    set.run(DivergencePass { job: &job, visits: &visits })
}

/// Sums of more neighbours could overflow.
const MOST_NEIGHBOURS: usize = 256;

/// Side of a cell in multiples of how far a vertex usually looks: its neighbours must be in adjoining cells, also
/// at the edge of the survey, where they are on one side only.
const CELL_REACHES: f64 = 1.53;

struct DivergencePass<'a> {
    job: &'a kernel::Job<'a>,
    visits: &'a Visits,
}

impl Work for DivergencePass<'_> {
    type Result = Vec<Certain>;

    fn with<L: Lanes>(self, lanes: L) -> Self::Result {
        self.visits.by_column(
            || kernel::Workspace::new(self.job.stencil),
            |work, vertices, found| lanes.column(&mut kernel::Column { job: self.job, vertices, found, work }),
        )
    }
}

struct NearestPass<'a> {
    job: &'a nearest::Job<'a>,
    visits: &'a Visits,
}

impl Work for NearestPass<'_> {
    type Result = Vec<Certain>;

    fn with<L: Lanes>(self, lanes: L) -> Self::Result {
        self.visits.by_run(nearest::COLUMNS, Vec::new, |nearest, columns, found| {
            lanes.nearest_run(&mut nearest::Run { job: self.job, vertices: self.visits.of(columns), found, nearest });
        })
    }
}
