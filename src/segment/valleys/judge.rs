//! What a core is: a stone, a fragment that may be part of one, or a sheet that no grain is part of.

use super::cores::{Cores, Ground};
use super::look::Look;
use super::patch::Patch;
use crate::geometry::{DVec3, PlanBox, flatter_than, mean_depth};
use crate::settings::SegmentSettings;
use rayon::prelude::*;

/// What a core is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Part of a grain.
    Stone,
    /// A low-scoring patch that stands on edge: no grain by itself, but it may be part of one.
    Fragment,
    /// Part of no grain: sand, a membrane, or too wide.
    Sheet,
    /// Not whole: not known.
    Open,
}

/// A core, as a whole.
#[derive(Debug, Clone)]
pub struct Judged {
    /// What it is.
    pub kind: Kind,
    /// Its vertices, ascending.
    pub vertices: Vec<u32>,
    /// Its area as it was found, m²: of a core of the second look only triangles count all of whose corners were left over.
    pub area_m2: f64,
    /// Its box in plan.
    pub bounds: PlanBox,
    /// Some of its places, with their normals as they were smoothed to find it; none where it is part of no grain, or not whole.
    pub patch: Patch,
}

/// Means over a core, weighted by area.
struct Means {
    area_m2: f64,
    /// Mean curvature times the square root of the area: above 2 for a ball, 0 for a plane.
    bulge: f64,
    /// Upward part of the normal.
    up: f64,
}

/// Weight of the bulge of a core against the sphericity of its hull.
const BULGE: f64 = 0.5;
/// A core whose normals point up in the mean by more than this lies level, as sand does.
const LEVEL: f64 = 0.9;
/// A level core that lies so deep below its hull, as a share of the square root of its area, is still plain,
const PLAIN: f64 = 0.02;
/// and loses this where it lies twice as deep.
const HOLLOWNESS: f64 = 0.2;
/// A level core whose hull is less spherical than this, or than half of a `stone_score` that is lower than the default, is no stone,
/// however it bends: of a wide sheet of sand without its hollows, which are valleys, what is left bends downward a little everywhere.
const FLATTEST: f64 = 0.3;
/// What a core that is no stone must score to be part of one.
const PART: f64 = 0.3;

/// Judges all cores by themselves.
///
/// The score of a core is the sphericity of its hull plus half its bulge, less for what is level and
/// hollow: sheets of sand and membranes score low. A core wider than a grain may be is a sheet whatever else it
/// is; of one that is not whole nothing else is known.
pub fn judge(ground: &Ground, cores: &Cores, (segment, look): (&SegmentSettings, &Look)) -> Vec<Judged> {
    let too_wide = |bounds: &PlanBox| segment.max_grain_m > 0.0 && bounds.width_m() > segment.max_grain_m;
    cores
        .members()
        .into_par_iter()
        .zip(&cores.open)
        .map(|(vertices, &open)| {
            let mut bounds = PlanBox::EMPTY;
            vertices.iter().for_each(|&v| bounds.include(ground.positions[v as usize]));
            let means = Means::of(ground, &vertices);
            let kind = match () {
                () if too_wide(&bounds) => Kind::Sheet,
                () if open => Kind::Open,
                () => kind(ground, &vertices, &means, look),
            };
            let sampled: &[u32] = if matches!(kind, Kind::Stone | Kind::Fragment) { &vertices } else { &[] };
            let patch = Patch::of(ground, sampled);
            Judged { kind, area_m2: means.area_m2, bounds, patch, vertices }
        })
        .collect()
}

impl Means {
    fn of(ground: &Ground, vertices: &[u32]) -> Means {
        let (mut area, mut bend, mut up) = (0.0, 0.0, 0.0);
        for v in vertices.iter().map(|&v| v as usize) {
            let of = f64::from(ground.area_m2[v]);
            area += of;
            bend += of * f64::from(ground.bends[v].mean);
            up += of * f64::from(ground.normals[v].z);
        }
        let over = 1.0 / area.max(f64::MIN_POSITIVE);
        let bulge = bend * over / ground.mean_edge_m * area.sqrt();
        Means { area_m2: area, bulge, up: up * over }
    }
}

fn kind(ground: &Ground, vertices: &[u32], means: &Means, look: &Look) -> Kind {
    // The sphericity that makes a score, which bounds of the hull mostly decide.
    let sphericity = |score: f64| score - BULGE * means.bulge;
    if sphericity(look.stone_score) <= 0.0 && means.up <= LEVEL {
        return Kind::Stone;
    }
    let points: Vec<DVec3> = vertices.iter().map(|&v| ground.positions[v as usize]).collect();
    if means.up > LEVEL {
        let least = sphericity(look.stone_score);
        // Who asks for flatter stones than usual gets them.
        let bar = least.max(FLATTEST.min(0.5 * look.stone_score));
        if bar > 0.0 && flatter_than(&points, bar) {
            return Kind::Sheet;
        }
        let depth = mean_depth(&points, &points) / means.area_m2.sqrt();
        let hollow = HOLLOWNESS * (depth / PLAIN - 1.0).max(0.0);
        return if hollow > 0.0 && flatter_than(&points, least + hollow) { Kind::Sheet } else { Kind::Stone };
    }
    match () {
        () if !flatter_than(&points, sphericity(look.stone_score)) => Kind::Stone,
        () if !flatter_than(&points, sphericity(PART)) => Kind::Fragment,
        () => Kind::Sheet,
    }
}
