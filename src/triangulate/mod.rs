//! Triangulating: a point cloud gets a surface, seen from above.
//!
//! The surface is that of the Delaunay triangulation in plan, without triangles across gaps. Every triangle is a matter
//! of the points around it ([`delaunay`]), and so is whether a point is hidden ([`seen`]) and how wide a gap may be
//! ([`density`]). The cloud is worked in blocks, each with all points that can matter to it, and every triangle is found
//! by the block that holds its first corner: the surface is that of the cloud in one piece.
//!
//! What a surface of one height at each place cannot show is left out: what lies under overhangs, and walls below their
//! rim, which become one strip of steep triangles.

mod blocks;
mod delaunay;
mod density;
mod seen;

use crate::geometry::DVec3;
use crate::open::{Surface, over_chunks_then, pieces};
use crate::settings::SurfaceSettings;
use crate::store::{Element, Scatter, Shelf, StoreError};
use blocks::Blocks;
use delaunay::{circle_radius_m, triangles};
use density::Density;
pub use density::Keep;
use rayon::prelude::*;
use seen::{Cover, from_above, one_for_each_place};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{BufWriter, Write};

/// Points hide others within this many usual spacings.
const COVER_SPACINGS: f64 = 2.0;
/// Memory for each point of a block while it is triangulated, bytes.
const WORKING_BYTES: u64 = 400;
/// Part of the room for points that wait for their block.
const WAITING_SHARE: u64 = 2;

/// A cloud that cannot be triangulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DrapeError {
    /// There is nothing to triangulate.
    #[error(
        "{kept} of the {points} points of the cloud can be used (the others are noise, withheld, or at one place): too few for a surface\nhelp: look at the cloud in CloudCompare, and at the classes of its points"
    )]
    TooFew {
        /// Points of the cloud.
        points: u64,
        /// Those that are neither noise nor withheld.
        kept: u64,
    },
    /// All triangles are too large.
    #[error(
        "the {kept} points of the cloud are {typical_m:.3e} m apart, and no three are near enough for a triangle\nhelp: give a larger surface.gap_spacings, or look at the cloud in CloudCompare: its points may all lie in one line"
    )]
    NoTriangles {
        /// Points that were used.
        kept: u64,
        /// Their usual distance, metres.
        typical_m: f64,
    },
    /// Coordinates that the triangulation cannot take.
    #[error("the cloud cannot be triangulated: {message}")]
    Coordinates {
        /// What the triangulation says.
        message: String,
    },
    /// The work folder cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// What became of the points.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct DrapeFigures {
    /// Points of the cloud.
    pub points: u64,
    /// Noise and withheld points, which are not used.
    pub skipped: u64,
    /// Points at a place in plan where another one is, and is higher.
    pub same_place: u64,
    /// Points below a steep face or an overhang.
    pub hidden: u64,
    /// Triangles of the surface.
    pub triangles: u64,
    /// Usual distance of neighbouring points, metres: the side of the square that one has.
    pub spacing_m: f64,
}

/// The triangles of a cloud.
#[derive(Debug)]
pub struct Draped {
    /// Triples of the cloud's points, little-endian, of 32 bits, or of 64 where `wide`.
    pub triangles: File,
    /// Whether numbers have 64 bits.
    pub wide: bool,
    /// What became of the points.
    pub figures: DrapeFigures,
}

/// A point on its way.
#[derive(Debug, Clone, Copy, Default)]
struct Site {
    at: DVec3,
    input: u64,
}

impl Element for Site {
    const BYTES: usize = 32;
    #[inline(always)]
    fn put(self, to: &mut [u8]) {
        self.at.to_array().put(&mut to[..24]);
        self.input.put(&mut to[24..]);
    }
    #[inline(always)]
    fn get(from: &[u8]) -> Site {
        Site { at: DVec3::from_array(Element::get(&from[..24])), input: u64::get(&from[24..]) }
    }
}

/// What a block gives.
#[derive(Default)]
struct Piece {
    triangles: Vec<[u64; 3]>,
    same_place: u64,
    hidden: u64,
}

/// Lays a surface over the points that are to be kept, in about `room` bytes, on all threads of the pool.
///
/// Triangles are seen counter-clockwise from above, and in the same order whatever the room and the threads.
///
/// # Errors
/// No surface, or the disk says no.
pub fn drape(
    cloud: &dyn Surface,
    keep: Keep,
    settings: &SurfaceSettings,
    (shelf, room): (&Shelf, u64),
) -> Result<Draped, DrapeError> {
    let (density, kept) = Density::of(cloud, keep)?;
    let cover =
        Cover { reach_m: COVER_SPACINGS * density.typical_m, steepness: settings.steepest_deg.to_radians().tan() };
    // A circle through a point of the block, and what hides a point within the circle.
    let halo_m = |spacing_m: f64| 2.0 * settings.gap_spacings * spacing_m + cover.reach_m;
    let blocks = Blocks::cut(&density, halo_m);
    let scatter = scatter(cloud, keep, &blocks, (shelf, room / WAITING_SHARE))?;
    let largest = blocks.largest_points(&density);
    let together = (room / 2 / (WORKING_BYTES * largest)).clamp(1, 4 * rayon::current_num_threads() as u64);
    let (file, path) = shelf.scratch("surface")?;
    let wide = cloud.vertices() > u64::from(u32::MAX);
    let mut to = BufWriter::with_capacity(1 << 18, file);
    let mut figures = DrapeFigures {
        points: cloud.vertices(),
        skipped: cloud.vertices() - kept,
        spacing_m: density.typical_m,
        ..DrapeFigures::default()
    };
    let failed = |source| StoreError::io(&path, "write the surface", source);
    for wave in (0..blocks.blocks.len()).collect::<Vec<_>>().chunks(together as usize) {
        let work = |&i: &usize| {
            let sites: Vec<Site> = scatter.take(i)?.concat();
            piece(sites, &density, &blocks.blocks[i], (settings.gap_spacings, cover))
        };
        let pieces = wave.par_iter().with_max_len(1).map(work).collect::<Result<Vec<_>, DrapeError>>()?;
        for piece in pieces {
            figures.same_place += piece.same_place;
            figures.hidden += piece.hidden;
            figures.triangles += piece.triangles.len() as u64;
            for number in piece.triangles.as_flattened() {
                let bytes = number.to_le_bytes();
                to.write_all(if wide { &bytes } else { &bytes[..4] }).map_err(failed)?;
            }
        }
    }
    let triangles = to.into_inner().map_err(|e| failed(e.into_error()))?;
    if figures.triangles == 0 {
        return Err(DrapeError::NoTriangles { kept, typical_m: density.typical_m });
    }
    Ok(Draped { triangles, wide, figures })
}

/// Usual distance of neighbouring points of a cloud, metres, and how many of its points are kept.
///
/// # Errors
/// There is nothing to triangulate.
pub fn point_spacing_m(cloud: &dyn Surface, keep: Keep) -> Result<(f64, u64), DrapeError> {
    Density::of(cloud, keep).map(|(density, kept)| (density.typical_m, kept))
}

/// Hands every point to the blocks that it is needed in.
fn scatter(
    cloud: &dyn Surface,
    keep: Keep,
    blocks: &Blocks,
    (shelf, room): (&Shelf, u64),
) -> Result<Scatter<Site>, StoreError> {
    let scatter = Scatter::<Site>::new(shelf, "points", blocks.blocks.len(), room)?;
    over_chunks_then(
        cloud,
        cloud.vertices(),
        || Ok((scatter.writer(), Vec::new())),
        |(writer, positions), range| {
            for piece in pieces(range) {
                cloud.positions(piece.clone(), positions);
                for (input, &at) in piece.zip(&*positions).filter(|&(input, _)| keep(input)) {
                    let mut put = Ok(());
                    blocks.around(at, |block| {
                        if put.is_ok() {
                            put = writer.put(block, Site { at, input });
                        }
                    });
                    put?;
                }
            }
            Ok(())
        },
        |(writer, _)| writer.finish(),
    )?;
    Ok(scatter)
}

/// The triangles whose first corner is in a block.
fn piece(
    sites: Vec<Site>,
    density: &Density,
    block: &blocks::Block,
    (gap_spacings, cover): (f64, Cover),
) -> Result<Piece, DrapeError> {
    let here = |sites: &[Site]| sites.iter().filter(|s| block.holds(density.cell_of(s.at))).count() as u64;
    let (mut sites, same_place) = one_for_each_place(sites);
    let hidden = from_above(&mut sites, cover);
    let (same_place, hidden) = (here(&same_place), here(&hidden));
    let all = triangles(&sites).map_err(|e| DrapeError::Coordinates { message: e.to_string() })?;
    let limit_m: Vec<f64> = sites.iter().map(|s| gap_spacings * density.spacing_m(density.cell_of(s.at))).collect();
    let is_ours = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|v| v as usize);
        let limit_m = limit_m[a].min(limit_m[b]).min(limit_m[c]);
        block.holds(density.cell_of(sites[a].at)) && circle_radius_m([&sites[a], &sites[b], &sites[c]]) <= limit_m
    };
    let mut triangles: Vec<[u32; 3]> = all.into_iter().filter(is_ours).collect();
    // By place, so that the numbers of triangles are the same in every run.
    triangles.sort_unstable();
    let triangles = triangles.into_iter().map(|corners| corners.map(|v| sites[v as usize].input)).collect();
    Ok(Piece { triangles, same_place, hidden })
}
