//! The known stones: a mesh, the stone of each of its triangles, and a table of the stones.

use super::arrays::Archive;
use super::error::ValidateError;
use super::overlap::TrueSurface;
use super::stones::{TrueStone, read_stones};
use crate::geometry::{DVec3, triangle_area};
use crate::open::Reach;
use crate::settings::{InputSettings, Unit};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The mesh on which the truth is drawn.
pub(super) const MESH: &str = "mesh.ply";
const ARRAYS: &str = "truth.npz";
const TABLE: &str = "truth.csv";

/// Which triangles belong to a stone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum TruthRule {
    /// All that lie nearest to the stone (array tri_id): the best that a segmentation can do
    #[default]
    Best,
    /// Only those right on the stone, without the rims that the reconstruction rounds (array tri_strict)
    Strict,
}

/// A triangle of [`TRUE_STRICT`] that spans over space that no camera saw.
const UNSEEN: i64 = -2;
const TRUE_BEST: &str = "tri_id";
const TRUE_STRICT: &str = "tri_strict";

/// A mesh with known stones.
#[derive(Debug)]
pub struct Truth {
    /// Vertices, metres.
    pub points: Vec<DVec3>,
    /// Vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Area of each triangle, m².
    pub areas_m2: Vec<f64>,
    /// The stone of each triangle, -1 on sand.
    pub stone_of_triangle: Vec<i32>,
    /// Whether each triangle spans over space that no camera saw; empty where nobody says so.
    pub unseen: Vec<bool>,
    /// All stones, hidden ones too.
    pub stones: Vec<TrueStone>,
    /// Whether each stone counts.
    pub visible: Vec<bool>,
}

impl Truth {
    /// A truth in memory. `stone_of_triangle`: negative on sand, else below the number of stones.
    pub fn new(
        points: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
        stone_of_triangle: Vec<i32>,
        stones: Vec<TrueStone>,
    ) -> Truth {
        let area = |t: &[u32; 3]| triangle_area(t.map(|v| points[v as usize]));
        let areas_m2 = triangles.iter().map(area).collect();
        let visible = vec![true; stones.len()];
        Truth { points, triangles, areas_m2, stone_of_triangle, unseen: Vec::new(), stones, visible }
    }

    /// What labels are held against.
    pub fn surface(&self) -> TrueSurface<'_> {
        TrueSurface {
            areas_m2: &self.areas_m2,
            stone_of_triangle: &self.stone_of_triangle,
            unseen: &self.unseen,
            stones: self.stones.len(),
        }
    }
}

/// The truth as its files have it.
pub(super) struct TruthFiles {
    pub(super) truth: Truth,
    /// The mesh as it was opened, which knows of its faces.
    pub(super) reach: Reach,
    /// The files that were read.
    pub(super) files: Vec<PathBuf>,
}

/// Reads the truth of a folder. `visible_area_m2`: stones with so much connected area count, in place of those that the
/// table says are visible.
///
/// # Errors
/// A file that is missing, damaged, or does not fit the others.
pub(super) fn read_truth(
    folder: &Path,
    rule: TruthRule,
    visible_area_m2: Option<f64>,
) -> Result<TruthFiles, ValidateError> {
    let [mesh, arrays, table] = [MESH, ARRAYS, TABLE].map(|name| folder.join(name));
    for (path, file) in [(&mesh, MESH), (&arrays, ARRAYS), (&table, TABLE)] {
        if !path.is_file() {
            return Err(ValidateError::TruthMissing { folder: folder.to_owned(), file });
        }
    }
    // The small files first: what is wrong with them is told at once.
    let (stones, visible) = read_stones(&table, visible_area_m2)?;
    let reach = open_metres(&mesh)?;
    if reach.is_cloud() {
        return Err(ValidateError::NoTriangles { path: mesh });
    }
    let (points, triangles) = surface(&reach, &mesh)?;
    let (stone_of_triangle, unseen) = read_ids(&arrays, rule, triangles.len(), stones.len())?;
    let truth = Truth { unseen, visible, ..Truth::new(points, triangles, stone_of_triangle, stones) };
    Ok(TruthFiles { truth, reach, files: vec![mesh, arrays, table] })
}

/// Opens a mesh whose coordinates are metres.
pub(super) fn open_metres(path: &Path) -> Result<Reach, ValidateError> {
    let input = InputSettings { unit: Unit::M, ..InputSettings::default() };
    Ok(Reach::open(&[path.to_owned()], &input, &|_, _| {})?.0)
}

fn surface(reach: &Reach, path: &Path) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), ValidateError> {
    let (vertices, mut points, mut corners) = (reach.vertices(), Vec::new(), Vec::new());
    if vertices > u64::from(u32::MAX) {
        return Err(ValidateError::TooManyVertices { path: path.to_owned(), vertices });
    }
    reach.positions(0..vertices, &mut points);
    reach.corner_numbers(0..reach.triangles(), &mut corners);
    Ok((points, corners.into_iter().map(|t| t.map(|v| v as u32)).collect()))
}

/// The stone of each triangle, and whether each lies over unseen space.
fn read_ids(
    path: &Path,
    rule: TruthRule,
    triangles: usize,
    stones: usize,
) -> Result<(Vec<i32>, Vec<bool>), ValidateError> {
    let mut archive = Archive::open(path)?;
    let has_strict = archive.names.iter().any(|name| name == TRUE_STRICT);
    let mut read = |name: &'static str| {
        let ids = archive.read(name, |found| {
            let (path, name, triangles) = (path.to_owned(), name.to_owned(), triangles as u64);
            if found == triangles { Ok(()) } else { Err(ValidateError::ArrayLength { path, name, found, triangles }) }
        })?;
        match ids.iter().position(|&id| id >= stones as i64) {
            Some(triangle) => {
                let (path, stone) = (path.to_owned(), ids[triangle]);
                Err(ValidateError::UnknownStone { path, name, triangle, stone, stones })
            }
            None => Ok(ids),
        }
    };
    let best = if rule == TruthRule::Best { Some(read(TRUE_BEST)?) } else { None };
    let strict = if has_strict || rule == TruthRule::Strict { Some(read(TRUE_STRICT)?) } else { None };
    let unseen = strict.iter().flatten().map(|&id| id == UNSEEN).collect();
    let ids = best.or(strict).unwrap_or_default();
    // Below the number of rows of a table, which fits.
    Ok((ids.into_iter().map(|id| id.max(-1) as i32).collect(), unseen))
}
