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
//! Everything is summed in the order (distance², global triangle id) from coordinates that know no tile,
//! so a value is the same bits in every tile that is certain of it.

mod neighbours;

pub use neighbours::{Neighbour, Neighbours};

use crate::geometry::DVec3;
use crate::settings::CurvatureSettings;
use crate::tile::NormalField;
use rayon::prelude::*;

/// Columns of the search are this many mean triangle sides wide: narrow enough to gather few candidates
/// in vain, wide enough to touch few columns (2 to 3 are alike; measured on synthetic beds).
const COLUMN_SIDES: f64 = 2.5;

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
/// what was loaded could be nearer.
pub fn nearest_centroid_m(field: &NormalField, points: &[DVec3], side_m: f64) -> Vec<Option<f64>> {
    let search = Neighbours::new(field, COLUMN_SIDES * side_m);
    points
        .par_iter()
        .map_init(Vec::new, |found, &p| {
            let certain = search.nearest(p, 1, side_m, found);
            found.first().filter(|_| certain).map(|n| n.0.sqrt())
        })
        .collect()
}

/// Divergence of the normal field at each point, 1/m, positive where convex; none where something beyond
/// what was loaded could change it.
pub fn divergence(field: &NormalField, points: &[DVec3], stencil: &Stencil) -> Vec<Option<f64>> {
    let search = Neighbours::new(field, COLUMN_SIDES * stencil.side_m);
    points
        .par_iter()
        .map_init(Vec::new, |found, &p| {
            let mut sum = 0.0;
            let mut certain = true;
            for axis in 0..3 {
                let shift = DVec3::AXES[axis] * stencil.offset_m;
                for (place, sign) in [(p + shift, 1.0), (p - shift, -1.0)] {
                    certain &= search.nearest(place, stencil.neighbours, stencil.first_radius_m(), found);
                    sum += sign * weighted_normal(field, found, axis, stencil.spacing_m);
                }
            }
            certain.then_some(sum / stencil.offset_m / 2.0)
        })
        .collect()
}

/// One component of the inverse-distance weighted normal.
fn weighted_normal(field: &NormalField, found: &[Neighbour], axis: usize, least_m: f64) -> f64 {
    let (mut weighted, mut weights) = (0.0, 0.0);
    for &(d2, t) in found {
        let w = 1.0 / d2.sqrt().max(least_m);
        weighted += w * field.normals[t as usize][axis];
        weights += w;
    }
    weighted / weights
}
