//! Stitching: what the tiles published becomes one catalogue, the same whatever the tiles were.
//!
//! Grains need no joining: each was published whole, once, by the tile that owns it. They are put in the
//! order of their anchors, numbered, and coloured. Oversize bodies, which no tile sees whole, are joined
//! by the edges at which they leave a core.

mod catalogue;
mod color;
mod oversize;
mod record;

pub use catalogue::{Catalogue, NumberedGrain, Oversize, TileReport};
pub use record::RecordError;

use crate::measure::Grain;
use crate::measure::confidence::confidence;
use crate::segment::OversizePiece;
use serde::{Deserialize, Serialize};

/// What one tile publishes.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct TileFinding {
    /// The grains that its core owns.
    pub grains: Vec<Grain>,
    /// The parts of oversize bodies in its core.
    pub oversize: Vec<OversizePiece>,
    /// How it was worked.
    pub report: TileReport,
}

/// Leaves out the grains of which the method is less sure than `least`, and gives how many; those of which it does not
/// tell stay.
pub fn leave_out(findings: &mut [TileFinding], least: f64) -> u64 {
    let mut left_out = 0;
    for finding in findings {
        let before = finding.grains.len();
        finding.grains.retain(|grain| confidence(grain).is_none_or(|c| c >= least));
        let gone = (before - finding.grains.len()) as u64;
        finding.report.grains -= gone;
        left_out += gone;
    }
    left_out
}

/// Joins the findings of all tiles, in any order. `touch_steps` is the distance, in steps of the outline
/// grid, within which two outlines touch.
pub fn stitch(findings: Vec<TileFinding>, touch_steps: i64) -> (Catalogue, Vec<TileReport>) {
    let (mut grains, mut pieces, mut reports) = (Vec::new(), Vec::new(), Vec::new());
    for finding in findings {
        grains.extend(finding.grains);
        pieces.extend(finding.oversize);
        reports.push(finding.report);
    }
    grains.sort_by_key(|g: &Grain| g.anchor);
    reports.sort_by_key(|r| r.tile);
    let colors = color::colors(&grains, touch_steps);
    let grains = grains
        .into_iter()
        .zip(colors)
        .zip(1..)
        .map(|((grain, segment_color), grain_id)| NumberedGrain { grain_id, segment_color, grain })
        .collect();
    (Catalogue { grains, oversize: oversize::join(pieces) }, reports)
}
