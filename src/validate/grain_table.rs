//! What the run itself says of its grains: other axes, and how sure it is of each.

use super::error::ValidateError;
use super::score::{AxisErrors, BAxis, Scored, true_b_mm, uncut};
use super::table_file::NumberTable;
use super::truth::Truth;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The run's table.
const TABLE: &str = "grains.csv";
const ID: &str = "grain_id";
const ID_HELP: &str = "it is what the labels of the mesh refer to; give the folder that the run wrote";
const CONFIDENCE: &str = "confidence";
const ELLIPSOID: [&str; 3] = ["ellipsoid_a_axis_m", "ellipsoid_b_axis_m", "ellipsoid_c_axis_m"];
const FIT: [&str; 3] = ["a_fit_m", "b_fit_m", "c_fit_m"];
const COLUMNS: [&str; 8] = [ID, CONFIDENCE, ELLIPSOID[0], ELLIPSOID[1], ELLIPSOID[2], FIT[0], FIT[1], FIT[2]];

/// Bins of confidence.
const BINS: usize = 10;

/// Some columns of a run's table of grains.
pub(super) struct GrainTable {
    rows: BTreeMap<i64, usize>,
    ellipsoid: Option<Vec<Option<[f64; 3]>>>,
    fit: Option<Vec<Option<[f64; 3]>>>,
    confidence: Option<Vec<Option<f64>>>,
}

/// Grain sizes by other axes than the box along the principal axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SizedBy {
    /// Found stones, whole, whose grain has these axes.
    pub stones: usize,
    /// Errors over them.
    pub axes: AxisErrors,
    /// Grain sizes of all grains that have these axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub b_axis_mm: Option<BAxis>,
}

/// Grains of like confidence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bin {
    /// Lowest confidence, 0 to 1; the next bin begins a tenth above.
    pub from: f64,
    /// Grains in the bin.
    pub grains: usize,
    /// Their mean confidence.
    pub mean_confidence: f64,
    /// Share of them that are right: intersection over union with a visible stone of half or more.
    pub share_right: f64,
}

/// Whether grains of a stated confidence are right as often as stated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reliability {
    /// Grains that have a confidence and are judged: not those on hidden stones and membranes.
    pub grains: usize,
    /// Mean difference of stated confidence and share that is right over the bins, each as heavy as its grains.
    pub calibration_error: f64,
    /// The bins that have grains.
    pub bins: Vec<Bin>,
}

/// Where the table of a run is, if it is there.
pub(super) fn grain_table_file(run: &Path) -> Option<PathBuf> {
    let table = run.join(TABLE);
    (run.is_dir() && table.is_file()).then_some(table)
}

impl GrainTable {
    pub(super) fn read(path: &Path) -> Result<GrainTable, ValidateError> {
        let table = NumberTable::read(path, &COLUMNS)?;
        let ids = table.filled(ID, ID_HELP, "whole number", |id| id.fract() == 0.0)?;
        Ok(GrainTable {
            rows: ids.into_iter().enumerate().map(|(row, id)| (id as i64, row)).collect(),
            ellipsoid: table.triples(ELLIPSOID),
            fit: table.triples(FIT),
            confidence: table.column(CONFIDENCE).map(<[_]>::to_vec),
        })
    }

    /// Sizes by the least-squares ellipsoid, if the table has it.
    pub(super) fn ellipsoid(&self, truth: &Truth, scored: &Scored) -> Option<SizedBy> {
        Some(self.sized_by(self.ellipsoid.as_ref()?, truth, scored))
    }

    /// Sizes by the fitted shape, if the table has it.
    pub(super) fn fit(&self, truth: &Truth, scored: &Scored) -> Option<SizedBy> {
        Some(self.sized_by(self.fit.as_ref()?, truth, scored))
    }

    fn row(&self, scored: &Scored, grain: usize) -> Option<usize> {
        self.rows.get(&scored.overlaps.grain_ids[grain]).copied()
    }

    fn sized_by(&self, axes: &[Option<[f64; 3]>], truth: &Truth, scored: &Scored) -> SizedBy {
        let of = |grain: usize| self.row(scored, grain).and_then(|row| axes[row]);
        let is_whole = |stone: usize| !truth.stones[stone].is_cut;
        let matches = scored.judgement.matches.iter().filter(|&(&stone, _)| is_whole(stone));
        let pairs: Vec<_> =
            matches.filter_map(|(&stone, &grain)| Some((of(grain)?, truth.stones[stone].axes_m))).collect();
        let b_m = uncut(truth, &scored.judgement).filter_map(of).map(|axes_m| axes_m[1]);
        SizedBy { stones: pairs.len(), axes: AxisErrors::of(&pairs), b_axis_mm: BAxis::of(true_b_mm(truth), b_m) }
    }

    /// How far the stated confidence can be trusted, if the table states any.
    pub(super) fn reliability(&self, scored: &Scored) -> Option<Reliability> {
        let confidence = self.confidence.as_ref()?;
        let judged = scored.judgement.mostly.iter().enumerate().filter(|(_, kind)| kind.is_judged());
        let stated = |(grain, _): (usize, _)| {
            let confidence = confidence[self.row(scored, grain)?]?;
            Some((confidence, scored.judgement.is_right[grain]))
        };
        Some(Reliability::of(judged.filter_map(stated))).filter(|found| !found.bins.is_empty())
    }
}

impl Reliability {
    /// Of grains with a stated confidence, 0 to 1, each right or not.
    pub fn of(grains: impl IntoIterator<Item = (f64, bool)>) -> Reliability {
        let mut sums = [(0usize, 0.0, 0usize); BINS];
        for (confidence, is_right) in grains {
            let bin = ((confidence * BINS as f64).max(0.0) as usize).min(BINS - 1);
            sums[bin].0 += 1;
            sums[bin].1 += confidence;
            sums[bin].2 += usize::from(is_right);
        }
        let all: usize = sums.iter().map(|s| s.0).sum();
        let bin = |(i, &(grains, confidence, right)): (usize, &(usize, f64, usize))| Bin {
            from: i as f64 / BINS as f64,
            grains,
            mean_confidence: confidence / grains as f64,
            share_right: right as f64 / grains as f64,
        };
        let bins: Vec<Bin> = sums.iter().enumerate().filter(|(_, s)| s.0 > 0).map(bin).collect();
        let off = |b: &Bin| b.grains as f64 * (b.mean_confidence - b.share_right).abs();
        let calibration_error = bins.iter().map(off).sum::<f64>() / all.max(1) as f64;
        Reliability { grains: all, calibration_error, bins }
    }
}
