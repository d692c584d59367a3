//! The outline of a grain in plan: the union of its projected triangles, overhangs included.
//!
//! Every projected triangle is turned counter-clockwise, and edges that two of them run through in
//! opposite directions cancel. What is left are closed chains around which the winding number counts the
//! triangles above a point, so the union is where it is not 0: `i_overlay` needs only the rim and the
//! silhouette of the grain, not its thousands of triangles.
//!
//! Points lie on the integer grid of [`crate::open::Frame::outline_position`]: a result that is valid
//! there stays valid wherever an offset moves it.

use super::grain::Polygon;
use super::patch::Patch;
use crate::geometry::DVec3;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{IntOverlayOptions, Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::core::solver::Solver;
use i_overlay::i_float::int::point::IntPoint;

/// Outline of a grain, and its area in m². `step_m` is the grid's step.
pub fn outline(patch: &Patch, step_m: f64) -> (Vec<Polygon>, f64) {
    let Some(first) = patch.corners.first() else { return (Vec::new(), 0.0) };
    let steps = |p: DVec3| [(p.x / step_m).round() as i64, (p.y / step_m).round() as i64];
    let origin = steps(patch.points[first[0] as usize]);
    let places: Vec<IntPoint<i32>> = patch
        .points
        .iter()
        .map(|&p| {
            let [x, y] = steps(p);
            IntPoint::new(clamp(x - origin[0]), clamp(y - origin[1]))
        })
        .collect();
    let mut overlay: Overlay<i32> = Overlay::new_custom(256, IntOverlayOptions::ogc(), Solver::default());
    for chain in walk(&uncancelled(&patch.corners, &places)) {
        let chain: Vec<IntPoint<i32>> = chain.into_iter().map(|v| places[v as usize]).collect();
        overlay.add_contour(&chain, ShapeType::Subject);
    }
    let shapes = overlay.overlay(OverlayRule::Subject, FillRule::NonZero);
    let polygons: Vec<Polygon> = shapes
        .into_iter()
        .map(|shape| {
            shape
                .into_iter()
                .map(|ring| {
                    ring.into_iter().map(|p| [i64::from(p.x) + origin[0], i64::from(p.y) + origin[1]]).collect()
                })
                .collect()
        })
        .collect();
    let twice: i128 = polygons.iter().flatten().map(|ring| twice_area(ring)).sum();
    (polygons, twice as f64 / 2.0 * step_m * step_m)
}

/// A grain that reaches more than 1024 map units from its first corner would leave the grid: it is cut off
/// there instead of wrapping round.
fn clamp(x: i64) -> i32 {
    x.clamp(-(1 << 30), 1 << 30) as i32
}

/// Twice the signed area of a ring, counter-clockwise positive, in square steps.
fn twice_area(ring: &[[i64; 2]]) -> i128 {
    let o = ring[0];
    let next = ring.iter().skip(1).chain(ring.first());
    ring.iter()
        .zip(next)
        .map(|(a, b)| {
            i128::from(a[0] - o[0]) * i128::from(b[1] - o[1]) - i128::from(b[0] - o[0]) * i128::from(a[1] - o[1])
        })
        .sum()
}

/// Directed edges that are left when opposite ones cancel, sorted.
fn uncancelled(triangles: &[[u32; 3]], places: &[IntPoint<i32>]) -> Vec<(u32, u32)> {
    // Edges are listed by their lower vertex: the other one, and in the last bit whether they descend.
    let edges = || {
        triangles
            .iter()
            .filter_map(|corners| turned(*corners, places))
            .flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(from, to)| if from < to { (from, u64::from(to) << 1) } else { (to, u64::from(from) << 1 | 1) })
    };
    let mut begin = vec![0u32; places.len() + 1];
    edges().for_each(|(lower, _)| begin[lower as usize] += 1);
    let mut sum = 0;
    for place in &mut begin {
        (*place, sum) = (sum, sum + *place);
    }
    let mut listed = vec![0u64; sum as usize];
    let mut end = begin.clone();
    for (lower, edge) in edges() {
        listed[end[lower as usize] as usize] = edge;
        end[lower as usize] += 1;
    }
    let mut left: Vec<(u32, u32)> = Vec::new();
    for (lower, range) in (0u32..).zip(begin.windows(2)) {
        let around = &mut listed[range[0] as usize..range[1] as usize];
        around.sort_unstable();
        for run in around.chunk_by(|x, y| x >> 1 == y >> 1) {
            let higher = (run[0] >> 1) as u32;
            let down = run.iter().filter(|&edge| edge & 1 == 1).count();
            let up = run.len() - down;
            let edge = if up > down { (lower, higher) } else { (higher, lower) };
            left.extend(std::iter::repeat_n(edge, up.abs_diff(down)));
        }
    }
    left.sort_unstable();
    left
}

/// The triangle counter-clockwise in plan; none if it is a line there.
fn turned([a, b, c]: [u32; 3], places: &[IntPoint<i32>]) -> Option<[u32; 3]> {
    let [p, q, r] = [a, b, c].map(|v| places[v as usize]);
    let turn = i64::from(q.x - p.x) * i64::from(r.y - p.y) - i64::from(q.y - p.y) * i64::from(r.x - p.x);
    match turn.signum() {
        0 => None,
        1 => Some([a, b, c]),
        _ => Some([a, c, b]),
    }
}

/// Splits balanced directed edges (as many arrive at a vertex as leave it) into closed chains.
fn walk(edges: &[(u32, u32)]) -> Vec<Vec<u32>> {
    let mut used = vec![false; edges.len()];
    let mut chains = Vec::new();
    for begin in 0..edges.len() {
        if used[begin] {
            continue;
        }
        let mut chain = Vec::new();
        let mut next = begin;
        loop {
            used[next] = true;
            chain.push(edges[next].0);
            let from = edges[next].1;
            let first = edges.partition_point(|e| e.0 < from);
            let Some(free) = (first..edges.len()).take_while(|&i| edges[i].0 == from).find(|&i| !used[i]) else {
                break;
            };
            next = free;
        }
        chains.push(chain);
    }
    chains
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Patch {
        Patch {
            points: points.iter().map(|&p| DVec3::from_array(p)).collect(),
            corners: triangles.to_vec(),
            ..Patch::default()
        }
    }

    #[test]
    fn inner_edges_vanish_and_the_area_is_that_of_the_square() {
        let m = patch(&[[0., 0., 0.], [1., 0., 1.], [1., 1., 0.], [0., 1., 2.]], &[[0, 1, 2], [0, 2, 3]]);
        let (polygons, area) = outline(&m, 1.0 / 1024.0);
        assert_eq!((polygons.len(), polygons[0].len(), polygons[0][0].len()), (1, 1, 4));
        assert!((area - 1.0).abs() < 1e-12, "{area}");
    }

    #[test]
    fn an_overhang_counts_once_and_sticks_out() {
        // A strip that runs east, folds back under itself and ends further east below.
        let m = patch(
            &[
                [0., 0., 2.],
                [2., 0., 2.],
                [2., 1., 2.],
                [0., 1., 2.],
                [1., 0., 1.],
                [1., 1., 1.],
                [4., 0., 0.],
                [4., 1., 0.],
            ],
            &[[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2], [4, 6, 7], [4, 7, 5]],
        );
        let (polygons, area) = outline(&m, 1.0 / 1024.0);
        assert_eq!(polygons.len(), 1);
        assert!((area - 4.0).abs() < 1e-12, "{area}: {polygons:?}");
    }

    #[test]
    fn a_ring_of_triangles_has_a_hole() {
        let square = |r: f64| [[-r, -r, 0.], [r, -r, 0.], [r, r, 0.], [-r, r, 0.]];
        let points: Vec<[f64; 3]> = square(2.0).into_iter().chain(square(1.0)).collect();
        let triangles: Vec<[u32; 3]> =
            (0..4).flat_map(|i| [[i, (i + 1) % 4, i + 4], [(i + 1) % 4, (i + 1) % 4 + 4, i + 4]]).collect();
        let (polygons, area) = outline(&patch(&points, &triangles), 1.0 / 1024.0);
        assert_eq!((polygons.len(), polygons[0].len()), (1, 2));
        assert!((area - 12.0).abs() < 1e-12, "{area}");
    }
}
