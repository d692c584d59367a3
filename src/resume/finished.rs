//! A run that is done already: what a job that always resumes finds when it is started once more.

use super::identity::{Change, Identity};
use crate::open::Reach;
use crate::settings::Settings;
use serde_json::Value;
use std::path::Path;

/// The report of a run, the last file to get its name: where it is, all results are there.
const REPORT: &str = "run.json";

/// Everything that the results depend on, for the report of the run.
pub fn whole_identity(reach: &Reach, settings: &Settings) -> Value {
    Identity::of_survey(reach).and_all(settings).value()
}

/// What has changed since the run whose results are complete in `out`: nothing, if it was this very run. None where
/// there is no such run.
pub fn changes_since_finished(out: &Path, reach: &Reach, settings: &Settings) -> Option<Vec<Change>> {
    let report: Value = serde_json::from_slice(&std::fs::read(out.join(REPORT)).ok()?).ok()?;
    let facts = report.get("facts")?;
    if facts.get("lost_tiles")?.as_array()?.is_empty() {
        let earlier = facts.get("identity")?.to_string();
        Some(Identity::of_survey(reach).and_all(settings).changes_since(&earlier))
    } else {
        None
    }
}
