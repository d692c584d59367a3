//! Opening a survey for a run: people hear how far it is, and what was found beside the files.

use crate::error::Error;
use crate::open::{Inputs, Reach, Warning};
use crate::progress::{Progress, Unit};
use crate::settings::InputSettings;
use std::sync::atomic::{AtomicU64, Ordering};

/// Opens a survey, and tells what was left out and where its place on the map came from.
///
/// # Errors
/// Those of [`Reach::open`].
pub fn open_survey(
    inputs: &Inputs,
    settings: &InputSettings,
    progress: &dyn Progress,
) -> Result<(Reach, Vec<Warning>), Error> {
    inputs.notes.iter().for_each(|note| progress.note(note));
    let bytes: u64 = inputs.paths.iter().filter_map(|p| std::fs::metadata(p).ok()).map(|m| m.len()).sum();
    progress.begin("open", bytes, Unit::Bytes);
    let told = AtomicU64::new(0);
    let opened = Reach::open(&inputs.paths, settings, &|done, _| {
        let before = told.fetch_max(done, Ordering::Relaxed);
        progress.advance(done.saturating_sub(before));
    });
    progress.end();
    let (reach, warnings) = opened?;
    reach.georeference().notes.iter().for_each(|note| progress.note(note));
    Ok((reach, warnings))
}
