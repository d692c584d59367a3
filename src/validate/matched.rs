//! Each found stone beside its grain: shared area, size, attitude, and the sphere of a calibration ball.
//!
//! Names of fields in JSON are those of the reference scorer.

use super::judgement::Judgement;
use super::labels::Labels;
use super::overlap::Overlaps;
use super::principal::{PrincipalBox, Turned};
use super::sphere::Sphere;
use super::truth::Truth;
use crate::geometry::DVec3;
use serde::Serialize;
use std::collections::BTreeMap;

/// A stone and a grain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Match {
    /// The stone, from 0.
    pub pebble: usize,
    /// Number of the reference pebble; 0 for others.
    #[serde(rename = "ref")]
    pub reference: u32,
    /// 1 if the border of the scene cuts the stone.
    pub cut: u8,
    /// Id of the grain.
    pub segment: i64,
    /// 1 if the grain is the stone's match by majority; 0 if it is only the largest on a reference pebble.
    pub main: u8,
    /// Share of the grain's area that is on the stone.
    pub precision: f64,
    /// Share of the stone's area that is in the grain.
    pub recall: f64,
    /// Intersection over union of their areas.
    pub iou: f64,
    /// Share of the whole stone's surface that is in the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub represented: Option<f64>,
    /// Error of A, metres.
    #[serde(rename = "A_error")]
    pub a_error: f64,
    /// Error of B, metres.
    #[serde(rename = "B_error")]
    pub b_error: f64,
    /// Error of C, metres.
    #[serde(rename = "C_error")]
    pub c_error: f64,
    /// Sizes of the three errors together, cm.
    pub cumulative_axes_cm: f64,
    /// Error of A over the true A.
    #[serde(rename = "A_relative")]
    pub a_relative: f64,
    /// Error of B over the true B.
    #[serde(rename = "B_relative")]
    pub b_relative: f64,
    /// Error of C over the true C.
    #[serde(rename = "C_relative")]
    pub c_relative: f64,
    /// How far the axes are turned, if the true ones are known.
    #[serde(flatten)]
    pub attitude: Option<AttitudeError>,
    /// The sphere that fits a calibration ball's grain.
    #[serde(flatten)]
    pub ball: Option<Ball>,
}

/// How far a grain's axes are turned from the true ones, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AttitudeError {
    /// Angle between the A axes.
    #[serde(rename = "A_angle")]
    pub a_angle: f64,
    /// Angle between the B axes.
    #[serde(rename = "B_angle")]
    pub b_angle: f64,
    /// Angle between the C axes.
    #[serde(rename = "C_angle")]
    pub c_angle: f64,
    /// Yaw, pitch and roll together.
    pub cumulative_angle: f64,
    /// Size of the yaw.
    pub yaw: f64,
    /// Size of the pitch.
    pub pitch: f64,
    /// Size of the roll.
    pub roll: f64,
}

/// The sphere that fits a calibration ball's grain, mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ball {
    /// Radius of the sphere.
    pub fit_radius_mm: f64,
    /// That radius less the true one.
    pub radius_error_mm: f64,
    /// Root mean square distance of the vertices from the sphere.
    pub rmse_mm: f64,
    /// The same from a sphere of the true radius about the same centre.
    pub rmse_true_radius_mm: f64,
}

impl Match {
    /// Errors of A, B, C, metres.
    pub fn errors_m(&self) -> [f64; 3] {
        [self.a_error, self.b_error, self.c_error]
    }
}

/// The vertices of each grain of a labelling.
pub(super) struct GrainPoints<'a> {
    truth: &'a Truth,
    /// Vertices by grain, each grain's ascending and each vertex once.
    vertices: Vec<u32>,
    starts: Vec<usize>,
}

impl<'a> GrainPoints<'a> {
    /// Gathers them: those of the grain's triangles, or those that have its label.
    pub(super) fn of(truth: &'a Truth, labels: &Labels, overlaps: &Overlaps) -> GrainPoints<'a> {
        let mut of_grain: Vec<Vec<u32>> = vec![Vec::new(); overlaps.grains()];
        match &labels.of_vertex {
            Some(of_vertex) => {
                for (vertex, &label) in (0u32..).zip(of_vertex) {
                    if let Some(grain) = overlaps.place(label) {
                        of_grain[grain].push(vertex);
                    }
                }
            }
            None => {
                for (corners, &label) in truth.triangles.iter().zip(&labels.of_triangle) {
                    if let Some(grain) = overlaps.place(label) {
                        of_grain[grain].extend(corners);
                    }
                }
            }
        }
        let (mut vertices, mut starts) = (Vec::new(), vec![0]);
        for mut of_one in of_grain {
            of_one.sort_unstable();
            of_one.dedup();
            vertices.extend(of_one);
            starts.push(vertices.len());
        }
        GrainPoints { truth, vertices, starts }
    }

    /// The vertices of a grain, metres.
    pub(super) fn of_grain(&self, grain: usize) -> Vec<DVec3> {
        let of_one = &self.vertices[self.starts[grain]..self.starts[grain + 1]];
        of_one.iter().map(|&v| self.truth.points[v as usize]).collect()
    }

    /// The box of every grain.
    pub(super) fn boxes(&self) -> Vec<Option<PrincipalBox>> {
        (0..self.starts.len() - 1).map(|grain| PrincipalBox::of(&self.of_grain(grain))).collect()
    }
}

/// Every stone that was found by majority beside its match, and the reference pebbles beside the grain that holds most
/// of them; grains without a box are left out.
pub(super) fn matches(
    truth: &Truth,
    overlaps: &Overlaps,
    judgement: &Judgement,
    points: &GrainPoints<'_>,
    boxes: &[Option<PrincipalBox>],
) -> Vec<Match> {
    let mut pairs: BTreeMap<usize, usize> = judgement.matches.clone();
    for (stone, _) in truth.stones.iter().enumerate().filter(|(_, stone)| stone.reference > 0) {
        pairs.extend(overlaps.largest_on(stone).map(|(grain, _)| (stone, grain)));
    }
    let beside = |(&pebble, &grain): (&usize, &usize)| {
        let (stone, found) = (&truth.stones[pebble], boxes[grain]?);
        let shared = overlaps.shared_m2(grain, pebble);
        let [a_error, b_error, c_error] = [0, 1, 2].map(|i| found.extents_m[i] - stone.axes_m[i]);
        let [a, b, c] = stone.axes_m;
        Some(Match {
            pebble,
            reference: stone.reference,
            cut: u8::from(stone.is_cut),
            segment: overlaps.grain_ids[grain],
            main: u8::from(judgement.matches.get(&pebble) == Some(&grain)),
            precision: shared / overlaps.grain_area_m2[grain],
            recall: shared / overlaps.stone_area_m2[pebble],
            iou: overlaps.iou(grain, pebble),
            represented: stone.represented,
            a_error,
            b_error,
            c_error,
            cumulative_axes_cm: (a_error.abs() + b_error.abs() + c_error.abs()) * 100.0,
            a_relative: a_error / a,
            b_relative: b_error / b,
            c_relative: c_error / c,
            attitude: stone.directions.map(|truth| AttitudeError::of(&Turned::between(found.directions, truth))),
            ball: stone.radius_m.and_then(|radius_m| Ball::of(&points.of_grain(grain), radius_m)),
        })
    };
    pairs.iter().filter_map(beside).collect()
}

impl AttitudeError {
    fn of(turned: &Turned) -> AttitudeError {
        let ([a_angle, b_angle, c_angle], [yaw, pitch, roll]) = (turned.axes_deg, turned.yaw_pitch_roll_deg);
        AttitudeError { a_angle, b_angle, c_angle, cumulative_angle: turned.cumulative_deg(), yaw, pitch, roll }
    }
}

impl Ball {
    fn of(points: &[DVec3], radius_m: f64) -> Option<Ball> {
        let sphere = Sphere::fit(points)?;
        Some(Ball {
            fit_radius_mm: 1e3 * sphere.radius_m,
            radius_error_mm: 1e3 * (sphere.radius_m - radius_m),
            rmse_mm: 1e3 * sphere.rmse_m(points, sphere.radius_m),
            rmse_true_radius_mm: 1e3 * sphere.rmse_m(points, radius_m),
        })
    }
}
