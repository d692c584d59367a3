//! Triangulating: a point cloud gets a surface.
//!
//! Every triangle is a matter of the points around it: which way the surface faces there (`normals`), and which points
//! are neighbours in it (`umbrella`). The cloud is worked in blocks, each with all points that can matter to it, and
//! every triangle belongs to the block that holds its first corner: the surface is that of the cloud in one piece.
//!
//! Walls and overhangs are part of the surface as far as points show them. Where several layers of points lie within a
//! few spacings of one another, as in noisy clouds or under thin overhangs, it has holes.

mod blocks;
mod density;
mod near;
mod normals;
#[cfg(test)]
mod tests;
mod umbrella;

use crate::geometry::DVec3;
use crate::open::{Surface, over_chunks_then, pieces};
use crate::settings::SurfaceSettings;
use crate::store::{Element, Scatter, Shelf, StoreError};
use blocks::{Block, Blocks};
use density::Density;
pub use density::Keep;
use near::Near;
use normals::{Facing, TURNS};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::fs::File;
use std::io::{BufWriter, Write};
use umbrella::{Cell, ROUNDS, agreed};

/// Which surface this is: another number wherever a change gives the same points other triangles.
pub const METHOD: u32 = 2;
/// Neighbours of a point that are looked at.
const AROUND: usize = 32;
/// How far they may be, in spacings of the points in plan: more than on level ground, for on steep ground points lie
/// further apart than in plan.
const REACH: f64 = 4.5;
/// How far steep planes look for others that tell which side is up.
const TURN_REACH: f64 = 3.0;
/// A point is covered from above by others this far away in plan, if they are so steeply above it: 80 degrees.
const COVER_REACH: f64 = 1.5;
const COVER_STEEPNESS: f64 = 5.67;
/// How long a side of a triangle may be.
const LONGEST: f64 = 4.0;
/// What may change a triangle lies so far around its first corner. Its corners are a side away. In each round it may be
/// beaten by one that shares a side with it, if that one fits; and whether it fits is a matter of one that shares a side
/// with it, taken in the round before, or agreed on by all its corners.
const TRIANGLES_REACH: f64 = LONGEST * (1 + 2 * ROUNDS.len()) as f64;
/// And what may change the side to which the planes of their corners face.
const FACING_REACH: f64 = TRIANGLES_REACH + TURN_REACH * TURNS as f64;
/// And the points that these planes are fitted to.
const HALO: f64 = FACING_REACH + REACH;
/// Side of the squares in which neighbours are looked for, spacings.
const SQUARE_SPACINGS: f64 = 2.0;
/// More points than one in so many at the very place of another make all spacings too small: they are measured again.
const MANY_AT_ONE_PLACE: u64 = 50;
/// Memory for each point of a block while it is triangulated, bytes.
const WORKING_BYTES: u64 = 250;
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
    /// Too many points in one block.
    #[error(
        "{points} points of the cloud must be looked at together, which takes {} MiB of the {} MiB that there are for it: points are crowded in one place beside others that lie far apart\nhelp: give more --memory, or thin the cloud to an even distance, for instance with Edit > Subsample in CloudCompare", needed >> 20, room >> 20
    )]
    Crowded {
        /// Points of the block and around it.
        points: u64,
        /// Memory for them, bytes.
        needed: u64,
        /// Memory that there is, bytes.
        room: u64,
    },
    /// Who was told of the progress did not want more.
    #[error("the triangulation was stopped")]
    Stopped,
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
    /// Points at the very place of another one.
    pub same_place: u64,
    /// Points on steep or covered faces of which nothing around tells which side is the outer one.
    pub side_unknown: u64,
    /// Triangles of the surface.
    pub triangles: u64,
    /// Usual distance of neighbouring points, metres: the side of the square that one has.
    pub spacing_m: f64,
}

/// Who hears of the progress, and may stop it by an error, [`DrapeError::Stopped`].
pub type Tell<'a> = &'a (dyn Fn(u64) -> Result<(), DrapeError> + Sync);

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
    points: u64,
    same_place: u64,
    side_unknown: u64,
}

/// Lays a surface over the points that are to be kept, in about `room` bytes, on all threads of the pool. `tell` hears from
/// time to time how many more points are done, and may stop it.
///
/// Triangles are seen counter-clockwise from outside, and in the same order whatever the room and the threads.
///
/// # Errors
/// No surface, or the disk says no.
pub fn drape(
    cloud: &dyn Surface,
    keep: Keep,
    settings: &SurfaceSettings,
    (shelf, room): (&Shelf, u64),
    tell: Tell,
) -> Result<Draped, DrapeError> {
    drape_in_blocks(cloud, keep, settings, (shelf, room, tell), blocks::MOST_POINTS)
}

fn drape_in_blocks(
    cloud: &dyn Surface,
    keep: Keep,
    settings: &SurfaceSettings,
    (shelf, room, tell): (&Shelf, u64, Tell),
    most_points: u64,
) -> Result<Draped, DrapeError> {
    let (mut density, kept) = Density::of(cloud, keep)?;
    let mut draped = drape_by(&density, kept, (cloud, keep), settings, (shelf, room, tell), most_points)?;
    let alone = kept - draped.figures.same_place;
    if draped.figures.same_place > kept / MANY_AT_ONE_PLACE {
        density.widen((kept as f64 / alone as f64).sqrt());
        draped = drape_by(&density, kept, (cloud, keep), settings, (shelf, room, &|_| tell(0)), most_points)?;
    }
    match draped.figures.triangles {
        0 => Err(DrapeError::NoTriangles { kept, typical_m: density.typical_m }),
        _ => Ok(draped),
    }
}

fn drape_by(
    density: &Density,
    kept: u64,
    (cloud, keep): (&dyn Surface, Keep),
    settings: &SurfaceSettings,
    (shelf, room, tell): (&Shelf, u64, Tell),
    most_points: u64,
) -> Result<Draped, DrapeError> {
    let blocks = Blocks::cut(density, most_points, HALO);
    let largest = blocks.largest_points(density);
    let needed = WORKING_BYTES * largest;
    if needed > room || largest > u64::from(u32::MAX) {
        return Err(DrapeError::Crowded { points: largest, needed, room });
    }
    let waiting = (room / WAITING_SHARE).min(room - needed);
    let scatter = scatter(cloud, keep, &blocks, (shelf, waiting))?;
    let together = ((room - waiting) / needed).clamp(1, 4 * rayon::current_num_threads() as u64);
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
            Ok(piece(sites, density, &blocks.blocks[i], settings.gap_spacings))
        };
        let pieces = wave.par_iter().with_max_len(1).map(work).collect::<Result<Vec<_>, StoreError>>()?;
        for piece in pieces {
            tell(piece.points)?;
            figures.same_place += piece.same_place;
            figures.side_unknown += piece.side_unknown;
            figures.triangles += piece.triangles.len() as u64;
            for number in piece.triangles.as_flattened() {
                let bytes = number.to_le_bytes();
                to.write_all(if wide { &bytes } else { &bytes[..4] }).map_err(failed)?;
            }
        }
    }
    let triangles = to.into_inner().map_err(|e| failed(e.into_error()))?;
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
fn piece(mut sites: Vec<Site>, density: &Density, block: &Block, gap_spacings: f64) -> Piece {
    // By place, so that points have the same order in every block, whatever that of the file is.
    let key = |s: &Site| (s.at.x, s.at.y, s.at.z, s.input);
    sites.sort_unstable_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal));
    let is_ours = |site: &Site| block.holds(density.cell_of(site.at));
    let points = sites.iter().filter(|site| is_ours(site)).count() as u64;
    let mut same_place = 0;
    sites.dedup_by(|b, a| {
        let same = a.at == b.at;
        same_place += u64::from(same && is_ours(b));
        same
    });
    // Squares as most points want them.
    let usual_m = sites.get(sites.len() / 2).map_or(1.0, |site| density.finest_m(density.cell_of(site.at)));
    let (near, mut facing) = (Near::new(&sites, SQUARE_SPACINGS * usual_m), Facing::new(sites.len()));
    let (mut found, mut cell, mut proposed) = (Vec::new(), Cell::default(), Vec::new());
    for (point, site) in sites.iter().enumerate() {
        let distance_m = density.distance_m(site.at, &block.columns, &block.rows);
        if distance_m > FACING_REACH * block.spacing_m {
            continue;
        }
        let spacing_m = density.spacing_m(density.cell_of(site.at));
        near.nearest(point, AROUND, REACH * spacing_m, &mut found);
        let is_covered = || near.is_covered(point, COVER_REACH * spacing_m, COVER_STEEPNESS);
        let normal = facing.fit(point, (&sites, &found), TURN_REACH * spacing_m, is_covered);
        if distance_m <= TRIANGLES_REACH * block.spacing_m {
            // So many points in a circle of this radius.
            let farthest2 = found.last().map_or(0.0, |n| n.0);
            let own_m = (std::f64::consts::PI * farthest2 / found.len().max(1) as f64).sqrt();
            let lengths_m = (own_m, gap_spacings * own_m, LONGEST * spacing_m);
            cell.propose(point, (&sites, &found), normal, lengths_m, &mut proposed);
        }
    }
    let turned = facing.turn();
    let side_unknown = facing.open().filter(|&point| is_ours(&sites[point])).count() as u64;
    drop((near, facing));
    let ours = agreed(&sites, proposed, &turned).into_iter().filter(|corners| is_ours(&sites[corners[0] as usize]));
    let triangles = ours.map(|corners| corners.map(|v| sites[v as usize].input)).collect();
    Piece { triangles, points, same_place, side_unknown }
}
