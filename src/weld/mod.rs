//! Welding: several files of one survey become one surface.
//!
//! Blocks that were exported from one mesh each have their own vertices along the borders. Those of different files
//! that lie at the same place become one vertex, the earliest, so that the surface goes on across the border and a
//! grain is whole. Where coordinates are exactly equal, the result is that of the uncut mesh.
//!
//! ```text
//!  squares that several files reach ──> vertices and triangles in them ──> held twice? ──> twins ──> aliases
//! ```
//!
//! Only what lies in such a square is looked at closely, so memory goes with the length of the borders: a few bits for
//! each vertex of the survey, and some hundred bytes for each vertex near a border.

mod error;
mod facts;
mod near;
mod overlap;
mod parts;
mod sheet;
mod twins;
mod warning;
mod welded;

pub use error::WeldError;
pub use facts::{Doubled, PairFacts, WeldFacts};
pub use parts::{Part, parts};
pub use warning::Warning;
pub use welded::Welded;

use crate::open::{Bits, Frame, Reach, Surface};
use near::{Files, Near};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Makes the files of a survey one surface. `weld_m` is how near two vertices must be to be one, 0 to have it chosen;
/// `room_bytes` is the memory that may be taken. A single file stays as it is, and has no facts.
///
/// # Errors
/// Two files hold the same ground; the tolerance is too wide; the memory is too small.
pub fn weld(reach: &Reach, weld_m: f64, room_bytes: u64) -> Result<(Welded<'_>, Option<WeldFacts>), WeldError> {
    if reach.files().len() < 2 || reach.is_cloud() {
        return Ok((Welded::new(reach, Vec::new()), None));
    }
    let (welded, facts) = weld_parts(reach, &parts(reach), reach.frame(), weld_m, room_bytes)?;
    Ok((welded, Some(facts)))
}

/// [`weld`] for any surface of several parts, whose numbers follow each other.
///
/// # Errors
/// As [`weld`].
pub fn weld_parts<'a>(
    surface: &'a dyn Surface,
    parts: &[Part],
    frame: &Frame,
    weld_m: f64,
    room_bytes: u64,
) -> Result<(Welded<'a>, WeldFacts), WeldError> {
    let apart = |tolerance_m| (Welded::new(surface, Vec::new()), WeldFacts { tolerance_m, ..WeldFacts::default() });
    let Some(tolerance_m) = parts::tolerance_m(parts, weld_m)? else { return Ok(apart(0.0)) };
    let files = Files { surface, parts, zones: parts::zones(parts, tolerance_m), tolerance_m };
    let edges = || parts.iter().filter_map(|part| part.edge_m);
    let Some(near) = files.near(edges().fold(0.0, f64::max)) else { return Ok(apart(tolerance_m)) };
    let mut pairs = overlap::pairs(&near, frame);
    for pair in pairs.values() {
        refuse_overlap(pair, parts)?;
    }
    check_memory(surface, &near, room_bytes)?;
    let ends: Vec<u64> = parts.iter().map(|part| part.vertices.end).collect();
    let shortest = edges().fold(f64::INFINITY, f64::min);
    let aliases = twins::aliases(surface, (&near.used, &ends), tolerance_m, shortest);
    drop(near);
    for &(later, earlier) in &aliases {
        let file = |vertex: u64| ends.partition_point(|&end| end <= vertex);
        pair_of(&mut pairs, [file(earlier), file(later)]).welded_vertices += 1;
    }
    let welded = Welded::new(surface, aliases);
    for (of_files, triangles) in identical(&files, &welded) {
        let pair = pair_of(&mut pairs, of_files);
        pair.identical_triangles = triangles;
        let [first, second] = of_files.map(|i| &parts[i]);
        if triangles > first.size().min(second.size()) / 2 {
            let (first, second) = (first.name.clone(), second.name.clone());
            return Err(WeldError::Copies { first, second, identical: triangles });
        }
    }
    let welded_vertices = welded.aliases().len() as u64;
    let facts = WeldFacts { tolerance_m, welded_vertices, pairs: pairs.into_values().collect() };
    Ok((welded, facts))
}

/// What is odd about the borders between the files.
pub fn warnings(facts: &WeldFacts, parts: &[Part]) -> Vec<Warning> {
    warning::warnings(facts, parts)
}

fn pair_of(pairs: &mut BTreeMap<[usize; 2], PairFacts>, files: [usize; 2]) -> &mut PairFacts {
    let pair = pairs.entry(files).or_default();
    pair.files = files;
    pair
}

fn refuse_overlap(pair: &PairFacts, parts: &[Part]) -> Result<(), WeldError> {
    let files = pair.files.map(|i| &parts[i]);
    match pair.doubled.place {
        Some(place) if pair.doubled.is_too_much(pair.border_squares, files) => {
            let [first, second] = files.map(|part| part.name.clone());
            Err(WeldError::Overlap { first, second, area_m2: pair.doubled.area_m2, place })
        }
        _ => Ok(()),
    }
}

fn check_memory(surface: &dyn Surface, near: &Near, room: u64) -> Result<(), WeldError> {
    let vertices = near.used.count();
    let needed = near.bytes() + Bits::bytes(surface.vertices()) + vertices * twins::BYTES;
    if needed > room { Err(WeldError::Memory { needed, room, near: vertices }) } else { Ok(()) }
}

/// Triangles of different files with the same three vertices, for each two files that have any.
fn identical(files: &Files, welded: &Welded) -> BTreeMap<[usize; 2], u64> {
    let mut of_files = BTreeMap::new();
    if welded.aliases().is_empty() {
        return of_files;
    }
    let joined = Bits::new(files.surface.vertices());
    welded.aliases().iter().for_each(|&(later, earlier)| [later, earlier].iter().for_each(|&v| joined.set(v)));
    let all = Mutex::new(Vec::new());
    files.each_triangle(
        |found: &mut Vec<([u64; 3], usize)>, file, corners| {
            if corners.iter().all(|&v| joined.get(v)) {
                let mut corners = corners.map(|v| welded.representative(v));
                corners.sort_unstable();
                found.push((corners, file));
            }
        },
        |found| all.lock().unwrap_or_else(PoisonError::into_inner).extend(found),
    );
    let mut all = all.into_inner().unwrap_or_else(PoisonError::into_inner);
    all.sort_unstable();
    // A triangle that one file has twice is its own affair.
    all.dedup();
    for same in all.chunk_by(|a, b| a.0 == b.0) {
        for (i, &(_, first)) in same.iter().enumerate() {
            same[i + 1..].iter().for_each(|&(_, second)| *of_files.entry([first, second]).or_insert(0) += 1);
        }
    }
    of_files
}
