//! What the kernel asks of an instruction set, and how plain Rust does it.
//!
//! Everything but [`Lanes::sums`] is a filter whose errors the caller bounds: implementations may round as they
//! like. Sums must be the same bits in all.
#![allow(clippy::needless_range_loop, reason = "stencil points and axes run through several arrays at once")]

use super::buffer::{Aligned, Points, SLACK};
use super::weights::{Sums, Weighting, weight};
use crate::geometry::DVec3;
use crate::tile::NormalField;

/// Most candidates that vertices worked together may have.
pub(super) const MOST: usize = 1024;
/// Stencil points that are searched together.
pub(super) const LANES: usize = 32;
/// Vertices that are worked together: six stencil points each.
pub(super) const TOGETHER: usize = LANES / 6;

/// One small number for each stencil point: that of vertex v at +x, -x, +y, -y, +z, -z has lane 6 v and following.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C, align(64))]
pub(super) struct Row(pub(super) [i16; LANES]);

/// Where the stencil points are, such that the rank of a candidate c is scale c² + a·c + b.
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct Places {
    /// -2 scale times the place, 1/m.
    pub(super) a: [[f32; LANES]; 3],
    /// scale times its square.
    pub(super) b: [f32; LANES],
    /// Ranks for a square metre.
    pub(super) scale: f32,
}

/// Ranks of the candidates at the stencil points: squared distances, scaled and rounded to 15 bits.
#[derive(Debug)]
pub(super) struct Keys {
    row: Vec<Row>,
    /// How many candidates are ranked.
    len: usize,
}

impl Keys {
    /// Room for `MOST` candidates.
    pub(super) fn new() -> Keys {
        Keys { row: vec![Row([0; LANES]); MOST], len: 0 }
    }

    /// The rows of this many candidates, to be filled.
    #[inline(always)]
    pub(super) fn start(&mut self, len: usize) -> &mut [Row] {
        self.len = len;
        &mut self.row[..len]
    }

    /// Ranks of each candidate.
    #[inline(always)]
    pub(super) fn rows(&self) -> &[Row] {
        &self.row[..self.len]
    }
}

/// Neighbours of at least one stencil point of a vertex.
#[derive(Debug)]
pub(super) struct Near {
    /// Local triangle numbers.
    pub(super) id: Aligned<u32>,
    /// Place for x, y, z of the offset (metres) and of the normal, `MOST` each.
    pub(super) value: Aligned<f64>,
    /// Which stencil points they belong to: bit `shift` + q for point q.
    pub(super) of: Aligned<u32>,
    /// First bit of the vertex.
    pub(super) shift: usize,
    /// How many.
    pub(super) len: usize,
}

impl Near {
    /// Room for `MOST` neighbours.
    pub(super) fn new() -> Near {
        let room = MOST + SLACK;
        Near { id: Aligned::of(room), value: Aligned::of(6 * MOST), of: Aligned::of(room), shift: 0, len: 0 }
    }
}

/// For each set of eight lanes, their numbers in order, a byte each.
pub(super) static IN_ORDER: [u64; 256] = {
    let mut table = [0; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut to) = (0, 0);
        while lane < 8 {
            if set >> lane & 1 == 1 {
                table[set] |= (lane as u64) << (8 * to);
                to += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
};

/// A vector instruction set, known to be there.
pub(super) trait Lanes: Copy + Send + Sync {
    /// Works one column of vertices compiled for this instruction set.
    fn column(self, column: &mut super::kernel::Column<'_, '_>);

    /// Works a run of columns of the search for nearest centroids.
    fn nearest_run(self, run: &mut super::nearest::Run<'_, '_>);

    /// Keeps the candidates no further than `reach` from some place in a box (given by its centre and half sides) that is
    /// moved by `offset` along an axis, and perhaps others; their coordinates become relative to the centre. With b
    /// how far the candidate is from the box along each axis, and the shift along that of the largest b (which gains
    /// most), the distance is at least that of b with its largest component less by `offset`.
    fn keep_near_box(
        self,
        all: &Points,
        centre: [f32; 3],
        half: [f32; 3],
        reach_and_offset: (f32, f32),
        kept: &mut Points,
    );

    /// Ranks candidates (`MOST` at most) at the stencil points; none may rank 2^31.
    fn rank(self, points: &Points, places: &Places, keys: &mut Keys);

    /// How many candidates rank no higher than the thresholds.
    fn count(self, keys: &Keys, at: &Row) -> Row;

    /// As [`Lanes::count`]; also the highest rank that does not exceed the threshold, and the lowest that does, less 1.
    fn count_between(self, keys: &Keys, at: &Row) -> (Row, Row, Row);

    /// For each candidate, the stencil points where it ranks no higher than the threshold; and those where some
    /// candidate ranks the same; and how many rank no higher.
    fn members(self, keys: &Keys, at: &Row, of: &mut [u32]) -> (u32, Row);

    /// Chooses the candidates that belong to a stencil point in `bits`. From the last one on, `of` has `SLACK` zeros.
    fn choose(self, points: &Points, of: &[u32], bits: u32, near: &mut Near);

    /// Sums at the six stencil points of a vertex. From the last one on, `near.of` has eight zeros.
    fn sums(self, field: &NormalField, vertex: DVec3, near: &mut Near, weighting: &Weighting) -> Sums;
}

/// Plain Rust, for any processor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plain;

#[inline(always)]
fn square(x: f32) -> f32 {
    x * x
}

#[inline(always)]
fn keep(all: &Points, kept: &mut Points, limit: f32, relative: [f32; 3], distance2: impl Fn(f32, f32, f32) -> f32) {
    kept.reserve(all.len);
    let mut n = 0;
    for i in 0..all.len {
        let (x, y, z) = (all.x[i], all.y[i], all.z[i]);
        kept.x[n] = x - relative[0];
        kept.y[n] = y - relative[1];
        kept.z[n] = z - relative[2];
        kept.id[n] = all.id[i];
        n += usize::from(distance2(x, y, z) <= limit);
    }
    kept.len = n;
}

/// Offsets from a vertex and normals of the numbered triangles; then zeros, to the end of a vector.
#[inline(always)]
pub(super) fn fetch(field: &NormalField, vertex: DVec3, near: &mut Near) {
    let value: &mut [f64] = &mut near.value;
    let (x, value) = value.split_at_mut(MOST);
    let (y, value) = value.split_at_mut(MOST);
    let (z, value) = value.split_at_mut(MOST);
    let (nx, value) = value.split_at_mut(MOST);
    let (ny, nz) = value.split_at_mut(MOST);
    for (i, &t) in near.id[..near.len].iter().enumerate() {
        let (u, normal) = (field.centroids[t as usize] - vertex, field.normals[t as usize]);
        (x[i], y[i], z[i]) = (u.x, u.y, u.z);
        (nx[i], ny[i], nz[i]) = (normal.x, normal.y, normal.z);
    }
    for normal in [nx, ny, nz] {
        let end = near.len.next_multiple_of(4);
        normal[near.len..end].fill(0.0);
    }
}

impl Lanes for Plain {
    fn column(self, column: &mut super::kernel::Column<'_, '_>) {
        super::kernel::work(self, column);
    }

    fn nearest_run(self, run: &mut super::nearest::Run<'_, '_>) {
        super::nearest::work(self, run);
    }

    #[inline(always)]
    fn keep_near_box(
        self,
        all: &Points,
        centre: [f32; 3],
        half: [f32; 3],
        (reach, offset): (f32, f32),
        kept: &mut Points,
    ) {
        let beyond = |x: f32, axis: usize| ((x - centre[axis]).abs() - half[axis]).max(0.0);
        keep(all, kept, reach * reach, centre, |x, y, z| {
            let (x, y, z) = (beyond(x, 0), beyond(y, 1), beyond(z, 2));
            let most = x.max(y).max(z);
            square(x) + square(y) + square(z) - square(most) + square((most - offset).max(0.0))
        });
    }

    #[inline(always)]
    fn rank(self, points: &Points, places: &Places, keys: &mut Keys) {
        let [ax, ay, az] = &places.a;
        for (i, row) in keys.start(points.len).iter_mut().enumerate() {
            let (x, y, z) = (points.x[i], points.y[i], points.z[i]);
            let own = (square(x) + square(y) + square(z)) * places.scale;
            for l in 0..LANES {
                let rank = own + places.b[l] + ax[l] * x + ay[l] * y + az[l] * z;
                let rank = if rank < 32767.0 { rank } else { 32767.0 };
                row.0[l] = (rank + 0.5) as i32 as i16;
            }
        }
    }

    #[inline(always)]
    fn count(self, keys: &Keys, at: &Row) -> Row {
        let mut counts = Row([0; LANES]);
        for row in keys.rows() {
            for l in 0..LANES {
                counts.0[l] += i16::from(row.0[l] <= at.0[l]);
            }
        }
        counts
    }

    #[inline(always)]
    fn count_between(self, keys: &Keys, at: &Row) -> (Row, Row, Row) {
        let (mut below, mut above) = (Row([0; LANES]), Row([i16::MAX; LANES]));
        for row in keys.rows() {
            for l in 0..LANES {
                let rank = row.0[l];
                let within = rank <= at.0[l];
                below.0[l] = below.0[l].max(if within { rank } else { 0 });
                above.0[l] = above.0[l].min(if within { i16::MAX } else { rank });
            }
        }
        above.0.iter_mut().for_each(|rank| *rank -= 1);
        (self.count(keys, at), below, above)
    }

    #[inline(always)]
    fn members(self, keys: &Keys, at: &Row, of: &mut [u32]) -> (u32, Row) {
        let mut equal = 0;
        for (row, of) in keys.rows().iter().zip(of) {
            *of = 0;
            for l in 0..LANES {
                *of |= u32::from(row.0[l] <= at.0[l]) << l;
                equal |= u32::from(row.0[l] == at.0[l]) << l;
            }
        }
        (equal, self.count(keys, at))
    }

    #[inline(always)]
    fn choose(self, points: &Points, of: &[u32], bits: u32, near: &mut Near) {
        let mut n = 0;
        for (&id, &of) in points.id[..points.len].iter().zip(of) {
            near.id[n] = id;
            near.of[n] = of;
            n += usize::from(of & bits != 0);
        }
        near.len = n;
    }

    #[inline(always)]
    fn sums(self, field: &NormalField, vertex: DVec3, near: &mut Near, weighting: &Weighting) -> Sums {
        fetch(field, vertex, near);
        let mut sums = Sums::default();
        let value = |k: usize, i: usize| near.value[k * MOST + i];
        for (i, of) in near.of[..near.len].iter().enumerate() {
            let u = DVec3::new(value(0, i), value(1, i), value(2, i));
            let middle = weighting.middle(u);
            // Fused products may be calls: not for what does not belong.
            for q in (0..6).filter(|q| of >> (near.shift + q) & 1 == 1) {
                let d2 = weighting.distance2(middle, u[q / 2], q.is_multiple_of(2));
                sums.add(q, weight(d2), value(3 + q / 2, i));
            }
        }
        sums
    }
}
