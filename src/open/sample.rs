//! A sample of a file's edges: what is judged by it is whether unit, precision and axes can be what they seem.

use super::frame::Frame;
use super::survey_file::SurveyFile;

/// Places in a file, evenly spread, where edges are measured.
const SAMPLED_PLACES: u64 = 256;
/// Triangles that are measured at each; pairs of neighbouring points in a cloud.
const SAMPLED_TRIANGLES: u64 = 200;

/// Sums over edges of triangles. A cloud has none: there they run from each point to the next in the file, which tells
/// how steep it is but not how dense.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EdgeSample {
    edges: u32,
    /// Edges of no length.
    collapsed: u32,
    length_m: f64,
    rise_m: f64,
    reach_m: f64,
    /// Twice the area in plan of what faces up, and of what faces down, m².
    faces_m2: [f64; 2],
    is_cloud: bool,
}

impl EdgeSample {
    /// Of a file in this frame.
    pub(super) fn of(file: &SurveyFile, frame: &Frame) -> EdgeSample {
        let mesh = &file.mesh;
        let is_cloud = file.triangles() == 0;
        let count = if is_cloud { file.vertices().saturating_sub(1) } else { file.triangles() };
        let mut sample = EdgeSample { is_cloud, ..EdgeSample::default() };
        for place in 0..SAMPLED_PLACES {
            let part = |i: u64| (u128::from(i) * u128::from(count) / u128::from(SAMPLED_PLACES)) as u64;
            for i in part(place)..part(place + 1).min(part(place) + SAMPLED_TRIANGLES) {
                let corners = if is_cloud { [i, i + 1, i] } else { mesh.faces.triangle(mesh.bytes(), i) };
                let at = |v: u64| frame.local(mesh.vertices.position(mesh.bytes(), v));
                let [a, b, c] = corners.map(at);
                let twice_m2 = (b - a).cross(c - a).z;
                if twice_m2.is_finite() && !is_cloud {
                    sample.faces_m2[usize::from(twice_m2 < 0.0)] += twice_m2.abs();
                }
                for edge in [b - a, c - b, a - c].into_iter().take(if is_cloud { 1 } else { 3 }) {
                    // A point of a cloud may be no number.
                    if edge.is_finite() {
                        sample.edges += 1;
                        sample.collapsed += u32::from(edge.length() == 0.0);
                        sample.length_m += edge.length();
                        sample.rise_m += edge.z.abs();
                        sample.reach_m += edge.x.hypot(edge.y);
                    }
                }
            }
            // Corners may lie anywhere in the file, and every page that is touched brings its neighbours.
            mesh.release_if_large();
        }
        mesh.release();
        sample
    }

    /// Mean edge, metres, those of no length left out; `None` if all are, and for a cloud.
    pub(super) fn mean_edge_m(&self) -> Option<f64> {
        let edges = self.edges - self.collapsed;
        (edges > 0 && !self.is_cloud).then(|| self.length_m / f64::from(edges))
    }

    /// Mean edge, metres, with those of no length. Rounding coordinates to a coarse grid lengthens some edges and
    /// takes all length from others, but it leaves this mean nearly as it was.
    pub(super) fn mean_with_collapsed_m(&self) -> Option<f64> {
        (self.edges > 0 && !self.is_cloud).then(|| self.length_m / f64::from(self.edges))
    }

    /// Share of the surface, in plan, that faces down; none for a cloud.
    pub(super) fn share_facing_down(&self) -> Option<f64> {
        let [up, down] = self.faces_m2;
        (up + down > 0.0).then(|| down / (up + down))
    }

    /// How far edges rise for each part that they reach in plan.
    pub(super) fn steepness(&self) -> f64 {
        if self.rise_m > 0.0 { self.rise_m / self.reach_m } else { 0.0 }
    }
}
