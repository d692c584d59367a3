//! A run that is done already: what a job that always resumes finds when it is started once more.

use super::identity::{Change, Identity};
use crate::open::Reach;
use crate::settings::Settings;
use serde_json::Value;
use std::path::Path;

/// Everything that the results depend on, as one line of text for the report of the run.
pub fn whole_identity(reach: &Reach, settings: &Settings) -> String {
    Identity::of_survey(reach, settings).and_all(settings).text()
}

/// What has changed since the run whose results are complete in `out`: nothing, if it was this very run. None where no
/// report of that name is, or that of a run which lost tiles, or where a file that it names is gone or empty.
pub fn changes_since_finished(out: &Path, report: &str, reach: &Reach, settings: &Settings) -> Option<Vec<Change>> {
    let report: Value = serde_json::from_slice(&std::fs::read(out.join(report)).ok()?).ok()?;
    let is_there = |name: &Value| {
        let path = name.as_str().map(|name| out.join(name));
        path.and_then(|path| std::fs::metadata(path).ok()).is_some_and(|file| file.is_file() && file.len() > 0)
    };
    if !report.get("outputs")?.as_array()?.iter().all(is_there) {
        return None;
    }
    let facts = report.get("facts")?;
    let earlier = facts.get("identity")?.as_str()?;
    if !facts.get("lost_tiles")?.as_array()?.is_empty() {
        return None;
    }
    let identity = Identity::of_survey(reach, settings).and_all(settings);
    // The same text is the same run; a number that is read again may be another in its last digit.
    Some(if identity.text() == earlier { Vec::new() } else { identity.changes_since(earlier) })
}
