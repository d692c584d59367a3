//! How a polytope grows around many points.
//!
//! Quickhull (Barber, Dobkin & Huhdanpaa 1996, ACM Trans. Math. Softw. 22, 469-483,
//! doi:10.1145/235815.235821): every point that may still be a corner hangs on one facet that it lies above;
//! the highest point of a facet becomes a corner, the facets it sees give way to a fan around it, and the
//! points that hung on them move to the fan or are inside. About n log n steps for n points.
//!
//! Which side of a facet a point lies on is decided exactly: in plain `f64` where its error bound allows, by
//! Shewchuk's adaptive predicate (1997, Discrete Comput. Geom. 18, 305-363, doi:10.1007/PL00009321) where it
//! does not. A point in the plane of a facet counts as below it. So what a point sees is always one
//! disc, a new facet is never degenerate, and duplicate, collinear, coplanar or noisy points need no
//! tolerance and no merging of facets.

use super::DVec3;
use super::polytope::NoPolytope;
use robust::{Coord3D, orient3d};

const NONE: u32 = u32::MAX;

/// One facet: its plane, its corners, and the facets across the edges that begin at them. One cache line.
#[derive(Debug, Clone, Copy)]
struct Facet {
    normal: DVec3,
    level: f64,
    /// Below this a height (normal times point, minus level) may have the wrong sign.
    noise: f64,
    corners: [u32; 3],
    across: [u32; 3],
}

/// A point, and where it is in the lists. Half a cache line.
#[derive(Debug, Clone, Copy)]
struct Point {
    at: DVec3,
    /// The point that hangs after this one on the same facet.
    next: u32,
    /// The facet of the last fan around which the rim went on from here.
    begins: u32,
}

/// The points that hang on a facet.
#[derive(Debug, Clone, Copy)]
struct Above {
    /// The first and the last of a chain of points, or none.
    first: u32,
    last: u32,
    highest: u32,
    height: f64,
}

const NOTHING: Above = Above { first: NONE, last: NONE, highest: NONE, height: 0.0 };

/// An edge between a facet that the new corner sees and one that it does not.
#[derive(Debug, Clone, Copy, Default)]
struct RimEdge {
    from: u32,
    to: u32,
    /// The facet that stays, and which of its edges this is.
    beyond: u32,
    side: u32,
}

/// Facets side by side, so that a point is held against all of them without a branch for each.
#[derive(Debug, Clone, Copy)]
struct Planes {
    normal: [[f64; Planes::MOST]; 3],
    noise: [f64; Planes::MOST],
    facets: [u32; Planes::MOST],
}

impl Planes {
    const MOST: usize = 8;
    /// Nothing is above these.
    const NONE: Planes =
        Planes { normal: [[0.0; Planes::MOST]; 3], noise: [-1.0; Planes::MOST], facets: [NONE; Planes::MOST] };

    fn put(&mut self, i: usize, place: u32, facet: &Facet) {
        (0..3).for_each(|k| self.normal[k][i] = facet.normal[k]);
        (self.noise[i], self.facets[i]) = (facet.noise, place);
    }

    /// Heights above the facets of a point that lies so far from a point of all of them, and one byte for each
    /// facet that is not 0 unless the point is surely below.
    fn heights(&self, from: DVec3) -> ([f64; Planes::MOST], u64) {
        let (mut height, mut not_below) = ([0.0; Planes::MOST], [0; Planes::MOST]);
        let [x, y, z] = &self.normal;
        for i in 0..Planes::MOST {
            height[i] = x[i] * from.x + y[i] * from.y + z[i] * from.z;
            not_below[i] = u8::from(height[i] >= -self.noise[i]);
        }
        (height, u64::from_le_bytes(not_below))
    }
}

/// A polytope that still has points outside.
pub(super) struct Growing {
    points: Vec<Point>,
    facets: Vec<Facet>,
    above: Vec<Above>,
    /// Twice the insertion that looked at the facet last, plus one if its corner sees the facet.
    look: Vec<u32>,
    /// Facets on which points hang.
    open: Vec<u32>,
    /// Places of facets that were seen and are gone, to be taken again.
    free: Vec<u32>,
}

impl Growing {
    /// A tetrahedron of extreme points, coordinates within 1.
    pub(super) fn start(points: impl ExactSizeIterator<Item = DVec3>) -> Result<Growing, NoPolytope> {
        if points.len() < 4 {
            return Err(NoPolytope::Flat);
        }
        let points: Vec<Point> = points.map(|at| Point { at, next: NONE, begins: NONE }).collect();
        let at = |i: u32| points[i as usize].at;
        let a = extreme(&points, |p| -p.x - 0.1 * p.y - 0.01 * p.z);
        let b = extreme(&points, |p| (p - at(a)).length_squared());
        let c = extreme(&points, |p| (p - at(a)).cross(at(b) - at(a)).length_squared());
        let normal = (at(b) - at(a)).cross(at(c) - at(a));
        let side = |d: u32| height_exactly([at(a), at(b), at(c)], at(d));
        let mut d = extreme(&points, |p| normal.dot(p - at(a)).abs());
        if side(d) == 0.0 {
            // Rounding may hide the only point that is not in the plane.
            d = (0..points.len() as u32).find(|&i| side(i) != 0.0).ok_or(NoPolytope::Flat)?;
        }
        let (b, c) = if side(d) > 0.0 { (c, b) } else { (b, c) };
        let first = [([a, b, c], [1, 2, 3]), ([a, d, b], [3, 2, 0]), ([b, d, c], [1, 3, 0]), ([c, d, a], [2, 1, 0])];
        let mut growing = Growing {
            points,
            facets: Vec::new(),
            above: vec![NOTHING; 4],
            look: vec![0; 4],
            open: vec![3, 2, 1, 0],
            free: Vec::new(),
        };
        for (corners, across) in first {
            let facet = growing.facet(corners, across);
            growing.facets.push(facet);
        }
        for point in 0..growing.points.len() as u32 {
            let p = growing.points[point as usize].at;
            if let Some((facet, height)) = (0..4).map(|f| (f, growing.height(f, p))).find(|&(_, height)| height > 0.0) {
                growing.hang(point, facet, height);
            }
        }
        Ok(growing)
    }

    fn facet(&self, corners: [u32; 3], across: [u32; 3]) -> Facet {
        let [a, b, c] = corners.map(|i| self.points[i as usize].at);
        let (u, v) = (b - a, c - a);
        let plus = DVec3::new(u.y * v.z, u.z * v.x, u.x * v.y);
        let minus = DVec3::new(u.z * v.y, u.x * v.z, u.y * v.x);
        let normal = plus - minus;
        let sizes = plus.abs() + minus.abs();
        // Standard error analysis gives 9 epsilon times these sizes for coordinates within 1.
        let noise = 16.0 * f64::EPSILON * (sizes.x + sizes.y + sizes.z);
        Facet { normal, level: normal.dot(a), noise, corners, across }
    }

    /// A height of the point above the facet's plane, in units of the facet's own; 0 where it is not above.
    fn height(&self, facet: u32, p: DVec3) -> f64 {
        let f = &self.facets[facet as usize];
        let height = f.normal.dot(p) - f.level;
        if height.abs() > f.noise { height.max(0.0) } else { self.doubtful_height(facet, p) }
    }

    #[cold]
    fn doubtful_height(&self, facet: u32, p: DVec3) -> f64 {
        let f = &self.facets[facet as usize];
        let exact = height_exactly(f.corners.map(|i| self.points[i as usize].at), p);
        if exact > 0.0 { exact.max(f64::MIN_POSITIVE) } else { 0.0 }
    }

    fn hang(&mut self, point: u32, facet: u32, height: f64) {
        let above = &mut self.above[facet as usize];
        self.points[point as usize].next = above.first;
        above.last = if above.first == NONE { point } else { above.last };
        above.first = point;
        let higher = height > above.height;
        above.highest = if higher { point } else { above.highest };
        above.height = if higher { height } else { above.height };
    }

    /// Makes corners of points until none is outside.
    pub(super) fn finish(&mut self) -> Result<(), NoPolytope> {
        let (mut seen, mut rim, mut fan) = (Vec::new(), Vec::new(), Vec::new());
        let mut insertion = 0;
        // The last first: its neighbourhood is still in the cache.
        while let Some(facet) = self.open.pop() {
            let Above { first, highest: corner, .. } = self.above[facet as usize];
            if first == NONE {
                continue;
            }
            insertion += 1;
            let (seen, rim) = self.look_around(facet, corner, insertion, &mut seen, &mut rim);
            let mut point = self.take_down(seen);
            self.fan_out(corner, rim, &mut fan)?;
            let p = self.points[corner as usize].at;
            while point != NONE {
                let following = self.points[point as usize].next;
                if point != corner {
                    self.move_to_fan(point, p, &fan);
                }
                point = following;
            }
            for &facet in fan.iter().flat_map(|planes| &planes.facets).take(rim.len()) {
                // Without a branch: whether points hang on it is as good as random.
                let places = self.open.len();
                self.open.push(facet);
                self.open.truncate(places + usize::from(self.above[facet as usize].first != NONE));
            }
        }
        Ok(())
    }

    /// The facets that a new corner sees, from one of them on, and the edges around them. The lists are longer than
    /// what is in them, so that nothing needs a branch of its own.
    fn look_around<'l>(
        &mut self,
        facet: u32,
        corner: u32,
        insertion: u32,
        seen: &'l mut Vec<u32>,
        rim: &'l mut Vec<RimEdge>,
    ) -> (&'l [u32], &'l [RimEdge]) {
        let p = self.points[corner as usize].at;
        let (mut done, mut found, mut edges) = (0, 1, 0);
        self.look[facet as usize] = 2 * insertion + 1;
        seen.resize(seen.len().max(64), NONE);
        seen[0] = facet;
        while done < found {
            if seen.len() < found + 3 {
                seen.resize(2 * found, NONE);
            }
            if rim.len() < edges + 3 {
                rim.resize(2 * edges + 64, RimEdge::default());
            }
            let f = seen[done];
            done += 1;
            let Facet { corners, across, .. } = self.facets[f as usize];
            for side in 0..3 {
                let beyond = across[side];
                let sees = u32::from(self.height(beyond, p) > 0.0);
                let look = &mut self.look[beyond as usize];
                let fresh = *look < 2 * insertion;
                *look = if fresh { 2 * insertion + sees } else { *look };
                let sees = *look & 1;
                seen[found] = beyond;
                found += usize::from(fresh) & sees as usize;
                let back = self.facets[beyond as usize].across;
                let back = if back[0] == f { 0 } else { 1 + u32::from(back[1] != f) };
                rim[edges] = RimEdge { from: corners[side], to: corners[(side + 1) % 3], beyond, side: back };
                edges += 1 - sees as usize;
            }
        }
        (&seen[..found], &rim[..edges])
    }

    /// Takes the facets away, and returns the first of all points that hung on them, now one chain.
    fn take_down(&mut self, seen: &[u32]) -> u32 {
        let (mut first, mut last) = (NONE, NONE);
        for &facet in seen {
            let above = std::mem::replace(&mut self.above[facet as usize], NOTHING);
            if above.first == NONE {
                continue;
            }
            match self.points.get_mut(last as usize) {
                None => first = above.first,
                Some(last) => last.next = above.first,
            }
            last = above.last;
        }
        self.free.extend_from_slice(seen);
        first
    }

    /// Puts a fan around the new corner in place of the seen facets.
    fn fan_out(&mut self, corner: u32, rim: &[RimEdge], fan: &mut Vec<Planes>) -> Result<(), NoPolytope> {
        fan.clear();
        for edges in rim.chunks(Planes::MOST) {
            let mut planes = Planes::NONE;
            for (i, edge) in edges.iter().enumerate() {
                let facet = self.facet([corner, edge.from, edge.to], [NONE, edge.beyond, NONE]);
                let place = self.free.pop().unwrap_or(self.facets.len() as u32);
                if place as usize == self.facets.len() {
                    self.facets.push(facet);
                    self.above.push(NOTHING);
                    self.look.push(0);
                } else {
                    self.facets[place as usize] = facet;
                }
                self.facets[edge.beyond as usize].across[edge.side as usize] = place;
                self.points[edge.from as usize].begins = place;
                planes.put(i, place, &facet);
            }
            fan.push(planes);
        }
        for (edge, &place) in rim.iter().zip(fan.iter().flat_map(|planes| &planes.facets)) {
            let after = self.points[edge.to as usize].begins;
            let closed = self.facets.get(after as usize).is_some_and(|f| f.corners[..2] == [corner, edge.to]);
            if !closed {
                return Err(NoPolytope::OutOfRange);
            }
            self.facets[place as usize].across[2] = after;
            self.facets[after as usize].across[0] = place;
        }
        Ok(())
    }

    /// Hangs a point on the first facet of the fan around `corner` that it is above, or drops it: it is then inside.
    fn move_to_fan(&mut self, point: u32, corner: DVec3, fan: &[Planes]) {
        let p = self.points[point as usize].at;
        for planes in fan {
            let (heights, mut not_below) = planes.heights(p - corner);
            while not_below != 0 {
                let i = not_below.trailing_zeros() as usize / 8;
                let (facet, mut height) = (planes.facets[i], heights[i]);
                if height.abs() <= planes.noise[i] {
                    height = self.doubtful_height(facet, p);
                }
                if height > 0.0 {
                    self.hang(point, facet, height);
                    return;
                }
                not_below &= not_below - 1;
            }
        }
    }

    /// Corners of every facet, counter-clockwise seen from outside.
    pub(super) fn facets(mut self) -> Vec<[u32; 3]> {
        self.free.iter().for_each(|&f| self.facets[f as usize].corners = [NONE; 3]);
        self.facets.iter().map(|f| f.corners).filter(|corners| corners[0] != NONE).collect()
    }
}

/// The first of the points for which `of` is greatest.
fn extreme(points: &[Point], of: impl Fn(DVec3) -> f64) -> u32 {
    let (mut most, mut at) = (f64::NEG_INFINITY, 0);
    for (block, first) in points.chunks(64).zip((0u32..).step_by(64)) {
        let here = block.iter().fold(f64::NEG_INFINITY, |most, p| {
            let x = of(p.at);
            if x > most { x } else { most }
        });
        if here > most {
            most = here;
            at = first + block.iter().position(|p| of(p.at) == here).unwrap_or(0) as u32;
        }
    }
    at
}

/// Six times the volume between a triangle and a point, with the sign of the height above it exact.
pub(super) fn height_exactly(corners: [DVec3; 3], p: DVec3) -> f64 {
    let [a, b, c] = corners.map(coordinates);
    -orient3d(a, b, c, coordinates(p))
}

fn coordinates(p: DVec3) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}
