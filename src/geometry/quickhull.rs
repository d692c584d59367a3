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
use super::extremes::{BLOCK, greatest};
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

/// The points that hang on a facet, and when it was last looked at.
#[derive(Debug, Clone, Copy)]
struct Above {
    /// The first of a chain of points, or none.
    first: u32,
    highest: u32,
    height: f64,
    /// Twice the insertion that looked at the facet, plus one if its corner sees the facet.
    look: u32,
}

const NOTHING: Above = Above { first: NONE, highest: NONE, height: 0.0, look: 0 };

/// An edge between a facet that the new corner sees and one that it does not.
#[derive(Debug, Clone, Copy)]
struct RimEdge {
    from: u32,
    to: u32,
    /// The facet that stays, and which of its edges this is.
    beyond: u32,
    side: usize,
}

/// A polytope that still has points outside.
pub(super) struct Growing {
    points: Vec<DVec3>,
    facets: Vec<Facet>,
    above: Vec<Above>,
    /// The point that hangs after this one on the same facet.
    next: Vec<u32>,
    /// Facets on which points hang.
    open: Vec<u32>,
    /// Places of facets that were seen and are gone, to be taken again.
    free: Vec<u32>,
}

impl Growing {
    /// A tetrahedron of extreme points, coordinates within 1.
    pub(super) fn start(points: Vec<DVec3>) -> Result<Growing, NoPolytope> {
        if points.len() < 4 {
            return Err(NoPolytope::Flat);
        }
        let at = |i: u32| points[i as usize];
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
        let n = points.len();
        let mut growing = Growing {
            points,
            facets: Vec::new(),
            above: vec![NOTHING; 4],
            next: vec![NONE; n],
            open: vec![3, 2, 1, 0],
            free: Vec::new(),
        };
        for (corners, across) in first {
            let facet = growing.facet(corners, across);
            growing.facets.push(facet);
        }
        for point in 0..n as u32 {
            let p = growing.points[point as usize];
            if let Some((facet, height)) = (0..4).map(|f| (f, growing.height(f, p))).find(|&(_, height)| height > 0.0) {
                growing.hang(point, facet, height);
            }
        }
        Ok(growing)
    }

    fn facet(&self, corners: [u32; 3], across: [u32; 3]) -> Facet {
        let [a, b, c] = corners.map(|i| self.points[i as usize]);
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
        let exact = height_exactly(f.corners.map(|i| self.points[i as usize]), p);
        if exact > 0.0 { exact.max(f64::MIN_POSITIVE) } else { 0.0 }
    }

    fn hang(&mut self, point: u32, facet: u32, height: f64) {
        let above = &mut self.above[facet as usize];
        self.next[point as usize] = above.first;
        above.first = point;
        if height > above.height {
            (above.height, above.highest) = (height, point);
        }
    }

    /// Makes corners of points until none is outside.
    pub(super) fn finish(&mut self) -> Result<(), NoPolytope> {
        let mut begins_at = vec![NONE; self.points.len()];
        let (mut seen, mut rim, mut fan, mut chains) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut insertion = 0;
        // The last first: its neighbourhood is still in the cache.
        while let Some(facet) = self.open.pop() {
            let corner = self.above[facet as usize].highest;
            if self.above[facet as usize].first == NONE {
                continue;
            }
            insertion += 1;
            self.look_around(facet, corner, insertion, &mut seen, &mut rim);
            chains.clear();
            chains.extend(seen.iter().map(|&f| self.above[f as usize].first));
            seen.iter().for_each(|&f| self.above[f as usize] = NOTHING);
            self.free.extend_from_slice(&seen);
            self.fan_out(corner, &rim, &mut fan, &mut begins_at)?;
            let p = self.points[corner as usize];
            for &chain in &chains {
                let mut point = chain;
                while point != NONE {
                    let following = self.next[point as usize];
                    if point != corner {
                        self.move_to_fan(point, p, &fan);
                    }
                    point = following;
                }
            }
            self.open.extend(fan.iter().map(|f| f.0).filter(|&f| self.above[f as usize].first != NONE));
        }
        Ok(())
    }

    /// The facets that a new corner sees, from one of them on, and the edges around them.
    fn look_around(&mut self, facet: u32, corner: u32, insertion: u32, seen: &mut Vec<u32>, rim: &mut Vec<RimEdge>) {
        let p = self.points[corner as usize];
        seen.clear();
        rim.clear();
        seen.push(facet);
        self.above[facet as usize].look = 2 * insertion + 1;
        let mut done = 0;
        while let Some(&f) = seen.get(done) {
            done += 1;
            let Facet { corners, across, .. } = self.facets[f as usize];
            for side in 0..3 {
                let beyond = across[side];
                let mut look = self.above[beyond as usize].look;
                if look < 2 * insertion {
                    look = 2 * insertion + u32::from(self.height(beyond, p) > 0.0);
                    self.above[beyond as usize].look = look;
                    if look & 1 == 1 {
                        seen.push(beyond);
                    }
                }
                if look & 1 == 0 {
                    let back = self.facets[beyond as usize].across;
                    let back = if back[0] == f { 0 } else { 1 + usize::from(back[1] != f) };
                    rim.push(RimEdge { from: corners[side], to: corners[(side + 1) % 3], beyond, side: back });
                }
            }
        }
    }

    /// Puts a fan around the new corner in place of the seen facets.
    fn fan_out(
        &mut self,
        corner: u32,
        rim: &[RimEdge],
        fan: &mut Vec<(u32, DVec3, f64)>,
        begins_at: &mut [u32],
    ) -> Result<(), NoPolytope> {
        fan.clear();
        for edge in rim {
            let facet = self.facet([corner, edge.from, edge.to], [NONE, edge.beyond, NONE]);
            let place = self.free.pop().unwrap_or(self.facets.len() as u32);
            if place as usize == self.facets.len() {
                self.facets.push(facet);
                self.above.push(NOTHING);
            } else {
                self.facets[place as usize] = facet;
            }
            self.facets[edge.beyond as usize].across[edge.side] = place;
            begins_at[edge.from as usize] = place;
            fan.push((place, facet.normal, facet.noise));
        }
        for (edge, &(place, ..)) in rim.iter().zip(fan.iter()) {
            let after = begins_at[edge.to as usize];
            let closed = self.facets.get(after as usize).is_some_and(|f| f.corners[..2] == [corner, edge.to]);
            if !closed {
                return Err(NoPolytope::OutOfRange);
            }
            self.facets[place as usize].across[2] = after;
            self.facets[after as usize].across[0] = place;
        }
        Ok(())
    }

    /// Hangs a point on a facet of the fan around `corner`, or drops it: it is then inside.
    fn move_to_fan(&mut self, point: u32, corner: DVec3, fan: &[(u32, DVec3, f64)]) {
        let p = self.points[point as usize];
        let from_corner = p - corner;
        for &(facet, normal, noise) in fan {
            let mut height = normal.dot(from_corner);
            if height.abs() <= noise {
                height = self.doubtful_height(facet, p);
            }
            if height > 0.0 {
                self.hang(point, facet, height);
                return;
            }
        }
    }

    /// Corners of every facet, counter-clockwise seen from outside.
    pub(super) fn facets(mut self) -> Vec<[u32; 3]> {
        self.free.iter().for_each(|&f| self.facets[f as usize].corners = [NONE; 3]);
        self.facets.iter().map(|f| f.corners).filter(|corners| corners[0] != NONE).collect()
    }
}

/// The first of the points for which `of` is greatest. In blocks, so that most of the work needs no branch.
fn extreme(points: &[DVec3], of: impl Fn(DVec3) -> f64) -> u32 {
    let (mut most, mut at) = (f64::NEG_INFINITY, 0);
    for (block, first) in points.chunks(BLOCK).zip((0u32..).step_by(BLOCK)) {
        let mut values = [f64::NEG_INFINITY; BLOCK];
        for (value, &p) in values.iter_mut().zip(block) {
            *value = of(p);
        }
        let here = greatest(&values);
        if here > most {
            most = here;
            at = first + values.iter().position(|&value| value == here).unwrap_or(0) as u32;
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
