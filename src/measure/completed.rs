//! Axes of a stone completed: what its buried part is likely to add.
//!
//! The box along the principal axes (see [`crate::measure::axes`]) measures what is seen, and so its c is too
//! short where a stone lies half buried, and too long where the segment took in some of a neighbour's flank.
//! Beside it, a rounded body is fitted to the visible surface, and its axes are given with their error.
//! What the surface does not tell comes from the usual shape of stones, which is a setting, and a
//! flag says where that was most of it.

use super::axes::Axes;
use super::body::{Body, Seen};
use super::patch::Patch;
use super::shape::exposed_share;
use crate::geometry::DVec3;
use crate::settings::ShapePrior;
use glam::DMat3;

/// Axes of the completed stone.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Completed {
    /// Full axes, metres, a >= b >= c.
    pub axes_m: [f64; 3],
    /// One standard deviation of c, metres: from the fit's own covariance, and from how far the visible part
    /// departs from the body, since the hidden part will do the same.
    pub c_error_m: f64,
    /// Share of the completed body's surface that is visible, 0 to 1.
    pub seen_share: f64,
    /// Whether the surface told less about c/b than the prior: more than half of the prior's variance is left.
    pub c_from_prior: bool,
}

/// Cells along the longest side of the box. Each is one point of the fit: some hundred in all.
const CELLS: f64 = 8.0;
/// Share of the vertices that is left out at either end of an axis when its width is taken.
const TRIMMED: f64 = 0.01;
/// Part of the width at either end in which the outermost vertices are mostly found.
const END: f64 = 0.15;
/// A fit of nine numbers wants more points than these.
const FEWEST_POINTS: usize = 10;
/// Error of c per root mean squared distance of the visible surface from the body: with 2, about 68 % of the
/// stones of known shape lie within one standard deviation.
const ERROR_PER_MISFIT: f64 = 2.0;
/// Surface of the rounded body over that of the ellipsoid of the same axes: 1.06 to 1.09 from slate to sphere.
const BODY_SURFACE: f64 = 1.075;

/// The completed axes of a patch whose box is known; none where the patch has too few triangles, no width
/// or no area.
pub fn completed(patch: &Patch, axes: &Axes, prior: &ShapePrior) -> Option<Completed> {
    let along = Along::of(patch, axes)?;
    let (mut points, mut shares, area_m2, upward) = along.pieces(patch);
    if points.len() < FEWEST_POINTS || area_m2 <= 0.0 {
        return None;
    }
    let scale = area_m2.sqrt();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (point, share) in points.iter_mut().zip(&mut shares) {
        *point /= scale;
        *share /= area_m2;
        (low, high) = (low.min(*point), high.max(*point));
    }
    let widths = along.widths().map(|w| w / scale);
    if widths[1] <= 1e-6 {
        return None;
    }
    let thick = (0.5 * (high.z - low.z)).max(0.5 * prior.c_over_b * widths[1]);
    let middle = 0.5 * (low + high);
    let start = Body {
        // The side that is seen lies on the body, and the rest behind it.
        centre: DVec3::new(middle.x, middle.y, if upward { high.z - thick } else { low.z + thick }),
        turn: DMat3::IDENTITY,
        semi: DVec3::new(0.5 * widths[0], 0.5 * widths[1], thick),
    };
    let fit = start.fitted(&Seen { points: &points, shares: &shares, widths }, prior)?;
    let semi = fit.body.semi.to_array();
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| semi[j].total_cmp(&semi[i]));
    let [_, b, c] = order;
    let axes_m = order.map(|k| 2.0 * semi[k] * scale);
    let of_ratio = fit.covariance[b][b] + fit.covariance[c][c] - 2.0 * fit.covariance[b][c];
    let departure_m = ERROR_PER_MISFIT * fit.misfit * scale;
    Some(Completed {
        axes_m,
        c_error_m: (axes_m[2] * axes_m[2] * fit.covariance[c][c] + departure_m * departure_m).sqrt(),
        seen_share: exposed_share(area_m2 / BODY_SURFACE, axes_m)?.min(1.0),
        c_from_prior: of_ratio > 0.5 * prior.c_over_b_spread * prior.c_over_b_spread,
    })
}

/// Vertices in the frame of the box: x, y, z along a, b, c, metres from their mean.
struct Along {
    points: Vec<DVec3>,
    low: DVec3,
    high: DVec3,
}

impl Along {
    /// None for fewer triangles than a fit needs, or where a coordinate is not finite.
    fn of(patch: &Patch, axes: &Axes) -> Option<Along> {
        let first = *patch.points.first().filter(|_| patch.corners.len() >= FEWEST_POINTS)?;
        let n = patch.points.len() as f64;
        let mean = patch.points.iter().fold(DVec3::ZERO, |sum, &p| sum + (p - first)) / n + first;
        let into = DMat3::from_cols_array_2d(&axes.directions.map(|v| v.to_array())).transpose();
        let points: Vec<DVec3> = patch.points.iter().map(|&p| into * (p - mean)).collect();
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in &points {
            (low, high) = (low.min(p), high.max(p));
        }
        (low.is_finite() && high.is_finite() && high.x > low.x).then_some(Along { points, low, high })
    }

    /// Width along a and b, without the outermost vertices.
    fn widths(&self) -> [f64; 2] {
        let left_out = (TRIMMED * (self.points.len() - 1) as f64) as usize;
        [0, 1].map(|k| {
            let (low, high) = (self.low[k], self.high[k]);
            let inward = |outermost: f64, sign: f64| {
                let depth = |p: &DVec3| sign * (p[k] - outermost);
                // Those near the end suffice, if they are enough.
                let near = END * (high - low);
                let mut depths: Vec<f64> = self.points.iter().map(depth).filter(|depth| *depth <= near).collect();
                if depths.len() <= left_out {
                    depths = self.points.iter().map(depth).collect();
                }
                *depths.select_nth_unstable_by(left_out, f64::total_cmp).1
            };
            (high - low) - inward(low, 1.0) - inward(high, -1.0)
        })
    }

    /// Centroids and areas of the surface in the cells of a grid, their whole area, and whether the surface
    /// faces up along c. The grid hangs at the mean, so that a box turned round has the same cells.
    fn pieces(&self, patch: &Patch) -> (Vec<DVec3>, Vec<f64>, f64, bool) {
        let step = (self.high - self.low).max_element() / CELLS;
        let first = (self.low / step).floor();
        let [nx, ny, nz] = ((self.high / step).floor() - first).to_array().map(|n| n as usize + 1);
        let (origin, per_m) = (first * step, 1.0 / step);
        let mut cells = vec![(DVec3::ZERO, 0.0); nx * ny * nz];
        let (mut area_m2, mut facing) = (0.0, 0.0);
        for &[i, j, k] in &patch.corners {
            let [p, q, r] = [i, j, k].map(|v| self.points[v as usize]);
            let normal = (q - p).cross(r - p);
            let area = 0.5 * normal.length();
            let centroid = (p + q + r) / 3.0;
            // Rounding may put a centroid just outside; below 0 becomes 0.
            let at = (centroid - origin) * per_m;
            let [x, y, z] = [(at.x, nx), (at.y, ny), (at.z, nz)].map(|(c, n)| (c as u32 as usize).min(n - 1));
            let (moment, sum) = &mut cells[(x * ny + y) * nz + z];
            *moment += centroid * area;
            *sum += area;
            area_m2 += area;
            facing += normal.z;
        }
        let full = || cells.iter().filter(|(_, area)| *area > 0.0);
        (full().map(|(moment, area)| *moment / *area).collect(), full().map(|c| c.1).collect(), area_m2, facing >= 0.0)
    }
}
