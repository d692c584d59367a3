//! Vertices are sorted into cells, and by position within.

use super::colors::{Color, Colors};
use super::ground::Ground;
use super::identity::{Id, Numbers};
use super::order::Sorter;
use super::shards::{Shard, by_cell, of_rows};
use crate::geometry::DVec3;
use crate::open::Surface;
use crate::open::{over_chunks_then, pieces};
use crate::store::{Column, Element, Scatter, Shelf, StoreError};
use rayon::prelude::*;
use std::cmp::Ordering;

/// A vertex on its way to its shard.
#[derive(Clone, Copy, Default)]
struct Record<I, C> {
    cell: u32,
    input: I,
    color: C,
    position: DVec3,
}

impl<I: Id, C: Color> Element for Record<I, C> {
    const BYTES: usize = 28 + I::BYTES + C::BYTES;
    #[inline(always)]
    fn put(self, to: &mut [u8]) {
        self.cell.put(&mut to[..4]);
        self.position.put(&mut to[4..28]);
        self.input.put(&mut to[28..28 + I::BYTES]);
        self.color.put(&mut to[28 + I::BYTES..]);
    }
    #[inline(always)]
    fn get(from: &[u8]) -> Self {
        Record {
            cell: u32::get(&from[..4]),
            position: DVec3::get(&from[4..28]),
            input: I::get(&from[28..28 + I::BYTES]),
            color: C::get(&from[28 + I::BYTES..]),
        }
    }
}

/// Memory for each vertex of a shard while it is sorted, bytes: its record twice, and the starts of cells.
pub(super) const SORTING_BYTES: u64 = 2 * size_of::<Record<u64, [f32; 3]>>() as u64 + 16;

/// Where the sorted vertices go.
pub(super) struct Sorted<'a> {
    pub(super) positions: &'a Column<DVec3>,
    pub(super) inputs: &'a Numbers<1>,
    pub(super) colors: Option<&'a Colors>,
}

/// What the vertices of a survey became.
pub(super) struct SortedVertices {
    /// The first vertex of each cell, with the end behind the last.
    pub(super) start: Vec<u64>,
    /// Checksums of what each shard wrote: positions, inputs, colours.
    pub(super) checksums: Vec<[u64; 3]>,
}

/// Sorts the vertices that triangles use into the columns.
///
/// Vertices get their numbers by cell, row by row from the south-west, then by x, y, z, then by their place
/// in the input: what is the same surface gets the same numbers, in whatever order its file is. About
/// `room` bytes of what waits for its shard stay in memory.
pub(super) fn sort<I: Id, C: Color>(
    surface: &dyn Surface,
    ground: &Ground,
    shards: &[Shard],
    (shelf, room): (&Shelf, u64),
    to: &Sorted,
) -> Result<SortedVertices, StoreError> {
    let scatter = Scatter::<Record<I, C>>::new(shelf, "vertices", shards.len(), room)?;
    let (grid, finder) = (&ground.grid, ground.grid.finder());
    let of_rows = of_rows(shards);
    over_chunks_then(
        surface,
        surface.vertices(),
        || Ok((scatter.writer(), Vec::new(), Vec::new())),
        |(writer, positions, colors), range| {
            for piece in pieces(range) {
                surface.positions(piece.clone(), positions);
                surface.raw_colors(piece.clone(), colors);
                for (input, (&p, &color)) in piece.zip(positions.iter().zip(&*colors)) {
                    if ground.used.get(input) {
                        let [column, row] = finder.cell_of(p);
                        let shard = of_rows[row as usize] as usize;
                        let cell = grid.number([column, row - shards[shard].rows.start]) as u32;
                        let (input, color) = (I::of(input), C::of(color));
                        writer.put(shard, Record { cell, input, color, position: p })?;
                    }
                }
            }
            Ok(())
        },
        |(writer, ..)| writer.finish(),
    )?;
    let sorted = (0..shards.len())
        .into_par_iter()
        .with_max_len(1)
        .map(|i| sort_shard(scatter.take(i)?, &shards[i], grid.columns as usize, to))
        .collect::<Result<Vec<_>, _>>()?;
    let mut start = Vec::with_capacity(grid.len() + 1);
    let mut checksums = Vec::with_capacity(shards.len());
    for (shard, (of_shard, sums)) in shards.iter().zip(sorted) {
        let cells = of_shard.len() - 1;
        start.extend(of_shard[..cells].iter().map(|&s| shard.vertices.start + u64::from(s)));
        checksums.push(sums);
    }
    start.push(ground.vertices);
    Ok(SortedVertices { start, checksums })
}

fn sort_shard<I: Id, C: Color>(
    blocks: Vec<Vec<Record<I, C>>>,
    shard: &Shard,
    columns: usize,
    to: &Sorted,
) -> Result<(Vec<u32>, [u64; 3]), StoreError> {
    let (records, start) = by_cell(shard.rows.len() * columns, || blocks.iter().flatten().map(|r| (r.cell, *r)));
    drop(blocks);
    let first = shard.vertices.start;
    let (mut positions, mut inputs) = (to.positions.writer(first), to.inputs.writer(first));
    let mut colors = to.colors.map(|colors| colors.writer(first));
    let mut sorter = Sorter::default();
    for cell in start.windows(2) {
        let records = &records[cell[0] as usize..cell[1] as usize];
        // Coordinates are finite, so that one is the lower or both are the same place.
        let exact = |a: &Record<I, C>, b: &Record<I, C>| {
            let (p, q) = (a.position, b.position);
            let order = (p.x, p.y, p.z, a.input).partial_cmp(&(q.x, q.y, q.z, b.input));
            order.unwrap_or(Ordering::Equal)
        };
        for i in sorter.places(records, |r| ascending(r.position.x), exact) {
            positions.put(records[i].position)?;
            inputs.put([records[i].input.number()])?;
            if let Some(colors) = &mut colors {
                colors.put(records[i].color)?;
            }
        }
    }
    let colors = colors.map_or(Ok(0), |colors| colors.finish())?;
    Ok((start, [positions.finish()?, inputs.finish()?, colors]))
}

/// Bits that sort as the finite numbers do.
fn ascending(x: f64) -> u64 {
    // -0.0 and 0.0 are one place.
    let bits = (x + 0.0).to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}
