//! The work folder: what a run keeps while it works, so that it can go on after a crash, and what a later run
//! on the same survey can use again.
//!
//! | in the folder | holds | depends on |
//! |---|---|---|
//! | `gravelometer-work.lock` | nothing: it marks the folder as ours, and the run that uses it locks it | |
//! | `index/` | the index, and what welding the files gave | the inputs, `input.weld_m` if they are several |
//! | `curvature/` | spacing and divergence, tile by tile | the inputs, `[curvature]` |
//! | `grains` | findings, tile by tile | the inputs and every setting that changes a result |
//!
//! Each part carries the identity of what it depends on. A part that does not fit is made anew, unless the run
//! is to be resumed: then a change is refused by name. A folder with other files in it and without the mark is
//! never used, so nothing in it can be lost.

mod curvature;
mod findings;
mod finished;
mod identity;

pub use curvature::Curvature;
pub use findings::Findings;
pub use finished::{changes_since_finished, whole_identity};
pub use identity::Change;

use crate::error::Error;
use crate::index::{Index, IndexError};
use crate::open::Reach;
use crate::settings::Settings;
use crate::store::{Ledger, Shelf, StoreError, fail_point};
use crate::tile::CoreSize;
use crate::triangulate::DrapeFigures;
use crate::weld::WeldFacts;
use identity::Identity;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Name of the work folder within OUT.
pub const WORK: &str = "gravelometer-work";
const MARK: &str = "gravelometer-work.lock";
const INDEX: &str = "index";
const CURVATURE: &str = "curvature";
/// What became of the points of a cloud, in the folder of its index.
const FIGURES: &str = "surface.json";
/// What welding the files gave, likewise.
const WELD: &str = "weld.json";
const GRAINS: &str = "grains";

/// Where a run keeps what it needs again.
#[derive(Debug)]
pub struct WorkFolder {
    shelf: Shelf,
    /// Whether it stays when the run is done.
    stays: bool,
    /// Whether what is in it belongs to this run, which may then clear it up.
    ours: bool,
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
    /// Results and what is kept for later runs would lie in one folder.
    #[error("{}: is the folder of the results, which cannot be the work folder as well\nhelp: leave out --work-dir, or name a folder of its own, such as {}", path.display(), path.join(WORK).display())]
    OutItself {
        /// The folder.
        path: PathBuf,
    },
    /// Something else has the name of the work folder.
    #[error("{}: is not a folder, so nothing can be kept in it\nhelp: name a folder with --work-dir", path.display())]
    NotAFolder {
        /// The path.
        path: PathBuf,
    },
    /// The folder was not made for this and is not empty.
    #[error(
        "{}: holds other files, such as {found:?}, so it is not used as work folder\nhelp: name a new or empty folder with --work-dir",
        path.display()
    )]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// Something in it.
        found: String,
    },
    /// There is nothing to resume, and the results that are there are those of another run.
    #[error(
        "the run in {} is done, and was another one:\n{}\nhelp: give --force to replace its results, or go back to what was",
        path.display(),
        listed(changes)
    )]
    Finished {
        /// The folder of the results.
        path: PathBuf,
        /// What changed.
        changes: Vec<Change>,
    },
    /// The interrupted run was another one.
    #[error(
        "the run in {} cannot be resumed, because it was another one:\n{}\nhelp: go back to what was, or leave out --resume to start over",
        path.display(),
        listed(changes)
    )]
    Changed {
        /// The work folder.
        path: PathBuf,
        /// What changed.
        changes: Vec<Change>,
    },
}

fn listed(changes: &[Change]) -> String {
    changes.iter().map(|c| format!("  {c}")).collect::<Vec<_>>().join("\n")
}

impl WorkFolder {
    /// Makes and locks the work folder: the one that was named, which stays, or `OUT/gravelometer-work`, which goes
    /// when the run is done.
    ///
    /// # Errors
    /// It cannot be made, or another run uses it, or it is somebody else's.
    pub fn open(named: Option<&Path>, out: &Path) -> Result<WorkFolder, Error> {
        let path = place(named, out);
        if out.canonicalize().is_ok_and(|out| path.canonicalize().is_ok_and(|path| path == out)) {
            return Err(ResumeError::OutItself { path }.into());
        }
        let made = !path.exists();
        if !made && !path.is_dir() {
            return Err(ResumeError::NotAFolder { path }.into());
        }
        let shelf = Shelf::new(&path)?;
        if !shelf.has(MARK)
            && let Some(found) = shelf.anything()?
        {
            return Err(ResumeError::Foreign { path, found }.into());
        }
        match shelf.lock(MARK)? {
            Some(lock) => Ok(WorkFolder { shelf, stays: named.is_some(), ours: made, _lock: lock }),
            None => Err(ResumeError::Busy { path }.into()),
        }
    }

    /// Whether there is a run that can be resumed.
    pub fn holds_run(named: Option<&Path>, out: &Path) -> bool {
        let path = place(named, out);
        path.join(MARK).exists() && path.join(GRAINS).exists()
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        self.shelf.folder()
    }

    /// Bytes that are free there; none where the system does not tell.
    pub fn free_bytes(&self) -> Option<u64> {
        self.shelf.free_bytes()
    }

    /// Says which run this is, and gives the findings of tiles, as far as they are there. With `resume`, an earlier
    /// run there must be the same; otherwise its findings go.
    ///
    /// # Errors
    /// What is resumed was another run, or the disk says no.
    pub fn begin(&mut self, reach: &Reach, settings: &Settings, resume: bool) -> Result<Findings, Error> {
        let outline_step_m = reach.frame().outline_step_m();
        let identity = Identity::of_survey(reach, settings).and_grains(settings, outline_step_m);
        if !resume {
            // What is not resumed must not be found later.
            self.shelf.remove(GRAINS);
        }
        match Findings::open(&self.shelf, GRAINS, &identity.text()) {
            Ok(findings) => {
                self.ours = true;
                Ok(findings)
            }
            Err(StoreError::OtherIdentity { recorded, .. }) => {
                let changes = identity.changes_since(&recorded);
                Err(ResumeError::Changed { path: self.path().to_owned(), changes }.into())
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The index of the survey, if it is there.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn index(&self, reach: &Reach, settings: &Settings) -> Result<Option<Index>, Error> {
        Ok(Index::open(&self.shelf.inner(INDEX)?, &Identity::of_survey(reach, settings).text()))
    }

    /// Where the surface of a cloud is made.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn surface_shelf(&self) -> Result<Shelf, StoreError> {
        self.shelf.inner(INDEX)
    }

    /// Notes what became of the points of a cloud, if it was one, for runs that use its index again.
    ///
    /// # Errors
    /// The disk says no.
    pub fn note_figures(&self, figures: Option<&DrapeFigures>) -> Result<(), StoreError> {
        self.note(FIGURES, figures)
    }

    /// What became of the points of the cloud that was indexed.
    pub fn figures(&self) -> Option<DrapeFigures> {
        let noted = self.shelf.inner(INDEX).ok()?.get(FIGURES)?;
        serde_json::from_slice(&noted).ok()
    }

    /// Notes what welding the files gave, for runs that use the index again.
    ///
    /// # Errors
    /// The disk says no.
    pub fn note_weld(&self, facts: Option<&WeldFacts>) -> Result<(), StoreError> {
        self.note(WELD, facts)
    }

    /// Puts a note beside the index, or takes away that of another survey.
    fn note(&self, name: &str, note: Option<&impl serde::Serialize>) -> Result<(), StoreError> {
        let shelf = self.shelf.inner(INDEX)?;
        match note {
            Some(note) => shelf.put(name, serde_json::json!(note).to_string().as_bytes()),
            None => {
                shelf.remove(name);
                Ok(())
            }
        }
    }

    /// What welding the files gave that were indexed; none of a single file.
    pub fn weld_facts(&self) -> Option<WeldFacts> {
        serde_json::from_slice(&self.shelf.inner(INDEX).ok()?.get(WELD)?).ok()?
    }

    /// Makes the index of the survey.
    ///
    /// # Errors
    /// As [`Index::build`].
    pub fn make_index(&self, build: impl FnOnce(&Shelf) -> Result<Index, IndexError>) -> Result<Index, Error> {
        let shelf = self.shelf.inner(INDEX)?;
        Index::forget(&shelf);
        Ok(build(&shelf)?)
    }

    /// Waits until the disk has the index, from where on a later run finds it.
    ///
    /// # Errors
    /// The disk says no.
    pub fn keep_index(&self, reach: &Reach, settings: &Settings, index: &Index) -> Result<(), StoreError> {
        let keep = |shelf: &Shelf| index.keep(shelf, &Identity::of_survey(reach, settings).text());
        self.shelf.inner(INDEX).and_then(|shelf| keep(&shelf))
    }

    /// Makes room on a disk that could not keep an index: nothing that depends on it is worth keeping either.
    pub fn give_up_index(&self) {
        self.remove(CURVATURE);
        self.remove(INDEX);
    }

    /// Spacing and divergence, as far as they are there.
    ///
    /// # Errors
    /// The disk says no.
    pub fn curvature(&self, reach: &Reach, index: &Index, settings: &Settings) -> Result<Curvature, Error> {
        let identity = Identity::of_survey(reach, settings).and_curvature(settings).text();
        Ok(Curvature::open(&self.shelf.inner(CURVATURE)?, &identity, index)?)
    }

    /// Clears up after a run that is done: all of it, or, if it was named, what no later run can use.
    pub fn finish(mut self) {
        fail_point("work_folder.before_removal");
        if !self.stays {
            self.remove(CURVATURE);
            self.remove(INDEX);
        }
        fail_point("work_folder.before_last_removal");
        // Last: as long as it is there, the run can be resumed.
        self.shelf.remove(GRAINS);
        if !self.stays {
            self.remove_itself();
        }
        self.ours = false;
    }

    /// Removes a part that nobody needs. Nothing is lost if some of it stays.
    fn remove(&self, part: &str) {
        let _ = std::fs::remove_dir_all(self.shelf.path(part));
    }

    /// Removes the folder, unless others put something there.
    fn remove_itself(&self) {
        self.shelf.remove(MARK);
        let _ = std::fs::remove_dir(self.shelf.folder());
    }
}

impl Drop for WorkFolder {
    /// A run that ends before it has kept anything leaves nothing behind. Curvature is only there when an index
    /// was, and outlives one that is made again.
    fn drop(&mut self) {
        if !self.ours || Index::is_kept_in(&self.shelf.path(INDEX)) || self.shelf.has(CURVATURE) {
            return;
        }
        self.remove(INDEX);
        self.shelf.remove(GRAINS);
        if !self.stays {
            self.remove_itself();
        }
    }
}

fn place(named: Option<&Path>, out: &Path) -> PathBuf {
    named.map_or_else(|| out.join(WORK), Path::to_owned)
}

/// The size of cores that a ledger has under `key`: tiles that are done are tiles of that size.
fn recorded_core(ledger: &Ledger, key: u64) -> Result<Option<CoreSize>, StoreError> {
    let Some(position) = ledger.position(key) else { return Ok(None) };
    let Ok([a, b, c, d, e, f, g, h]) = <[u8; 8]>::try_from(ledger.read(position)?.payload) else { return Ok(None) };
    let (columns, rows) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
    Ok(Some(CoreSize { columns, rows }))
}

fn record_core(ledger: &mut Ledger, key: u64, size: CoreSize) -> Result<(), StoreError> {
    ledger.append(key, &[size.columns.to_le_bytes(), size.rows.to_le_bytes()].concat()).map(|_| ())
}
