//! Triangles between points, wherever the surface faces.
//!
//! Around each point, the points near it are looked at in the plane that fits them, and the point's triangles of the
//! Delaunay triangulation there are its proposals: an umbrella over the point. A triangle that all its three corners
//! propose is part of the surface, as in Gopi, Krishnan & Silva 2000 (<https://doi.org/10.1111/1467-8659.00439>).
//! Corners whose planes differ may disagree: what two of them propose, or one, fills what is then still open, as long as
//! no side of a triangle is taken twice.
//!
//! All of this is a matter of the points around: whoever has these finds the same triangles, whatever else is there.

use super::Site;
use super::near::Neighbour;
use crate::geometry::DVec3;
use std::collections::HashSet;

/// Points more steeply above or below a point's plane are on another face of the surface: cosine of the angle.
const OTHER_FACE: f64 = 0.5;
/// Where more than three points lie on one circle, so much of the squared spacing decides.
const TIE_BREAK: f64 = 1e-7;
/// Votes of the triangles that fill what is open, round by round.
pub(super) const ROUNDS: [u8; 2] = [2, 1];

/// A triangle: numbers of points, counter-clockwise seen from outside, the lowest first.
pub(super) type Corners = [u32; 3];

/// The triangles of what all points propose, sorted. `proposed` has the triangles of each point about its normal, with
/// the point first, and `turned` tells whose normals were turned over since.
pub(super) fn agreed(sites: &[Site], mut proposed: Vec<Corners>, turned: &[bool]) -> Vec<Corners> {
    for corners in &mut proposed {
        let [point, a, b] = *corners;
        *corners = lowest_first(if turned[point as usize] { [point, b, a] } else { [point, a, b] });
    }
    proposed.sort_unstable();
    let (mut all, mut rest) = (Vec::with_capacity(proposed.len() / 3), Vec::new());
    for same in proposed.chunk_by(|a, b| a == b) {
        if same.len() >= 3 { all.push(same[0]) } else { rest.push((same[0], same.len() as u8)) }
    }
    drop(proposed);
    // Only sides that somebody may still want matter.
    let mut wanted = vec![false; sites.len()];
    rest.iter().flat_map(|(corners, _)| corners).for_each(|&point| wanted[point as usize] = true);
    let both = |&(a, b): &(u32, u32)| wanted[a as usize] && wanted[b as usize];
    let mut taken: HashSet<(u32, u32)> = all.iter().flat_map(sides).filter(both).collect();
    for votes in ROUNDS {
        let of_round = rest.iter().filter(|(_, n)| *n == votes).map(|(corners, _)| *corners);
        fill(sites, of_round, votes, &mut all, &mut taken);
    }
    all.sort_unstable();
    all
}

/// Adds the candidates that take no side which is taken, and that are smaller than all others that want one of theirs.
fn fill(
    sites: &[Site],
    candidates: impl Iterator<Item = Corners>,
    votes: u8,
    all: &mut Vec<Corners>,
    taken: &mut HashSet<(u32, u32)>,
) {
    // What one corner alone proposes must close a hole.
    let fits = |corners: &Corners| {
        sides(corners).iter().all(|side| !taken.contains(side))
            && (votes > 1 || sides(corners).iter().filter(|&&(a, b)| taken.contains(&(b, a))).count() > 1)
    };
    let candidates: Vec<Corners> = candidates.filter(fits).collect();
    let mut wanted: Vec<((u32, u32), f64, u32)> = Vec::with_capacity(3 * candidates.len());
    for (i, corners) in candidates.iter().enumerate() {
        let size = longest_side2(sites, corners);
        wanted.extend(sides(corners).map(|side| (side, size, i as u32)));
    }
    wanted.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut first_of = vec![0u8; candidates.len()];
    wanted.chunk_by(|a, b| a.0 == b.0).for_each(|same| first_of[same[0].2 as usize] += 1);
    for (corners, _) in candidates.iter().zip(first_of).filter(|(_, firsts)| *firsts == 3) {
        all.push(*corners);
        taken.extend(sides(corners));
    }
}

fn sides(&[a, b, c]: &Corners) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)]
}

fn longest_side2(sites: &[Site], corners: &Corners) -> f64 {
    let length2 = |(a, b): (u32, u32)| sites[a as usize].at.distance_squared(sites[b as usize].at);
    sides(corners).into_iter().map(length2).fold(0.0, f64::max)
}

/// The same corners, in the same sense, from the lowest on.
fn lowest_first(corners: Corners) -> Corners {
    let [a, b, c] = corners;
    match a.min(b).min(c) {
        first if first == a => corners,
        first if first == b => [b, c, a],
        _ => [c, a, b],
    }
}

/// A side of a cell: where it begins, going counter-clockwise, and the point beyond it, if there is one.
#[derive(Clone, Copy)]
struct Side {
    from: (f64, f64),
    neighbour: Option<u32>,
}

/// What is nearer to a point than to any other, in its plane: the Voronoi cell.
#[derive(Default)]
pub(super) struct Cell {
    sides: Vec<Side>,
    cut: Vec<Side>,
}

impl Cell {
    /// Appends the triangles that a point proposes, itself first, about its normal. `spacing_m` is that of the points
    /// around it, and no side is longer than `longest_m`.
    pub(super) fn propose(
        &mut self,
        point: usize,
        (sites, found): (&[Site], &[Neighbour]),
        normal: DVec3,
        (spacing_m, widest_m, longest_m): (f64, f64, f64),
        proposed: &mut Vec<Corners>,
    ) {
        let far = 4.0 * widest_m;
        self.sides.clear();
        let corner = |x: f64, y: f64| Side { from: (x, y), neighbour: None };
        self.sides.extend([corner(-far, -far), corner(far, -far), corner(far, far), corner(-far, far)]);
        let (east, north) = normal.any_orthonormal_pair();
        let here = sites[point].at;
        let weight = |p: DVec3| TIE_BREAK * spacing_m * spacing_m * strewn(p);
        let own_weight = weight(here);
        for &(_, neighbour) in found {
            let there = sites[neighbour as usize].at;
            let away = there - here;
            let (x, y, off) = (away.dot(east), away.dot(north), away.dot(normal));
            let along2 = x * x + y * y;
            if along2 >= OTHER_FACE * OTHER_FACE * (along2 + off * off) {
                self.clip((x, y), 0.5 * (along2 + own_weight - weight(there)), neighbour);
            }
        }
        for (i, side) in self.sides.iter().enumerate() {
            let next = &self.sides[(i + 1) % self.sides.len()];
            let (Some(a), Some(b)) = (side.neighbour, next.neighbour) else { continue };
            let corners = [point as u32, a, b];
            let radius2 = next.from.0 * next.from.0 + next.from.1 * next.from.1;
            if radius2 <= widest_m * widest_m && longest_side2(sites, &corners) <= longest_m * longest_m {
                proposed.push(corners);
            }
        }
    }

    /// Cuts off what is nearer to a neighbour: where the product with its direction is above `limit`.
    fn clip(&mut self, (x, y): (f64, f64), limit: f64, neighbour: u32) {
        let beyond = |side: &Side| side.from.0 * x + side.from.1 * y - limit;
        if self.sides.iter().all(|side| beyond(side) <= 0.0) {
            return;
        }
        self.cut.clear();
        let n = self.sides.len();
        for (i, side) in self.sides.iter().enumerate() {
            let next = &self.sides[(i + 1) % n];
            let (here, there) = (beyond(side), beyond(next));
            let crossing = || {
                let t = here / (here - there);
                let (a, b) = (side.from, next.from);
                (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
            };
            match (here <= 0.0, there <= 0.0) {
                (true, true) => self.cut.push(*side),
                (true, false) => {
                    self.cut.push(*side);
                    self.cut.push(Side { from: crossing(), neighbour: Some(neighbour) });
                }
                (false, true) => self.cut.push(Side { from: crossing(), neighbour: side.neighbour }),
                (false, false) => {}
            }
        }
        std::mem::swap(&mut self.sides, &mut self.cut);
    }
}

/// A number from 0 to 1 that is another one for every place, and always the same for one.
fn strewn(p: DVec3) -> f64 {
    let mut hash = 0u64;
    for x in p.to_array() {
        hash = (hash ^ (x + 0.0).to_bits()).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        hash ^= hash >> 29;
    }
    (hash.wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11) as f64 / (1u64 << 53) as f64
}
