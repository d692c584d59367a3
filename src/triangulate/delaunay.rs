//! Triangles between points: those of the Delaunay triangulation in plan whose circles are small.
//!
//! No point lies within the circle through the corners of such a triangle, and nothing beyond that circle can change
//! that. So each triangle is a matter of the points around it alone: whoever has all points within its circle finds the
//! same triangle, whatever else is there. The triangles whose circles are no larger than a limit are the alpha shape of
//! the points (Edelsbrunner, Kirkpatrick & Seidel 1983, <https://doi.org/10.1109/TIT.1983.1056714>).
//!
//! Where more than three points lie on one circle, the triangulation is a matter of choice: there the polygon is cut into
//! a fan about its first corner, so that it is everywhere the same.

use super::Site;
use robust::{Coord, incircle, orient2d};
use spade::handles::FixedFaceHandle;
use spade::handles::InnerTag;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation, mitigate_underflow};

/// A point with its number.
struct Numbered {
    at: Point2<f64>,
    number: u32,
}

impl HasPosition for Numbered {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// The triangulation of points that are sorted by place in plan, no two at one: triples of their numbers, seen from
/// above counter-clockwise, the first the lowest.
pub(super) fn triangles(sites: &[Site]) -> Result<Vec<[u32; 3]>, spade::InsertionError> {
    let numbered =
        |(number, site): (u32, &Site)| Numbered { at: mitigate_underflow(Point2::new(site.at.x, site.at.y)), number };
    let mesh = DelaunayTriangulation::<Numbered>::bulk_load((0..).zip(sites).map(numbered).collect())?;
    let corners: Vec<[u32; 3]> =
        mesh.inner_faces().map(|face| first_first(face.vertices().map(|v| v.data().number))).collect();
    let on_one_circle = |a: FixedFaceHandle<InnerTag>, b: FixedFaceHandle<InnerTag>| {
        let other = corners[b.index() - 1].into_iter().find(|v| !corners[a.index() - 1].contains(v));
        other.is_some_and(|other| {
            let [p, q, r] = corners[a.index() - 1].map(|v| coord(&sites[v as usize]));
            incircle(p, q, r, coord(&sites[other as usize])) == 0.0
        })
    };
    let mut joined: Vec<(u32, u32)> = Vec::new();
    for edge in mesh.undirected_edges() {
        let [one, other] = [edge.as_directed(), edge.as_directed().rev()];
        if let (Some(a), Some(b)) = (one.face().as_inner(), other.face().as_inner())
            && on_one_circle(a.fix(), b.fix())
        {
            joined.push((a.fix().index() as u32 - 1, b.fix().index() as u32 - 1));
        }
    }
    if joined.is_empty() { Ok(corners) } else { Ok(with_fans(corners, &joined, sites)) }
}

/// Puts fans in place of triangles that are joined.
fn with_fans(corners: Vec<[u32; 3]>, joined: &[(u32, u32)], sites: &[Site]) -> Vec<[u32; 3]> {
    let mut leader: Vec<u32> = (0..corners.len() as u32).collect();
    fn lead(leader: &mut [u32], mut i: u32) -> u32 {
        while leader[i as usize] != i {
            leader[i as usize] = leader[leader[i as usize] as usize];
            i = leader[i as usize];
        }
        i
    }
    for &(a, b) in joined {
        let (a, b) = (lead(&mut leader, a), lead(&mut leader, b));
        leader[a.max(b) as usize] = a.min(b);
    }
    let mut members: Vec<(u32, u32)> =
        joined.iter().flat_map(|&(a, b)| [a, b]).map(|t| (lead(&mut leader, t), t)).collect();
    members.sort_unstable();
    members.dedup();
    let mut alone = vec![true; corners.len()];
    members.iter().for_each(|&(_, t)| alone[t as usize] = false);
    let mut all: Vec<[u32; 3]> = corners.iter().zip(&alone).filter(|(_, alone)| **alone).map(|(c, _)| *c).collect();
    for polygon in members.chunk_by(|a, b| a.0 == b.0) {
        let mut around: Vec<u32> = polygon.iter().flat_map(|&(_, t)| corners[t as usize]).collect();
        around.sort_unstable();
        around.dedup();
        // Corners are numbered by place, so all others lie on one side of the first: they are sorted by direction.
        let first = around.remove(0);
        let from = coord(&sites[first as usize]);
        around.sort_unstable_by(|&a, &b| {
            orient2d(from, coord(&sites[b as usize]), coord(&sites[a as usize])).total_cmp(&0.0)
        });
        all.extend(around.windows(2).map(|pair| [first, pair[0], pair[1]]));
    }
    all
}

fn coord(site: &Site) -> Coord<f64> {
    Coord { x: site.at.x, y: site.at.y }
}

/// The same corners, in the same sense, from the lowest on.
fn first_first(corners: [u32; 3]) -> [u32; 3] {
    let [a, b, c] = corners;
    match a.min(b).min(c) {
        first if first == a => corners,
        first if first == b => [b, c, a],
        _ => [c, a, b],
    }
}

/// Radius of the circle through three points in plan, metres: infinite where they lie in line.
pub(super) fn circle_radius_m(corners: [&Site; 3]) -> f64 {
    let [a, b, c] = corners.map(|s| s.at.truncate());
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let doubled = (ab.x * ac.y - ab.y * ac.x).abs();
    let sides = ab.length() * ac.length() * bc.length();
    if doubled > 0.0 { sides / (2.0 * doubled) } else { f64::INFINITY }
}
