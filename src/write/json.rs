//! `summary.json` and `run.json`.

use super::columns::COLUMNS;
use super::{Results, WriteError, atomic::Pending};
use crate::statistics::Summary;
use serde::Serialize;
use serde_json::json;
use std::fs::File;
use std::io::{self, BufWriter, Write};

/// The statistics of the survey.
pub(crate) fn write_summary(file: &Pending, summary: &Summary) -> Result<(), WriteError> {
    write(file, summary)
}

/// What was run: program, version, settings, columns, and the facts that the run hands over.
///
/// The costs are those known before this file is written, the last: of the stage `write` all but its end.
pub(crate) fn write_run(file: &Pending, results: &Results, names: &[&str]) -> Result<(), WriteError> {
    let mut report = json!({
        "program": env!("CARGO_PKG_NAME"),
        "version": env!("CARGO_PKG_VERSION"),
        "settings": results.settings,
        "facts": results.facts,
        "outputs": names,
        "grain_columns": COLUMNS,
    });
    if let (Some(report), serde_json::Value::Object(costs)) = (report.as_object_mut(), (results.costs)()) {
        report.extend(costs);
    }
    write(file, &report)
}

fn write(file: &Pending, value: &impl Serialize) -> Result<(), WriteError> {
    let write = || -> io::Result<()> {
        let mut out = BufWriter::new(File::create(&file.partial)?);
        serde_json::to_writer_pretty(&mut out, value)?;
        out.write_all(b"\n")?;
        out.flush()
    };
    write().map_err(|source| file.error("write the report", source))
}
