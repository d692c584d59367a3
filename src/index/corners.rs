//! The corners of every triangle get the vertices' new numbers: a join that needs no random access to disk.
//!
//! The new numbers of a block of the input's vertices are held in memory, and all triangles pass by. Where
//! one block does not hold all vertices, the triangles pass once for each block, through a scratch column.

use super::identity::{Id, Numbers};
use super::shards::{Shard, holding};
use crate::open::Surface;
use crate::open::{over_chunks, over_chunks_then, pieces};
use crate::store::{Scatter, Shelf, StoreError};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

/// Marks a corner that has its new number.
const KNOWN: u64 = 1 << 63;
/// Numbers read at a time.
const PIECE: u64 = 1 << 16;

/// New numbers of a block of the input's vertices; the upper halves only where there are any.
struct Block {
    input: Range<u64>,
    low: Vec<AtomicU32>,
    high: Vec<AtomicU32>,
}

/// Vertices of a block, at least.
const LEAST_VERTICES: u64 = 1 << 12;

/// Bytes of a block for each vertex.
fn block_bytes(vertices: u64) -> u64 {
    if vertices > u64::from(u32::MAX) { 8 } else { 4 }
}

impl Block {
    /// `inputs` holds the input's number of each vertex, by its new number.
    fn read(inputs: &Numbers<1>, input: Range<u64>) -> Result<Block, StoreError> {
        let len = (input.end - input.start) as usize;
        let zeros = |n: usize| (0..n).map(|_| AtomicU32::new(0)).collect::<Vec<_>>();
        let wide = inputs.len() > u64::from(u32::MAX);
        let block = Block { input, low: zeros(len), high: zeros(if wide { len } else { 0 }) };
        (0..inputs.len().div_ceil(PIECE)).into_par_iter().try_for_each(|piece| {
            let mut number = piece * PIECE;
            inputs.each_slice(number..(number + PIECE).min(inputs.len()), |inputs| {
                for &[input] in inputs {
                    let at = input.wrapping_sub(block.input.start);
                    if at < block.low.len() as u64 {
                        block.low[at as usize].store(number as u32, Ordering::Relaxed);
                        if let Some(high) = block.high.get(at as usize) {
                            high.store((number >> 32) as u32, Ordering::Relaxed);
                        }
                    }
                    number += 1;
                }
            })
        })?;
        Ok(block)
    }

    #[inline]
    fn resolve(&self, corner: u64) -> u64 {
        // A corner that has its new number lies above all blocks, by its mark.
        let at = corner.wrapping_sub(self.input.start);
        if at >= self.low.len() as u64 {
            return corner;
        }
        let high = self.high.get(at as usize).map_or(0, |high| u64::from(high.load(Ordering::Relaxed)) << 32);
        KNOWN | high | u64::from(self.low[at as usize].load(Ordering::Relaxed))
    }
}

/// Memory for the join, bytes: for the new numbers that are held at once, and for triangles that wait for their
/// shard.
#[derive(Clone, Copy)]
pub(super) struct JoinRoom {
    pub(super) block: u64,
    pub(super) waiting: u64,
}

/// Scatters the triangles to the shards of their lowest corners: the triangle's place in the input, then
/// its corners by their new numbers, the lowest first and the winding kept.
pub(super) fn scatter<I: Id>(
    surface: &dyn Surface,
    inputs: &Numbers<1>,
    shards: &[Shard],
    shelf: &Shelf,
    room: JoinRoom,
) -> Result<Scatter<[I; 4]>, StoreError> {
    let scatter = Scatter::<[I; 4]>::new(shelf, "triangles", shards.len(), room.waiting)?;
    let block_vertices = (room.block / block_bytes(inputs.len())).max(LEAST_VERTICES);
    let blocks = surface.vertices().div_ceil(block_vertices).max(1);
    let passing =
        if blocks > 1 { Some(shelf.create::<[u64; 3]>("corners.scratch", surface.triangles())?) } else { None };
    for k in 0..blocks {
        let input = k * block_vertices..((k + 1) * block_vertices).min(surface.vertices());
        let block = Block::read(inputs, input)?;
        let read = |range: Range<u64>, corners: &mut Vec<[u64; 3]>| match &passing {
            Some(column) if k > 0 => {
                corners.clear();
                column.read(range, corners)
            }
            _ => {
                surface.corner_numbers(range, corners);
                Ok(())
            }
        };
        match &passing {
            Some(column) if k + 1 < blocks => over_chunks(
                surface,
                surface.triangles(),
                || Ok(Vec::new()),
                |corners, range| {
                    read(range.clone(), corners)?;
                    column.write(range.start, corners.iter().map(|corners| corners.map(|c| block.resolve(c))))
                },
            )?,
            _ => over_chunks_then(
                surface,
                surface.triangles(),
                || Ok((scatter.writer(), Vec::new())),
                |(writer, corners), range| {
                    let mut last = 0;
                    for piece in pieces(range) {
                        read(piece.clone(), corners)?;
                        for (t, &corners) in piece.zip(&*corners) {
                            let [a, b, c] = lowest_first(corners.map(|c| block.resolve(c) & !KNOWN));
                            if !shards[last].vertices.contains(&a) {
                                last = holding(shards, a);
                            }
                            writer.put(last, [I::of(t), I::of(a), I::of(b), I::of(c)])?;
                        }
                    }
                    Ok(())
                },
                |(writer, _)| writer.finish(),
            )?,
        }
    }
    if passing.is_some() {
        shelf.remove("corners.scratch");
    }
    Ok(scatter)
}

/// The corners turned so that the lowest comes first; where that is there twice, it comes second as well.
fn lowest_first([a, b, c]: [u64; 3]) -> [u64; 3] {
    let turned = if a <= b && a <= c {
        [a, b, c]
    } else if b <= c {
        [b, c, a]
    } else {
        [c, a, b]
    };
    match turned {
        [first, second, last] if last == first => [last, first, second],
        turned => turned,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_the_same_whichever_corner_the_file_names_first() {
        for corners in [[4, 7, 9], [9, 7, 4], [4, 4, 7], [7, 7, 4], [4, 4, 4]] {
            let mut turned = corners;
            for _ in 0..3 {
                turned.rotate_left(1);
                assert_eq!(lowest_first(turned), lowest_first(corners), "{turned:?}");
            }
            let [a, b, c] = lowest_first(corners);
            assert!(a <= b && a <= c && [[a, b, c], [b, c, a], [c, a, b]].contains(&corners), "{corners:?}");
        }
    }
}
