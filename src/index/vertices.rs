//! Vertices are sorted into cells, and by position within.

use super::chunks::over_chunks_then;
use super::ground::Ground;
use super::identity::Numbers;
use super::shards::{Shard, by_cell};
use crate::geometry::DVec3;
use crate::open::Surface;
use crate::store::{Column, Element, Scatter, Shelf, StoreError};
use rayon::prelude::*;

/// A vertex on its way to its shard.
#[derive(Clone, Copy)]
struct Record {
    cell: u32,
    color: [f32; 3],
    input: u64,
    position: [f64; 3],
}

impl Element for Record {
    const BYTES: usize = 48;
    #[inline(always)]
    fn put(self, to: &mut [u8]) {
        self.cell.put(&mut to[..4]);
        self.color.put(&mut to[4..16]);
        self.input.put(&mut to[16..24]);
        self.position.put(&mut to[24..48]);
    }
    #[inline(always)]
    fn get(from: &[u8]) -> Self {
        Record {
            cell: u32::get(&from[..4]),
            color: Element::get(&from[4..16]),
            input: u64::get(&from[16..24]),
            position: Element::get(&from[24..48]),
        }
    }
}

/// Memory for each vertex of a shard while it is sorted, bytes.
pub(super) const SORTING_BYTES: u64 = Record::BYTES as u64 + 24 + 16;

/// Where the sorted vertices go.
pub(super) struct Sorted<'a> {
    pub(super) positions: &'a Column<[f64; 3]>,
    pub(super) inputs: &'a Numbers<1>,
    pub(super) colors: Option<&'a Column<[f32; 3]>>,
}

/// Sorts the vertices that triangles use into the columns, and returns the first vertex of each cell, with
/// the end behind the last.
///
/// Vertices get their numbers by cell, row by row from the south-west, then by x, y, z, then by their place
/// in the input: what is the same surface gets the same numbers, in whatever order its file is.
pub(super) fn sort(
    surface: &dyn Surface,
    ground: &Ground,
    shards: &[Shard],
    shelf: &Shelf,
    to: &Sorted,
) -> Result<Vec<u64>, StoreError> {
    let scatter = Scatter::<Record>::new(shelf, "vertices", shards.len())?;
    let grid = &ground.grid;
    over_chunks_then(
        surface,
        surface.vertices(),
        || Ok(scatter.writer()),
        |writer, range| {
            for input in range.filter(|&v| ground.used.get(v)) {
                let p = surface.position(input);
                let [column, row] = grid.cell_of(p);
                let shard = shards.partition_point(|s| s.rows.end <= row);
                let cell = grid.number([column, row - shards[shard].rows.start]) as u32;
                let color = surface.raw_color(input);
                writer.put(shard, Record { cell, color, input, position: p.to_array() })?;
            }
            Ok(())
        },
        |writer| writer.finish(),
    )?;
    let starts = (0..shards.len())
        .into_par_iter()
        .with_max_len(1)
        .map(|i| sort_shard(&scatter, i, &shards[i], grid.columns as usize, to))
        .collect::<Result<Vec<_>, _>>()?;
    let mut start = Vec::with_capacity(grid.len() + 1);
    for (shard, of_shard) in shards.iter().zip(starts) {
        let cells = of_shard.len() - 1;
        start.extend(of_shard[..cells].iter().map(|&s| shard.vertices.start + u64::from(s)));
    }
    start.push(ground.vertices);
    Ok(start)
}

fn sort_shard(
    scatter: &Scatter<Record>,
    bucket: usize,
    shard: &Shard,
    columns: usize,
    to: &Sorted,
) -> Result<Vec<u32>, StoreError> {
    let records = scatter.read(bucket)?;
    let cell_of: Vec<u32> = records.iter().map(|r| r.cell).collect();
    let (mut order, start) = by_cell(shard.rows.len() * columns, &cell_of);
    let mut keyed: Vec<(u64, u32)> = Vec::new();
    for cell in start.windows(2) {
        let order = &mut order[cell[0] as usize..cell[1] as usize];
        keyed.clear();
        keyed.extend(order.iter().map(|&i| (ascending(records[i as usize].position[0]), i)));
        keyed.sort_unstable_by(|a, b| {
            a.0.cmp(&b.0).then_with(|| {
                let (a, b) = (&records[a.1 as usize], &records[b.1 as usize]);
                let key = |r: &Record| [ascending(r.position[1]), ascending(r.position[2]), r.input];
                key(a).cmp(&key(b))
            })
        });
        order.iter_mut().zip(&keyed).for_each(|(place, key)| *place = key.1);
    }
    let sorted = || order.iter().map(|&i| &records[i as usize]);
    to.positions.write(shard.vertices.start, sorted().map(|r| r.position))?;
    to.inputs.write(shard.vertices.start, sorted().map(|r| [r.input]))?;
    if let Some(colors) = to.colors {
        colors.write(shard.vertices.start, sorted().map(|r| r.color))?;
    }
    Ok(start)
}

/// Bits that sort as the finite numbers do.
fn ascending(x: f64) -> u64 {
    // -0.0 and 0.0 are one place.
    let bits = (x + 0.0).to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

/// Reads positions as points.
pub(super) fn points(column: &Column<[f64; 3]>, range: std::ops::Range<u64>) -> Result<Vec<DVec3>, StoreError> {
    let mut found = Vec::with_capacity((range.end - range.start) as usize);
    column.each(range, |p| found.push(DVec3::from_array(p)))?;
    Ok(found)
}
