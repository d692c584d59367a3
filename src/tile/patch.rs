//! A patch: the triangles of a block of cells with their vertices, read from the index.

use super::read::read_of;
use super::runs::{Lookup, Runs};
use crate::geometry::DVec3;
use crate::index::{CellBlock, Index};
use crate::store::StoreError;
use rayon::prelude::*;
use std::ops::Range;

/// Triangles whose centroid lies in a block of cells, with their vertices. Those outside the block, of which
/// triangles at its border have a few, are among them.
#[derive(Debug, Clone, Default)]
pub struct Patch {
    /// The survey's numbers of the vertices.
    pub vertices: Runs,
    /// Their positions, local metres.
    pub positions: Vec<DVec3>,
    /// The survey's numbers of the triangles.
    pub triangles: Runs,
    /// Their corners, as local numbers.
    pub corners: Vec<[u32; 3]>,
}

/// Triangles that one thread reads at a time.
const PIECE: usize = if cfg!(test) { 3 } else { 1 << 15 };

impl Patch {
    /// Reads a block of cells.
    ///
    /// # Errors
    /// The index cannot be read.
    pub fn load(index: &Index, block: &CellBlock) -> Result<Patch, StoreError> {
        let triangles = Runs::new(index.triangles.ranges(&index.grid, block));
        let inside = Runs::new(index.vertices.ranges(&index.grid, block));
        let (mut corners, outside) = corners(index, &triangles, &inside)?;
        let vertices = with_outside(&inside, &outside, &mut corners);
        let positions = read_of(index.positions(), &vertices)?;
        Ok(Patch { vertices, positions, triangles, corners })
    }

    /// The corners of every triangle, local metres.
    pub fn each_corners(&self) -> impl ExactSizeIterator<Item = [DVec3; 3]> + '_ {
        self.corners.iter().map(|corners| corners.map(|v| self.positions[v as usize]))
    }
}

/// Takes the triangles of a block by their corners, local metres.
pub(super) trait TakeTriangles {
    /// The next triangle.
    fn add(&mut self, corners: [DVec3; 3]);
    /// Another one in the place of one that was added.
    fn replace(&mut self, place: usize, corners: [DVec3; 3]);
}

/// Hands all triangles of a block to `to`, in order. Those with a vertex outside the block are added with places that
/// mean nothing, and replaced at the end.
///
/// # Errors
/// The index cannot be read.
pub(super) fn each_triangle(index: &Index, block: &CellBlock, to: &mut impl TakeTriangles) -> Result<(), StoreError> {
    let inside = Runs::new(index.vertices.ranges(&index.grid, block));
    let positions = read_of(index.positions(), &inside)?;
    let mut lookup = Lookup::new(&inside);
    let mut cut: Vec<(usize, [u64; 3])> = Vec::new();
    let mut triangle = 0;
    for range in index.triangles.ranges(&index.grid, block) {
        index.each_corners(range, |triangles| {
            for &numbers in triangles {
                let locals = numbers.map(|number| lookup.local(number));
                if locals.contains(&None) {
                    cut.push((triangle, numbers));
                }
                to.add(locals.map(|v| v.map_or(DVec3::ZERO, |v| positions[v as usize])));
                triangle += 1;
            }
        })?;
    }
    let mut outside: Vec<u64> =
        cut.iter().flat_map(|(_, numbers)| numbers).copied().filter(|&v| inside.local(v).is_none()).collect();
    outside.sort_unstable();
    outside.dedup();
    let outside = Runs::new(outside.into_iter().map(|v| v..v + 1).collect());
    let beyond = read_of(index.positions(), &outside)?;
    for (triangle, numbers) in cut {
        let position = |v: u64| match (inside.local(v), outside.local(v)) {
            (Some(local), _) => positions[local as usize],
            (None, Some(local)) => beyond[local as usize],
            (None, None) => DVec3::ZERO,
        };
        to.replace(triangle, numbers.map(position));
    }
    Ok(())
}

/// Vertices outside a block, piece by piece of its triangles in the order in which they were met.
type Met = Vec<Vec<u64>>;

/// Corners of the triangles as local numbers, piece by piece on all threads: those of `inside`, and behind them, in
/// the order in which a piece meets them, each time anew, those outside, which are returned for each piece by their
/// survey numbers.
fn corners(index: &Index, triangles: &Runs, inside: &Runs) -> Result<(Vec<[u32; 3]>, Met), StoreError> {
    let mut corners = vec![[0; 3]; triangles.len()];
    let read = |(piece, corners): (usize, &mut [[u32; 3]])| {
        let mut outside = Vec::new();
        let mut lookup = Lookup::new(inside);
        let first = (PIECE * piece) as u32;
        let mut to = corners.iter_mut();
        for range in triangles.within(first..first + to.len() as u32) {
            index.each_corners(range, |triangles| {
                for (numbers, to) in triangles.iter().zip(&mut to) {
                    *to = numbers.map(|number| {
                        lookup.local(number).unwrap_or_else(|| {
                            outside.push(number);
                            (inside.len() + outside.len() - 1) as u32
                        })
                    });
                }
            })?;
        }
        Ok(outside)
    };
    let outside: Result<Met, StoreError> = corners.par_chunks_mut(PIECE).enumerate().map(read).collect();
    Ok((corners, outside?))
}

/// Puts the vertices outside into their places, so that local numbers ascend with those of the survey.
fn with_outside(inside: &Runs, met: &Met, corners: &mut [[u32; 3]]) -> Runs {
    let mut outside = met.concat();
    if outside.is_empty() {
        return inside.clone();
    }
    outside.sort_unstable();
    outside.dedup();
    let mut ranges: Vec<Range<u64>> = Vec::with_capacity(inside.ranges().len() + outside.len());
    let mut between = outside.iter().copied().peekable();
    let add = |ranges: &mut Vec<Range<u64>>, range: Range<u64>| match ranges.last_mut() {
        Some(last) if last.end == range.start => last.end = range.end,
        _ => ranges.push(range),
    };
    // How many vertices outside come before each run inside.
    let mut shift = Vec::with_capacity(inside.ranges().len());
    let mut shifted = 0u32;
    for range in inside.ranges() {
        while let Some(v) = between.next_if(|&v| v < range.start) {
            add(&mut ranges, v..v + 1);
            shifted += 1;
        }
        shift.push(shifted);
        add(&mut ranges, range.clone());
    }
    between.for_each(|v| add(&mut ranges, v..v + 1));
    let all = Runs::new(ranges);
    let ends: Vec<u32> = inside
        .ranges()
        .iter()
        .scan(0, |end, range| {
            *end += (range.end - range.start) as u32;
            Some(*end)
        })
        .collect();
    corners.par_chunks_mut(PIECE).zip(met).for_each(|(corners, met)| {
        let of_met: Vec<u32> = met.iter().filter_map(|&v| all.local(v)).collect();
        let mut run = 0;
        for corner in corners.iter_mut().flatten() {
            if let Some(&local) = (*corner as usize).checked_sub(inside.len()).and_then(|i| of_met.get(i)) {
                *corner = local;
                continue;
            }
            let start = |run: usize| if run == 0 { 0 } else { ends[run - 1] };
            if !(start(run) <= *corner && *corner < ends[run]) {
                run = ends.partition_point(|&end| end <= *corner);
            }
            *corner += shift[run];
        }
    });
    all
}
