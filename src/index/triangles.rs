//! Triangles are sorted into the cells of their centroids, and by their corners within.
//!
//! They arrive in the shard of their lowest corner. A centroid lies no further south than that, so what
//! does not stay goes on to the north: shards are worked in order, some at a time, and carry over.

use super::identity::{Id, Numbers};
use super::order::Sorter;
use super::shards::{Shard, by_cell, holding, of_rows};
use super::{CellGrid, Sums};
use crate::geometry::{DVec3, triangle_area, triangle_centroid};
use crate::store::{Column, Scatter, StoreError};
use rayon::prelude::*;
use std::ops::Range;

/// Memory for each triangle of a shard while it is sorted, with its share of the vertices, bytes.
pub(super) const SORTING_BYTES: u64 = 72;

/// A triangle with its cell in a shard: its number in the input, and its corners.
type Placed<I> = (u32, [I; 4]);

/// Marks a triangle that does not stay in its shard.
const BEYOND: u32 = u32::MAX;

/// What goes on to a later shard: triangles, and corners of triangles that stay behind.
#[derive(Clone, Default)]
struct Arriving<I> {
    triangles: Vec<Placed<I>>,
    corners: Vec<u64>,
}

/// Where the sorted triangles go.
pub(super) struct Sorted<'a> {
    pub(super) positions: &'a Column<DVec3>,
    pub(super) corners: &'a Numbers<3>,
    pub(super) inputs: &'a Numbers<1>,
    pub(super) valences: &'a Column<u16>,
}

/// What the triangles of a survey became.
pub(super) struct SortedTriangles {
    /// The first triangle of each cell, with the end behind the last.
    pub(super) start: Vec<u64>,
    /// Of each shard its triangles, and checksums of what it wrote: valences, corners, inputs.
    pub(super) written: Vec<(Range<u64>, [u64; 3])>,
    /// The sums over all triangles.
    pub(super) sums: Sums,
}

/// What a shard found before it knows what comes from the south.
struct Prepared<I> {
    blocks: Vec<Vec<[I; 4]>>,
    /// The cell of each triangle of the blocks, from the shard's first; [`BEYOND`] for one that moves on.
    cells: Vec<u32>,
    /// Triangles that move on, with their cells in the survey.
    beyond: Vec<(u64, [I; 4])>,
    valences: Vec<u16>,
    /// Corners in later shards.
    corners_beyond: Vec<u64>,
    sums: Sums,
}

/// Sorts the triangles into the columns.
///
/// Triangles get their numbers by the cell of their centroid, row by row, then by their vertices' numbers,
/// then by their place in the input. `together` shards are worked at a time.
pub(super) fn sort<I: Id>(
    scatter: &Scatter<[I; 4]>,
    grid: &CellGrid,
    (shards, together): (&[Shard], usize),
    to: &Sorted,
) -> Result<SortedTriangles, StoreError> {
    let mut start = Vec::with_capacity(grid.len() + 1);
    start.push(0);
    let mut sums = Sums::NOTHING;
    let mut written = Vec::with_capacity(shards.len());
    let of_rows = of_rows(shards);
    let mut arriving: Vec<Arriving<I>> = vec![Arriving::default(); shards.len()];
    for wave in (0..shards.len()).collect::<Vec<_>>().chunks(together) {
        let mut prepared = wave
            .par_iter()
            .with_max_len(1)
            .map(|&i| prepare(scatter.take(i)?, grid, &shards[i], to.positions))
            .collect::<Result<Vec<_>, _>>()?;
        for shard in &mut prepared {
            for (cell, triangle) in std::mem::take(&mut shard.beyond) {
                let to = of_rows[(cell / u64::from(grid.columns)) as usize] as usize;
                let cell = cell - shards[to].cells(grid).start as u64;
                arriving[to].triangles.push((cell as u32, triangle));
            }
            for corner in std::mem::take(&mut shard.corners_beyond) {
                arriving[holding(shards, corner)].corners.push(corner);
            }
            sums = sums.merge(shard.sums.clone());
        }
        let mut first = start.last().copied().unwrap_or(0);
        let jobs: Vec<_> = wave
            .iter()
            .zip(prepared)
            .map(|(&i, prepared)| {
                let more = std::mem::take(&mut arriving[i]);
                let stay = prepared.cells.iter().filter(|&&cell| cell != BEYOND).count();
                let range = first..first + (stay + more.triangles.len()) as u64;
                first = range.end;
                (i, prepared, more, range)
            })
            .collect();
        let finished = jobs
            .into_par_iter()
            .with_max_len(1)
            .map(|(i, prepared, more, range)| {
                let cells = shards[i].cells(grid).len();
                let (ends, sums) = finish(prepared, more, range.start, (&shards[i], cells), to)?;
                Ok((ends, (range, sums)))
            })
            .collect::<Result<Vec<_>, _>>()?;
        for (ends, of_shard) in finished {
            start.extend(ends);
            written.push(of_shard);
        }
    }
    Ok(SortedTriangles { start, written, sums })
}

fn prepare<I: Id>(
    blocks: Vec<Vec<[I; 4]>>,
    grid: &CellGrid,
    shard: &Shard,
    positions: &Column<DVec3>,
) -> Result<Prepared<I>, StoreError> {
    let mut near = Vec::new();
    positions.read(shard.window.clone(), &mut near)?;
    let far = Far::read(blocks.iter().flatten(), shard, positions)?;
    let place = |v: u64| match near.get((v - shard.window.start) as usize) {
        Some(&p) => p,
        None => far.position(v),
    };
    let mut cells = Vec::with_capacity(blocks.iter().map(Vec::len).sum());
    let (mut beyond, mut corners_beyond, mut sums) = (Vec::new(), Vec::new(), Sums::NOTHING);
    let mut valences = vec![0u16; (shard.vertices.end - shard.vertices.start) as usize];
    let (of_shard, finder) = (shard.cells(grid), grid.finder());
    blocks.iter().flatten().for_each(|&record| {
        let numbers = [record[1].number(), record[2].number(), record[3].number()];
        let corners = numbers.map(place);
        let cell = grid.number(finder.cell_of(triangle_centroid(corners)));
        sums.add(corners, triangle_area(corners));
        if of_shard.contains(&cell) {
            cells.push((cell - of_shard.start) as u32);
        } else {
            cells.push(BEYOND);
            beyond.push((cell as u64, record));
        }
        for v in numbers {
            match valences.get_mut((v - shard.vertices.start) as usize) {
                Some(valence) => *valence = valence.saturating_add(1),
                None => corners_beyond.push(v),
            }
        }
    });
    Ok(Prepared { blocks, cells, beyond, valences, corners_beyond, sums })
}

/// Numbers its triangles from `first` on and returns the end of each of its cells, and checksums of what it wrote.
fn finish<I: Id>(
    prepared: Prepared<I>,
    more: Arriving<I>,
    first: u64,
    (shard, cells): (&Shard, usize),
    to: &Sorted,
) -> Result<(Vec<u64>, [u64; 3]), StoreError> {
    let Prepared { blocks, cells: cell_of, mut valences, .. } = prepared;
    for corner in more.corners {
        let valence = &mut valences[(corner - shard.vertices.start) as usize];
        *valence = valence.saturating_add(1);
    }
    let mut writer = to.valences.writer(shard.vertices.start);
    valences.into_iter().try_for_each(|valence| writer.put(valence))?;
    let valences = writer.finish()?;
    let (triangles, start) = by_cell(cells, || {
        let own = cell_of.iter().copied().zip(blocks.iter().flatten().copied());
        own.filter(|&(cell, _)| cell != BEYOND).chain(more.triangles.iter().copied())
    });
    drop((blocks, cell_of));
    let lowest = triangles.iter().map(|t| t[1].number()).min().unwrap_or(0);
    // The first two corners say nearly all; triangles that share an edge and are turned alike are rare.
    let rough = |t: &[I; 4]| {
        let above = |corner: I| corner.number() - lowest;
        if above(t[1]) > u64::from(u32::MAX) {
            u64::MAX
        } else {
            above(t[1]) << 32 | above(t[2]).min(u64::from(u32::MAX))
        }
    };
    let key = |&[input, a, b, c]: &[I; 4]| [a, b, c, input];
    let (mut corners, mut inputs) = (to.corners.writer(first), to.inputs.writer(first));
    let mut sorter = Sorter::default();
    for cell in start.windows(2) {
        let triangles = &triangles[cell[0] as usize..cell[1] as usize];
        for i in sorter.places(triangles, rough, |a, b| key(a).cmp(&key(b))) {
            let [input, a, b, c] = triangles[i];
            corners.put([a.number(), b.number(), c.number()])?;
            inputs.put([input.number()])?;
        }
    }
    let ends = start[1..].iter().map(|&s| first + u64::from(s)).collect();
    Ok((ends, [valences, corners.finish()?, inputs.finish()?]))
}

/// Corners beyond a shard's window: long triangles, of which there are few.
struct Far {
    vertices: Vec<u64>,
    positions: Vec<DVec3>,
}

impl Far {
    fn read<'a, I: Id + 'a>(
        records: impl Iterator<Item = &'a [I; 4]>,
        shard: &Shard,
        column: &Column<DVec3>,
    ) -> Result<Far, StoreError> {
        let mut vertices = Vec::new();
        records.for_each(|&[_, a, b, c]| {
            vertices.extend([a, b, c].map(Id::number).into_iter().filter(|&v| v >= shard.window.end));
        });
        vertices.sort_unstable();
        vertices.dedup();
        let mut positions = Vec::with_capacity(vertices.len());
        for &v in &vertices {
            column.read(v..v + 1, &mut positions)?;
        }
        Ok(Far { vertices, positions })
    }

    fn position(&self, vertex: u64) -> DVec3 {
        self.positions[self.vertices.partition_point(|&v| v < vertex)]
    }
}
