//! A run that is done already: what a job that always resumes finds when it is started once more.

use super::identity::{Change, Identity};
use crate::open::Reach;
use crate::settings::Settings;
use serde_json::Value;
use std::path::Path;

/// Everything that the results depend on, as one line of text for the report of the run.
pub fn whole_identity(reach: &Reach, settings: &Settings) -> String {
    Identity::of_survey(reach).and_all(settings).text()
}

/// What has changed since the run whose report this is: nothing, if it was this very run. None where no report is, or
/// that of a run which lost tiles.
pub fn changes_since_finished(report: &Path, reach: &Reach, settings: &Settings) -> Option<Vec<Change>> {
    let report: Value = serde_json::from_slice(&std::fs::read(report).ok()?).ok()?;
    let facts = report.get("facts")?;
    let earlier = facts.get("identity")?.as_str()?;
    if !facts.get("lost_tiles")?.as_array()?.is_empty() {
        return None;
    }
    let identity = Identity::of_survey(reach).and_all(settings);
    // The same text is the same run; a number that is read again may be another in its last digit.
    Some(if identity.text() == earlier { Vec::new() } else { identity.changes_since(earlier) })
}
