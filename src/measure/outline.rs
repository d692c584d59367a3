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
    let steps = |p: DVec3| [rounded(p.x / step_m), rounded(p.y / step_m)];
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

/// The nearest whole number, halves away from 0: as `round` has it, which is a call where the processor's baseline
/// cannot round.
fn rounded(x: f64) -> i64 {
    let whole = x as i64;
    let rest = x - whole as f64;
    whole.saturating_add(i64::from(rest >= 0.5) - i64::from(rest <= -0.5))
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

/// No edge: a side of a triangle that is a line in plan.
const NO_EDGE: u32 = u32::MAX;
/// Edges that are looked at together.
const FEW: usize = 8;

/// Directed edges that are left when opposite ones cancel, sorted.
fn uncancelled(triangles: &[[u32; 3]], places: &[IntPoint<i32>]) -> Vec<(u32, u32)> {
    // Edges are listed by their lower vertex, by counting. After the lists are filled, that of v ends at `end[v]`.
    let mut end = vec![0u32; places.len() + 1];
    for &[a, b, c] in triangles {
        end[a.min(b) as usize + 1] += 1;
        end[b.min(c) as usize + 1] += 1;
        end[c.min(a) as usize + 1] += 1;
    }
    for v in 1..end.len() {
        end[v] += end[v - 1];
    }
    // The other vertex, and in the last bit whether the edge descends. Triangles that hang together by edges have
    // hardly more vertices than there are triangles, less than 2^31.
    let mut listed = vec![NO_EDGE; 3 * triangles.len() + FEW];
    for &corners in triangles {
        let is_line = turned(corners, places).is_none();
        let [a, b, c] = turned(corners, places).unwrap_or(corners);
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let place = &mut end[from.min(to) as usize];
            let edge = from.max(to) << 1 | u32::from(from > to);
            listed[*place as usize] = if is_line { NO_EDGE } else { edge };
            *place += 1;
        }
    }
    let mut left: Vec<(u32, u32)> = Vec::new();
    let mut first = 0;
    for (lower, &last) in (0..places.len() as u32).zip(&end) {
        let count = last as usize - first;
        if count > FEW || !cancel(&listed[first..], count) {
            let around = &mut listed[first..last as usize];
            around.sort_unstable();
            for run in around.chunk_by(|x, y| x >> 1 == y >> 1).filter(|run| run[0] != NO_EDGE) {
                let higher = run[0] >> 1;
                let down = run.iter().filter(|&edge| edge & 1 == 1).count();
                let up = run.len() - down;
                let edge = if up > down { (lower, higher) } else { (higher, lower) };
                left.extend(std::iter::repeat_n(edge, up.abs_diff(down)));
            }
        }
        first = last as usize;
    }
    left.sort_unstable();
    left
}

/// Whether the first `count` edges of a list cancel one another. Without a branch for each: where opposite ones stand
/// is as good as random.
fn cancel(listed: &[u32], count: usize) -> bool {
    let mut edges = [NO_EDGE; FEW];
    for (i, (edge, &other)) in edges.iter_mut().zip(listed).enumerate() {
        *edge = if i < count { other } else { NO_EDGE };
    }
    let mut any = 0;
    for edge in edges {
        let mut left = 0i32;
        for other in edges {
            left += i32::from(other == edge) - i32::from(other == edge ^ 1);
        }
        any |= if edge == NO_EDGE { 0 } else { left };
    }
    any == 0
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
    fn positions_are_rounded_as_the_language_rounds() {
        let mut x = 0.3f64;
        while x < 1e25 {
            for x in [x, -x, x.trunc() + 0.5, -x.trunc() - 0.5, x.next_up(), 0.5f64.next_down(), 0.0] {
                assert_eq!(rounded(x), x.round() as i64, "{x}");
            }
            x *= 1.31;
        }
    }

    /// Edge by edge, in a map, as one would write it down.
    #[test]
    fn any_heap_of_triangles_leaves_the_edges_that_do_not_cancel() {
        let mut seed = 1u64;
        let mut below = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let (mut nothing, mut repeated) = (0, 0);
        for _ in 0..3000 {
            let (vertices, faces) = (3 + below(12), below(30));
            let places: Vec<IntPoint<i32>> =
                (0..vertices).map(|_| IntPoint::new(below(4) as i32, below(4) as i32)).collect();
            let mut triangles: Vec<[u32; 3]> = (0..faces).map(|_| [0; 3].map(|_| below(vertices) as u32)).collect();
            if below(3) == 0 {
                triangles.extend(triangles.clone().into_iter().map(|[a, b, c]| [a, c, b]));
            }
            let mut sums = std::collections::BTreeMap::<(u32, u32), i32>::new();
            for [a, b, c] in triangles.iter().filter_map(|&t| turned(t, &places)) {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    *sums.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
                }
            }
            let mut plainly: Vec<(u32, u32)> = sums
                .into_iter()
                .flat_map(|((v, w), n)| vec![if n > 0 { (v, w) } else { (w, v) }; n.unsigned_abs() as usize])
                .collect();
            plainly.sort_unstable();
            nothing += usize::from(plainly.is_empty());
            repeated += usize::from(plainly.windows(2).any(|w| w[0] == w[1]));
            assert_eq!(uncancelled(&triangles, &places), plainly, "{triangles:?} {places:?}");
        }
        assert!(nothing > 50 && repeated > 1000, "{nothing} without edges, {repeated} with an edge twice");
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
