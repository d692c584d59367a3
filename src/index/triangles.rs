//! Triangles are sorted into the cells of their centroids, and by their corners within.
//!
//! They arrive in the shard of their lowest corner. A centroid lies no further south than that, so what
//! does not stay goes on to the north: shards are worked in order, some at a time, and carry over.

use super::identity::{Id, Numbers};
use super::shards::{Shard, by_cell, holding};
use super::vertices::points;
use super::{CellGrid, Sums};
use crate::geometry::{DVec3, triangle_area, triangle_centroid};
use crate::store::{Column, Scatter, StoreError};
use rayon::prelude::*;

/// Memory for each triangle of a shard while it is sorted, with its share of the vertices, bytes.
pub(super) const SORTING_BYTES: u64 = 72;

/// A triangle with its cell: its number in the input, and its corners.
type Placed<I> = (u64, [I; 4]);

/// Where the sorted triangles go.
pub(super) struct Sorted<'a> {
    pub(super) positions: &'a Column<[f64; 3]>,
    pub(super) corners: &'a Numbers<3>,
    pub(super) inputs: &'a Numbers<1>,
    pub(super) valences: &'a Column<u16>,
}

/// What a shard found before it knows what comes from the south.
struct Prepared<I> {
    own: Vec<Placed<I>>,
    beyond: Vec<Placed<I>>,
    valences: Vec<u16>,
    /// Corners in later shards.
    corners_beyond: Vec<u64>,
    sums: Sums,
}

/// Sorts the triangles into the columns. Returns the first triangle of each cell, with the end behind the
/// last, and the sums over all triangles.
///
/// Triangles get their numbers by the cell of their centroid, row by row, then by their vertices' numbers,
/// then by their place in the input.
pub(super) fn sort<I: Id>(
    scatter: &Scatter<[I; 4]>,
    grid: &CellGrid,
    shards: &[Shard],
    to: &Sorted,
) -> Result<(Vec<u64>, Sums), StoreError> {
    let mut start = Vec::with_capacity(grid.len() + 1);
    start.push(0);
    let mut sums = Sums::NOTHING;
    let mut arriving: Vec<(Vec<Placed<I>>, Vec<u64>)> = vec![Default::default(); shards.len()];
    for wave in (0..shards.len()).collect::<Vec<_>>().chunks(rayon::current_num_threads()) {
        let mut prepared = wave
            .par_iter()
            .with_max_len(1)
            .map(|&i| prepare(scatter.read(i)?, grid, &shards[i], to.positions))
            .collect::<Result<Vec<_>, _>>()?;
        for shard in &mut prepared {
            for placed in std::mem::take(&mut shard.beyond) {
                let row = (placed.0 / u64::from(grid.columns)) as u32;
                arriving[shards.partition_point(|s| s.rows.end <= row)].0.push(placed);
            }
            for corner in std::mem::take(&mut shard.corners_beyond) {
                arriving[holding(shards, corner)].1.push(corner);
            }
            sums = sums.merge(shard.sums.clone());
        }
        let mut first = start.last().copied().unwrap_or(0);
        let jobs: Vec<_> = wave
            .iter()
            .zip(prepared)
            .map(|(&i, prepared)| {
                let (more, corners) = std::mem::take(&mut arriving[i]);
                let at = first;
                first += (prepared.own.len() + more.len()) as u64;
                (i, prepared, more, corners, at)
            })
            .collect();
        let starts = jobs
            .into_par_iter()
            .with_max_len(1)
            .map(|(i, prepared, more, corners, at)| finish(prepared, (more, corners), at, grid, &shards[i], to))
            .collect::<Result<Vec<_>, _>>()?;
        starts.into_iter().for_each(|of_shard| start.extend(of_shard));
    }
    Ok((start, sums))
}

fn prepare<I: Id>(
    records: Vec<[I; 4]>,
    grid: &CellGrid,
    shard: &Shard,
    positions: &Column<[f64; 3]>,
) -> Result<Prepared<I>, StoreError> {
    let near = points(positions, shard.window.clone())?;
    let far = Far::read(&records, shard, positions)?;
    let place = |v: u64| match near.get((v - shard.window.start) as usize) {
        Some(&p) => p,
        None => far.position(v),
    };
    let mut found = Prepared {
        own: Vec::with_capacity(records.len()),
        beyond: Vec::new(),
        valences: vec![0; (shard.vertices.end - shard.vertices.start) as usize],
        corners_beyond: Vec::new(),
        sums: Sums::NOTHING,
    };
    let cells = shard.cells(grid);
    for record in records {
        let numbers = [record[1].number(), record[2].number(), record[3].number()];
        let corners = numbers.map(place);
        let cell = grid.number(grid.cell_of(triangle_centroid(corners)));
        found.sums.add(corners, triangle_area(corners));
        if cells.contains(&cell) {
            found.own.push((cell as u64, record));
        } else {
            found.beyond.push((cell as u64, record));
        }
        for v in numbers {
            match found.valences.get_mut((v - shard.vertices.start) as usize) {
                Some(valence) => *valence = valence.saturating_add(1),
                None => found.corners_beyond.push(v),
            }
        }
    }
    Ok(found)
}

/// Numbers its triangles from `first` on and returns the end of each of its cells.
fn finish<I: Id>(
    prepared: Prepared<I>,
    (more, corners): (Vec<Placed<I>>, Vec<u64>),
    first: u64,
    grid: &CellGrid,
    shard: &Shard,
    to: &Sorted,
) -> Result<Vec<u64>, StoreError> {
    let Prepared { mut own, mut valences, .. } = prepared;
    own.extend(more);
    for corner in corners {
        let valence = &mut valences[(corner - shard.vertices.start) as usize];
        *valence = valence.saturating_add(1);
    }
    to.valences.write(shard.vertices.start, valences)?;
    let cells = shard.cells(grid);
    let cell_of: Vec<u32> = own.iter().map(|placed| (placed.0 - cells.start as u64) as u32).collect();
    let (mut order, start) = by_cell(cells.len(), &cell_of);
    drop(cell_of);
    let mut keyed: Vec<([I; 4], u32)> = Vec::new();
    for cell in start.windows(2) {
        let order = &mut order[cell[0] as usize..cell[1] as usize];
        keyed.clear();
        keyed.extend(order.iter().map(|&i| {
            let [input, a, b, c] = own[i as usize].1;
            ([a, b, c, input], i)
        }));
        keyed.sort_unstable();
        order.iter_mut().zip(&keyed).for_each(|(place, key)| *place = key.1);
    }
    let sorted = || order.iter().map(|&i| own[i as usize].1);
    to.corners.write(first, sorted().map(|[_, a, b, c]| [a.number(), b.number(), c.number()]))?;
    to.inputs.write(first, sorted().map(|[input, ..]| [input.number()]))?;
    Ok(start[1..].iter().map(|&s| first + u64::from(s)).collect())
}

/// Corners beyond a shard's window: long triangles, of which there are few.
struct Far {
    vertices: Vec<u64>,
    positions: Vec<DVec3>,
}

impl Far {
    fn read<I: Id>(records: &[[I; 4]], shard: &Shard, column: &Column<[f64; 3]>) -> Result<Far, StoreError> {
        let corners = records.iter().flat_map(|r| r[1..].iter().map(|c| c.number()));
        let mut vertices: Vec<u64> = corners.filter(|&v| v >= shard.window.end).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let mut positions = Vec::with_capacity(vertices.len());
        for &v in &vertices {
            column.each(v..v + 1, |p| positions.push(DVec3::from_array(p)))?;
        }
        Ok(Far { vertices, positions })
    }

    fn position(&self, vertex: u64) -> DVec3 {
        self.positions[self.vertices.partition_point(|&v| v < vertex)]
    }
}
