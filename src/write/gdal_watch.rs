//! Nothing that GDAL reports is lost.
//!
//! GDAL before 3.7 closes a dataset without a result, and the crate does not look at errors that a call
//! reports and then survives. [`Watch`] asks for the noted failures after each step.

use super::WriteError;
use crate::open::{gdal_failures, listen_to_gdal};
use gdal::errors::GdalError;
use std::path::{Path, PathBuf};

/// Watches what GDAL does to one file, on this thread.
pub(crate) struct Watch {
    path: PathBuf,
}

impl Watch {
    /// Starts watching; `path` is the file's name in messages.
    pub(crate) fn new(path: &Path) -> Watch {
        listen_to_gdal();
        Watch { path: path.to_owned() }
    }

    /// The value of a step, unless it failed or anything failed within it.
    pub(crate) fn step<T>(&self, step: impl FnOnce() -> String, result: Result<T, GdalError>) -> Result<T, WriteError> {
        let failures: Vec<String> = gdal_failures().iter().map(|m| abridged(m)).collect();
        let message = match (failures.is_empty(), &result) {
            (true, Ok(_)) => return result.map_err(|e| self.failure(step(), e.to_string())),
            (true, Err(e)) => e.to_string(),
            (false, _) => failures.join("; "),
        };
        Err(self.failure(step(), message))
    }

    fn failure(&self, step: String, message: String) -> WriteError {
        WriteError::Gdal { path: self.path.clone(), step, message }
    }
}

/// GDAL quotes whole SQL statements and gives the reason at the end: the middle goes.
fn abridged(message: &str) -> String {
    const ENDS: usize = 90;
    let characters = message.chars().count();
    if characters <= 2 * ENDS + 10 {
        return message.to_owned();
    }
    let start: String = message.chars().take(ENDS).collect();
    let end: String = message.chars().skip(characters - ENDS).collect();
    format!("{start} [...] {end}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_that_a_call_survives_is_still_reported() {
        let watch = Watch::new(Path::new("grains.gpkg"));
        let opened = gdal::Dataset::open_ex(
            "/nowhere/at/all",
            gdal::DatasetOptions { open_flags: gdal::GdalOpenFlags::GDAL_OF_VERBOSE_ERROR, ..Default::default() },
        );
        assert!(opened.is_err());
        let error = watch.step(|| "a step".into(), Ok(())).expect_err("the noted failure").to_string();
        assert!(error.starts_with("grains.gpkg: a step failed: /nowhere/at/all"), "{error}");
        assert!(watch.step(|| "the next step".into(), Ok(())).is_ok());
    }

    #[test]
    fn a_long_message_keeps_its_reason() {
        let long = format!("sqlite3_exec(CREATE TABLE {}) failed: disk is full", "x".repeat(1000));
        let short = abridged(&long);
        assert!(short.starts_with("sqlite3_exec(CREATE TABLE") && short.ends_with("failed: disk is full"), "{short}");
        assert!(short.len() < 250);
    }
}
