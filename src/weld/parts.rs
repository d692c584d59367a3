//! The files of a survey as the weld sees them, and how near two vertices must be to be one.

use super::WeldError;
use crate::geometry::{DVec3, PlanBox};
use crate::open::Reach;
use std::ops::Range;

/// Share of the mean edge within which vertices are one, if coordinates are fine enough.
const TOLERANCE_IN_EDGES: f64 = 1e-3;
/// Two roundings to the grid of the coordinates put one place this many of its steps apart, nearly at most.
const TOLERANCE_IN_STEPS: f64 = 1.5;
/// Neighbouring vertices of a mesh are now and then much nearer than a mean edge.
const WIDEST_TOLERANCE_IN_EDGES: f64 = 0.1;
/// Beyond this, a tolerance that is asked for is a mistake of units.
const WIDEST_ASKED_IN_EDGES: f64 = 0.5;

/// One file of a survey.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Its path, as given.
    pub name: String,
    /// Its vertices, by the survey's numbers.
    pub vertices: Range<u64>,
    /// Its triangles, by the survey's numbers.
    pub triangles: Range<u64>,
    /// Lowest corner of its box, local metres.
    pub min: DVec3,
    /// Highest corner of its box, local metres.
    pub max: DVec3,
    /// Mean edge of a sample of its triangles, metres; none if no edge has any length.
    pub edge_m: Option<f64>,
    /// Coarsest step between neighbouring values of its coordinates, metres; 0 for whole numbers.
    pub step_m: f64,
}

/// The files of a survey.
pub fn parts(reach: &Reach) -> Vec<Part> {
    let frame = reach.frame();
    let of_file = |(file, &edge_m): (&crate::open::SurveyFile, &Option<f64>)| {
        let (min, max) = file.input_bounds();
        Part {
            name: file.path().display().to_string(),
            vertices: file.first_vertex()..file.first_vertex() + file.vertices(),
            triangles: file.first_triangle()..file.first_triangle() + file.triangles(),
            min: frame.local(min),
            max: frame.local(max),
            edge_m,
            step_m: file.coordinate_step().unwrap_or(0.0) * frame.metres_per_input_unit,
        }
    };
    reach.files().iter().zip(reach.sampled_edges_m()).map(of_file).collect()
}

impl Part {
    fn plan(&self) -> PlanBox {
        PlanBox { min: [self.min.x, self.min.y], max: [self.max.x, self.max.y] }
    }

    /// Number of triangles.
    pub(super) fn size(&self) -> u64 {
        self.triangles.end - self.triangles.start
    }

    /// Distance in plan between the boxes of two files, metres; 0 where they touch.
    pub(super) fn gap_m(&self, other: &Part) -> f64 {
        let (a, b) = (self.plan(), other.plan());
        let along = |i: usize| (b.min[i] - a.max[i]).max(a.min[i] - b.max[i]).max(0.0);
        along(0).hypot(along(1))
    }

    /// Diagonal of the box in plan, metres.
    pub(super) fn diagonal_m(&self) -> f64 {
        let plan = self.plan();
        (plan.max[0] - plan.min[0]).hypot(plan.max[1] - plan.min[1])
    }
}

/// How near two vertices of different files must be to be one, metres; none where no file has an edge of any length.
pub(super) fn tolerance_m(parts: &[Part], weld_m: f64) -> Result<Option<f64>, WeldError> {
    let shortest = parts.iter().filter_map(|p| p.edge_m.map(|e| (e, p))).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((edge_m, part)) = shortest else { return Ok(None) };
    if weld_m > WIDEST_ASKED_IN_EDGES * edge_m {
        return Err(WeldError::Tolerance { path: part.name.clone(), weld_m, edge_m });
    }
    let step_m = parts.iter().map(|p| p.step_m).fold(0.0, f64::max);
    let auto = (TOLERANCE_IN_EDGES * edge_m).max(TOLERANCE_IN_STEPS * step_m).min(WIDEST_TOLERANCE_IN_EDGES * edge_m);
    Ok(Some(if weld_m > 0.0 { weld_m } else { auto }))
}

/// For each file the part of its box where other files may be as well; none where there is no such part.
pub(super) fn zones(parts: &[Part], tolerance_m: f64) -> Vec<Option<PlanBox>> {
    let wide: Vec<PlanBox> = parts
        .iter()
        .map(|p| {
            let plan = p.plan();
            PlanBox { min: plan.min.map(|v| v - tolerance_m), max: plan.max.map(|v| v + tolerance_m) }
        })
        .collect();
    let zone = |i: usize| {
        let mut zone = PlanBox::EMPTY;
        for other in (0..wide.len()).filter(|&j| j != i) {
            let (a, b) = (wide[i], wide[other]);
            let common = PlanBox {
                min: [a.min[0].max(b.min[0]), a.min[1].max(b.min[1])],
                max: [a.max[0].min(b.max[0]), a.max[1].min(b.max[1])],
            };
            if common.min[0] <= common.max[0] && common.min[1] <= common.max[1] {
                zone.merge(&common);
            }
        }
        (zone.min[0] <= zone.max[0]).then_some(zone)
    };
    (0..parts.len()).map(zone).collect()
}

/// What two ranges have in common.
pub(super) fn common(a: &Range<u64>, b: &Range<u64>) -> Range<u64> {
    let start = a.start.max(b.start);
    start..a.end.min(b.end).max(start)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(min: [f64; 2], max: [f64; 2], edge_m: f64, step_m: f64) -> Part {
        Part {
            name: "part.ply".into(),
            vertices: 0..1,
            triangles: 0..1,
            min: DVec3::new(min[0], min[1], 0.0),
            max: DVec3::new(max[0], max[1], 1.0),
            edge_m: Some(edge_m),
            step_m,
        }
    }

    #[test]
    fn the_tolerance_follows_the_coarser_coordinates_but_never_reaches_a_neighbour() {
        let of = |step_m: f64, weld_m: f64| {
            let parts = [part([0.0; 2], [1.0; 2], 0.01, 1e-12), part([1.0; 2], [2.0; 2], 0.02, step_m)];
            tolerance_m(&parts, weld_m)
        };
        assert_eq!(of(1e-12, 0.0).unwrap_or(None), Some(1e-5));
        assert_eq!(of(2e-5, 0.0).unwrap_or(None), Some(1.5 * 2e-5));
        assert_eq!(of(2e-3, 0.0).unwrap_or(None), Some(1e-3));
        assert_eq!(of(2e-3, 2e-3).unwrap_or(None), Some(2e-3));
        assert!(matches!(of(2e-3, 6e-3), Err(WeldError::Tolerance { .. })));
    }

    #[test]
    fn only_where_boxes_meet_is_a_file_looked_at() {
        let parts = [
            part([0.0, 0.0], [1.0, 1.0], 0.01, 0.0),
            part([1.0, 0.0], [2.0, 1.0], 0.01, 0.0),
            part([5.0, 5.0], [6.0, 6.0], 0.01, 0.0),
        ];
        let zones = zones(&parts, 0.1);
        assert_eq!(zones[0], Some(PlanBox { min: [0.9, -0.1], max: [1.1, 1.1] }));
        assert_eq!(zones[0], zones[1]);
        assert_eq!(zones[2], None);
        assert_eq!(parts[0].gap_m(&parts[1]), 0.0);
        assert_eq!(parts[1].gap_m(&parts[2]), 5.0);
    }
}
