//! The work folder: what a run keeps while it works, so that it can go on after a crash, and what a later run
//! on the same survey can use again.
//!
//! | in the folder | holds | depends on |
//! |---|---|---|
//! | `run` | identity of the run | inputs and every setting that changes a result |
//! | `index/` | the index | the inputs |
//! | `curvature/` | spacing and divergence, tile by tile | the inputs, `[curvature]` |
//! | `grains` | findings, tile by tile | all of it |
//!
//! Each part carries the identity of what it depends on. A part that does not fit is made anew, unless the run
//! is to be resumed: then a change is refused by name.

mod curvature;
mod findings;
mod identity;

pub use curvature::Curvature;
pub use findings::Findings;
pub use identity::Change;

use crate::error::Error;
use crate::index::{Index, IndexError};
use crate::open::Reach;
use crate::settings::Settings;
use crate::store::{Ledger, Shelf, StoreError};
use crate::tile::CoreSize;
use identity::Identity;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// Name of the work folder within OUT.
pub const WORK: &str = "gravelometer-work";
const RUN: &str = "run";
const INDEX: &str = "index";
const CURVATURE: &str = "curvature";
const GRAINS: &str = "grains";

/// Where a run keeps what it needs again.
#[derive(Debug)]
pub struct WorkFolder {
    shelf: Shelf,
    /// Whether it stays when the run is done.
    stays: bool,
    /// Held while the folder is: no other run can use it.
    _lock: File,
}

/// A work folder that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// Another run uses it.
    #[error("{} is used by another run\nhelp: wait for it, or name another folder with --work-dir", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// The interrupted run was another one.
    #[error(
        "the run in {} cannot be resumed, because it was another one:\n{}\nhelp: go back to what was, or leave out --resume to start over",
        path.display(),
        changes.iter().map(|c| format!("  {c}")).collect::<Vec<_>>().join("\n")
    )]
    Changed {
        /// The work folder.
        path: PathBuf,
        /// What changed.
        changes: Vec<Change>,
    },
}

impl WorkFolder {
    /// Makes and locks the work folder: the one that was named, which stays, or `OUT/gravelometer-work`, which goes when the
    /// run is done.
    ///
    /// # Errors
    /// It cannot be made, or another run uses it.
    pub fn open(named: Option<&Path>, out: &Path) -> Result<WorkFolder, Error> {
        let shelf = Shelf::new(&named.map_or_else(|| out.join(WORK), Path::to_owned))?;
        let path = shelf.folder().to_owned();
        let lock = File::open(&path).map_err(|source| StoreError::Io {
            path: path.clone(),
            action: "open the work folder",
            source,
        })?;
        if let Err(TryLockError::WouldBlock) = lock.try_lock() {
            return Err(ResumeError::Busy { path }.into());
        }
        Ok(WorkFolder { shelf, stays: named.is_some(), _lock: lock })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        self.shelf.folder()
    }

    /// Bytes that are free there; none where the system does not tell.
    pub fn free_bytes(&self) -> Option<u64> {
        self.shelf.free_bytes()
    }

    /// Says which run this is. With `resume`, an earlier one there must be the same.
    ///
    /// # Errors
    /// What is resumed was another run, or the disk says no.
    pub fn begin(&self, reach: &Reach, settings: &Settings, resume: bool) -> Result<(), Error> {
        let identity = of_grains(reach, settings);
        match self.shelf.get(RUN).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()) {
            Some(earlier) if resume => {
                let changes = identity.changes_since(&earlier);
                if !changes.is_empty() {
                    return Err(ResumeError::Changed { path: self.path().to_owned(), changes }.into());
                }
                return Ok(());
            }
            // What is not resumed must not be found later.
            _ => self.shelf.remove(GRAINS),
        }
        Ok(self.shelf.put(RUN, identity.text().as_bytes())?)
    }

    /// The index of the survey, if it is there.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn index(&self, reach: &Reach) -> Result<Option<Index>, Error> {
        Ok(Index::open(&self.shelf.inner(INDEX)?, &Identity::of_survey(reach).text()))
    }

    /// Makes the index of the survey and keeps it.
    ///
    /// # Errors
    /// As [`Index::build`].
    pub fn make_index(
        &self,
        reach: &Reach,
        build: impl FnOnce(&Shelf) -> Result<Index, IndexError>,
    ) -> Result<Index, Error> {
        let shelf = self.shelf.inner(INDEX)?;
        Index::forget(&shelf);
        let index = build(&shelf)?;
        index.keep(&shelf, &Identity::of_survey(reach).text())?;
        Ok(index)
    }

    /// Spacing and divergence, as far as they are there.
    ///
    /// # Errors
    /// The disk says no.
    pub fn curvature(&self, reach: &Reach, index: &Index, settings: &Settings) -> Result<Curvature, Error> {
        let identity = Identity::of_survey(reach).and_curvature(settings).text();
        Ok(Curvature::open(&self.shelf.inner(CURVATURE)?, &identity, index)?)
    }

    /// Findings of tiles, as far as they are there.
    ///
    /// # Errors
    /// The disk says no.
    pub fn findings(&self, reach: &Reach, settings: &Settings) -> Result<Findings, Error> {
        Ok(Findings::open(&self.shelf, GRAINS, &of_grains(reach, settings).text())?)
    }

    /// Clears up after a run that is done: all of it, or, if it was named, what no later run can use.
    pub fn finish(self) {
        self.shelf.remove(GRAINS);
        self.shelf.remove(RUN);
        if !self.stays {
            // Nothing is lost if some of it stays; what others put there does.
            let _ = std::fs::remove_dir_all(self.shelf.path(INDEX));
            let _ = std::fs::remove_dir_all(self.shelf.path(CURVATURE));
        }
    }
}

impl Drop for WorkFolder {
    fn drop(&mut self) {
        if !self.stays {
            // Only an empty folder can be removed: a run that kept nothing leaves no trace.
            let _ = std::fs::remove_dir(self.shelf.folder());
        }
    }
}

/// The size of cores that a ledger has under `key`, or `size`, which is then recorded: tiles that are done are
/// tiles of that size.
fn recorded_core(ledger: &mut Ledger, key: u64, size: CoreSize) -> Result<CoreSize, StoreError> {
    if let Some(position) = ledger.position(key)
        && let Ok([a, b, c, d, e, f, g, h]) = <[u8; 8]>::try_from(ledger.read(position)?.payload)
    {
        let (columns, rows) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
        return Ok(CoreSize { columns, rows });
    }
    ledger.append(key, &[size.columns.to_le_bytes(), size.rows.to_le_bytes()].concat())?;
    Ok(size)
}

fn of_grains(reach: &Reach, settings: &Settings) -> Identity {
    let outline_step_m = reach.frame().outline_step_m();
    Identity::of_survey(reach).and_curvature(settings).and_grains(settings, outline_step_m)
}
