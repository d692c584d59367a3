//! How the surface bends at each vertex, from the normals around it.

use super::lanes::{self, Lanes};
use super::neighbours::Neighbours;
use super::normals::Normals;
use crate::geometry::DVec3;
use glam::{Vec3A, Vec4};
use rayon::prelude::*;

/// Bending at a vertex, as a share of 1 over the mean edge length; above 0 on a stone's top, below in a valley.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Bend {
    /// The least normal curvature: across a valley.
    pub least: f32,
    /// Mean curvature.
    pub mean: f32,
    /// Whether an edge from the vertex spans a gap: it is longer than [`GAP_EDGES`].
    pub gap: bool,
}

/// Edges longer than this, in mean edge lengths, span a gap. So a vertex of a core has all its triangles near by, and one
/// that is not loaded lies this near the cut at most.
pub const GAP_EDGES: f64 = 10.0;

/// Bending at all vertices: the symmetric 2x2 matrix that best tells, in the tangent plane, the change of the normal
/// along each edge from the edge (least squares over the ring; Rusinkiewicz 2004, doi:10.1109/TDPVT.2004.1335277, does
/// it for triangles). 0 where edges determine none.
pub fn bends(positions: &[DVec3], neighbours: &Neighbours, normals: &Normals, mean_edge_m: f64) -> Vec<Bend> {
    let bend = |v: usize| {
        let normal = normals.unit[v];
        let [east, north] = tangents(normal);
        let mut fit = Fit::default();
        let mut longest = Vec4::ZERO;
        neighbours.each_four(v, |four| {
            // Where the ring is filled up the vertex itself stands in: an edge of no length.
            let four = four.map(|u| if (u as usize) < positions.len() { u as usize } else { v });
            let edges = Lanes::of(four.map(|u| (positions[u] - positions[v]).as_vec3a().extend(0.0)));
            let changes = Lanes::of(four.map(|u| (normals.unit[u] - normal).extend(0.0)));
            longest = longest.max(edges.lengths_squared());
            fit.add([edges.dot(east), edges.dot(north)], [changes.dot(east), changes.dot(north)]);
        });
        let longest = longest.max_element();
        let unit = mean_edge_m as f32;
        let gap = longest > (GAP_EDGES * GAP_EDGES) as f32 * unit * unit;
        let [least, mean] = fit.curvatures().unwrap_or_default();
        Bend { least: least * unit, mean: mean * unit, gap }
    };
    (0..positions.len()).into_par_iter().with_min_len(1 << 12).map(bend).collect()
}

/// Two unit vectors across a normal and each other.
fn tangents(normal: Vec3A) -> [Vec3A; 2] {
    let aside = if normal.x.abs() < 0.7 { Vec3A::X } else { Vec3A::Y };
    let east = normal.cross(aside).normalize_or_zero();
    [east, normal.cross(east)]
}

/// Normal equations of a symmetric matrix that maps edges to changes of the normal.
#[derive(Default)]
struct Fit {
    xx: Vec4,
    xy: Vec4,
    yy: Vec4,
    by: [Vec4; 3],
}

impl Fit {
    /// Adds four edges, each in a lane. An edge of no length adds nothing.
    #[inline]
    fn add(&mut self, [x, y]: [Vec4; 2], [change_x, change_y]: [Vec4; 2]) {
        self.xx += x * x;
        self.xy += x * y;
        self.yy += y * y;
        self.by[0] += x * change_x;
        self.by[1] += y * change_x + x * change_y;
        self.by[2] += y * change_y;
    }

    /// Least and mean curvature, 1/m; none where the edges lie in a line.
    fn curvatures(&self) -> Option<[f32; 2]> {
        let [xx, xy, yy] = [self.xx, self.xy, self.yy].map(lanes::sum);
        let [p, q, r] = self.by.map(lanes::sum);
        let both = xx + yy;
        // Minors of [[xx, xy, 0], [xy, xx + yy, xy], [0, xy, yy]].
        let [first, second] = [both * yy - xy * xy, xy * yy];
        let determinant = xx * first - xy * second;
        if determinant.is_nan() || determinant <= 1e-6 * both * both * both {
            return None;
        }
        let a = (p * first - q * second + r * xy * xy) / determinant;
        let b = (q * xx * yy - p * second - r * xx * xy) / determinant;
        let c = (p * xy * xy - q * xx * xy + r * (xx * both - xy * xy)) / determinant;
        let mean = 0.5 * (a + c);
        let half = 0.5 * (a - c);
        Some([mean - (half * half + b * b).sqrt(), mean])
    }
}
