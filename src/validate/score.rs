//! The score of a labelling: the paper's four results and what leads to them.
//!
//! Names of fields in JSON are those of the reference scorer; what is added has its unit in its name.

use super::detection::Detection;
use super::judgement::{Judgement, Mostly};
use super::labels::Labels;
use super::matched::{GrainPoints, Match, matches};
use super::overlap::Overlaps;
use super::principal::PrincipalBox;
use super::spread::{Middle, Percentiles};
use super::truth::Truth;
use serde::Serialize;

/// Counts and shares of detection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Counts {
    /// Stones found.
    pub tp: usize,
    /// False grains.
    pub fp: usize,
    /// Stones missed.
    #[serde(rename = "fn")]
    pub missed: usize,
    /// Share of the grains that are right.
    pub precision: f64,
    /// Share of the stones that were found.
    pub recall: f64,
    /// Harmonic mean of the two.
    pub f1: f64,
    /// Found over all stones and false grains.
    pub iou: f64,
}

impl From<Detection> for Counts {
    fn from(d: Detection) -> Counts {
        let (precision, recall, f1, iou) = (d.precision(), d.recall(), d.f1(), d.iou());
        Counts { tp: d.found, fp: d.false_grains, missed: d.missed, precision, recall, f1, iou }
    }
}

/// What went wrong by majority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Errors {
    /// Further grains on stones that were found.
    pub over_segmented_extra: usize,
    /// Stones with such grains.
    pub over_segmented_pebbles: usize,
    /// Grains that are mostly sand.
    pub mostly_sand: usize,
    /// Grains on membranes over unseen space, ignored.
    pub phantom_ignored: usize,
    /// Stones that lie in another stone's grain.
    pub under_segmented: usize,
    /// Other stones that were missed.
    pub missed: usize,
}

/// Areas of found stones against their grains, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AreaShares {
    /// Share of the grain that is on its stone.
    pub precision: Middle,
    /// Share of the stone that is in its grain.
    pub recall: Middle,
    /// Intersection over union.
    pub iou: Middle,
}

/// Errors of one axis over found stones that the scene's border does not cut.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AxisError {
    /// Mean size of the error, percent of the true length.
    pub mean_abs_percent: f64,
    /// Mean error, percent: too long is above 0.
    pub bias_percent: f64,
    /// Median size of the error, percent.
    pub median_abs_percent: f64,
    /// Mean size of the error, mm.
    pub mean_abs_mm: f64,
}

/// Errors of the three axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AxisErrors {
    /// Long axis.
    #[serde(rename = "A")]
    pub a: AxisError,
    /// Intermediate axis.
    #[serde(rename = "B")]
    pub b: AxisError,
    /// Short axis.
    #[serde(rename = "C")]
    pub c: AxisError,
}

impl AxisErrors {
    /// Of pairs of found and true axes, metres.
    pub(super) fn of(pairs: &[([f64; 3], [f64; 3])]) -> AxisErrors {
        let axis = |i: usize| {
            let errors = || pairs.iter().map(|(found, truth)| (found[i] - truth[i], truth[i]));
            let relative = Middle::of(errors().map(|(error, truth)| (error / truth).abs()));
            AxisError {
                mean_abs_percent: 100.0 * relative.mean,
                bias_percent: 100.0 * Middle::of(errors().map(|(error, truth)| error / truth)).mean,
                median_abs_percent: 100.0 * relative.median,
                mean_abs_mm: 1e3 * Middle::of(errors().map(|(error, _)| error.abs())).mean,
            }
        };
        AxisErrors { a: axis(0), b: axis(1), c: axis(2) }
    }

    /// The three, in order.
    pub fn to_array(&self) -> [AxisError; 3] {
        [self.a, self.b, self.c]
    }
}

/// How far axes are turned, degrees, over the same stones.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Orientation {
    /// Angle between the A axes.
    #[serde(rename = "A")]
    pub a: Middle,
    /// Angle between the B axes.
    #[serde(rename = "B")]
    pub b: Middle,
    /// Angle between the C axes.
    #[serde(rename = "C")]
    pub c: Middle,
    /// Yaw, pitch and roll together.
    pub cumulative: Middle,
}

/// Grain sizes by the b axis, mm, without what the scene's border cuts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BAxis {
    /// Of the visible stones, whole.
    pub truth: Percentiles,
    /// Of the grains.
    pub segments: Option<Percentiles>,
    /// How much too large these are.
    pub error_percent: Option<Percentiles>,
}

impl BAxis {
    pub(super) fn of(truth: Option<Percentiles>, grains_m: impl IntoIterator<Item = f64>) -> Option<BAxis> {
        let truth = truth?;
        let segments = Percentiles::of(grains_m).map(|p| p.map(|m| 1e3 * m));
        Some(BAxis { truth, segments, error_percent: segments.map(|found| found.error_percent(truth)) })
    }
}

/// Means over the reference pebbles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ReferenceMean {
    /// Share of the grain on its stone.
    pub precision: f64,
    /// Share of the stone in its grain.
    pub recall: f64,
    /// Intersection over union.
    pub iou: f64,
    /// Sizes of the errors of A, B, C together, cm.
    pub cumulative_axes_cm: f64,
    /// Yaw, pitch and roll together, degrees.
    pub cumulative_angle: f64,
}

/// Pebbles that are looked at one by one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct References {
    /// How many there are.
    pub n: usize,
    /// Those with an intersection over union above 0.8.
    pub iou_over_08: usize,
    /// Means over them.
    pub mean: ReferenceMean,
    /// Each of them, by number.
    pub rows: Vec<Match>,
}

/// Mean, median and largest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MiddleMax {
    /// Mean and median.
    #[serde(flatten)]
    pub middle: Middle,
    /// The largest.
    pub max: f64,
}

/// Spheres fitted to calibration balls of which more than 15 % is in the mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spheres {
    /// How many there are.
    pub n: usize,
    /// Root mean square distance from each one's sphere, mm.
    pub rmse_mm: MiddleMax,
    /// The same from spheres of the true radius about the same centres, mm.
    pub rmse_true_radius_mm: MiddleMax,
    /// Mean of fitted less true radius, mm.
    pub radius_bias_mm: f64,
}

/// The score of one labelling.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Grains that count.
    pub segments: usize,
    /// Visible stones.
    pub visible: usize,
    /// One grain, one stone, intersection over union of half or more.
    pub detection_iou50: Counts,
    /// A stone is found if a grain is mostly it.
    pub detection_majority: Counts,
    /// What went wrong.
    pub errors: Errors,
    /// Areas of found stones; this and the next are none if no stone was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area: Option<AreaShares>,
    /// Sizes of found stones by the box along the principal axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<AxisErrors>,
    /// Attitudes of found stones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orientation: Option<Orientation>,
    /// Grain sizes of all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub b_axis_mm: Option<BAxis>,
    /// Pebbles that are looked at one by one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference_pebbles: Option<References>,
    /// Calibration balls.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spheres: Option<Spheres>,
    /// Each found stone beside its grain.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub matched: Vec<Match>,
}

/// A labelling that was scored, with what led to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scored {
    /// The score.
    pub score: Score,
    /// Shared areas.
    pub overlaps: Overlaps,
    /// What became of each stone and grain.
    pub judgement: Judgement,
    /// The box of each grain, by place.
    pub boxes: Vec<Option<PrincipalBox>>,
}

/// Less of a ball gives no sphere to speak of.
const LEAST_REPRESENTED: f64 = 0.15;

/// Scores a labelling; grains below `min_area_m2` are not looked at.
pub fn score(truth: &Truth, labels: &Labels, min_area_m2: f64) -> Scored {
    let overlaps = Overlaps::of(truth.surface(), &labels.of_triangle);
    let judgement = Judgement::of(&overlaps, &truth.visible, min_area_m2);
    let points = GrainPoints::of(truth, labels, &overlaps);
    let boxes = points.boxes();
    let matched = matches(truth, &overlaps, &judgement, &points, &boxes);
    let score = summary(truth, &judgement, &boxes, matched);
    Scored { score, overlaps, judgement, boxes }
}

fn summary(truth: &Truth, judgement: &Judgement, boxes: &[Option<PrincipalBox>], matched: Vec<Match>) -> Score {
    let main = || matched.iter().filter(|m| m.main == 1);
    let whole = || main().filter(|m| m.cut == 0);
    let any = |value| (!matched.is_empty()).then_some(value);
    let axes: Vec<_> = whole().map(|m| axes_of(m, truth)).collect();
    let turned = |angle: fn(&super::matched::AttitudeError) -> f64| {
        Middle::of(whole().filter_map(|m| m.attitude.as_ref()).map(angle))
    };
    let knows_attitudes = truth.stones.iter().any(|stone| stone.directions.is_some());
    let orientation = Orientation {
        a: turned(|t| t.a_angle),
        b: turned(|t| t.b_angle),
        c: turned(|t| t.c_angle),
        cumulative: turned(|t| t.cumulative_angle),
    };
    let b_m = uncut(truth, judgement).filter_map(|grain| boxes[grain]).map(|found| found.extents_m[1]);
    let b_axis_mm = if matched.is_empty() { None } else { BAxis::of(true_b_mm(truth), b_m) };
    Score {
        segments: judgement.grains,
        visible: judgement.visible,
        detection_iou50: judgement.by_overlap.into(),
        detection_majority: judgement.by_majority.into(),
        errors: Errors {
            over_segmented_extra: judgement.split_grains,
            over_segmented_pebbles: judgement.split_stones,
            mostly_sand: judgement.sand_grains,
            phantom_ignored: judgement.unseen_grains,
            under_segmented: judgement.merged.len(),
            missed: judgement.overlooked.len(),
        },
        area: any(AreaShares {
            precision: Middle::of(main().map(|m| m.precision)),
            recall: Middle::of(main().map(|m| m.recall)),
            iou: Middle::of(main().map(|m| m.iou)),
        }),
        axes: (!matched.is_empty()).then(|| AxisErrors::of(&axes)),
        orientation: (!matched.is_empty() && knows_attitudes).then_some(orientation),
        b_axis_mm,
        reference_pebbles: references(&matched),
        spheres: spheres(main()),
        matched,
    }
}

/// Found and true axes of a match, metres.
fn axes_of(found: &Match, truth: &Truth) -> ([f64; 3], [f64; 3]) {
    let axes_m = truth.stones[found.pebble].axes_m;
    let errors = found.errors_m();
    ([0, 1, 2].map(|i| axes_m[i] + errors[i]), axes_m)
}

/// D16, D50, D84 of the stones that count and are whole, mm.
pub(super) fn true_b_mm(truth: &Truth) -> Option<Percentiles> {
    let counts = truth.stones.iter().zip(&truth.visible).filter(|&(stone, &visible)| visible && !stone.is_cut);
    Percentiles::of(counts.map(|(stone, _)| stone.axes_m[1])).map(|p| p.map(|m| 1e3 * m))
}

/// The grains that count and are not those of stones that the scene's border cuts.
pub(super) fn uncut<'a>(truth: &'a Truth, judgement: &'a Judgement) -> impl Iterator<Item = usize> + 'a {
    let counts = |kind: &Mostly| *kind != Mostly::Small && kind.stone().is_none_or(|stone| !truth.stones[stone].is_cut);
    judgement.mostly.iter().enumerate().filter(move |(_, kind)| counts(kind)).map(|(grain, _)| grain)
}

fn references(matched: &[Match]) -> Option<References> {
    let mut rows: Vec<Match> = matched.iter().filter(|m| m.reference > 0).cloned().collect();
    rows.sort_by_key(|m| m.reference);
    let mean = |value: fn(&Match) -> f64| Middle::of(rows.iter().map(value)).mean;
    let mean = ReferenceMean {
        precision: mean(|m| m.precision),
        recall: mean(|m| m.recall),
        iou: mean(|m| m.iou),
        cumulative_axes_cm: mean(|m| m.cumulative_axes_cm),
        cumulative_angle: mean(|m| m.attitude.map_or(f64::NAN, |t| t.cumulative_angle)),
    };
    let iou_over_08 = rows.iter().filter(|m| m.iou > 0.8).count();
    (!rows.is_empty()).then_some(References { n: rows.len(), iou_over_08, mean, rows })
}

fn spheres<'a>(main: impl Iterator<Item = &'a Match>) -> Option<Spheres> {
    let is_seen = |m: &&Match| m.represented.is_none_or(|share| share > LEAST_REPRESENTED);
    let balls: Vec<_> = main.filter(is_seen).filter_map(|m| m.ball).collect();
    let spread = |value: fn(&super::matched::Ball) -> f64| MiddleMax {
        middle: Middle::of(balls.iter().map(value)),
        max: balls.iter().map(value).fold(f64::NAN, f64::max),
    };
    (!balls.is_empty()).then(|| Spheres {
        n: balls.len(),
        rmse_mm: spread(|b| b.rmse_mm),
        rmse_true_radius_mm: spread(|b| b.rmse_true_radius_mm),
        radius_bias_mm: Middle::of(balls.iter().map(|b| b.radius_error_mm)).mean,
    })
}
