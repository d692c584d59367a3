//! The output folder: a result is under its final name only when all of them are complete.
//!
//! Every file is written as `NAME.partial` beside its place. When all are written, they are flushed to the
//! disk and renamed. A run that fails leaves what was there before, and nothing else.

use super::WriteError;
use crate::store::{PARTIAL, fail_point, sync_folder};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The report of a run, the last file to get its name: where it is, all results are there.
pub const REPORT: &str = "run.json";

/// Names of all files that a run may write, in the order in which they get their final names.
pub const OUTPUTS: [&str; 7] =
    ["grains.gpkg", "grains.csv", "grain_size.tif", "labelled_mesh.ply", "labelled_cloud.laz", "summary.json", REPORT];

/// Names of what may be written into the folder of a run about its results: scores, and a map of them. They go when the
/// results are replaced.
pub const SCORES: [&str; 2] = ["validation.json", "validation.png"];

/// What GDAL and SQLite may leave beside a file that they did not finish.
const SIDECARS: [&str; 6] = ["-journal", "-wal", "-shm", ".aux.xml", ".msk.ovr.tmp", ".ovr.tmp"];

/// A file that proves that the folder can be written to.
const PROBE: &str = ".gravelometer.partial";

/// A folder that exists and can be written to.
///
/// While it is held, no other run can hold it.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    made: bool,
    _lock: File,
}

impl OutputFolder {
    /// Makes the folder, with its parents, and proves that files can be written there. Nothing in it is
    /// changed. `ignoring` names entries that may be there anyhow, such as the folder of tile records;
    /// unfinished files of an interrupted run may be there too.
    ///
    /// # Errors
    /// The path is no folder or no text, or holds something and `force` is false, or cannot be written to,
    /// or another run writes to it.
    pub fn create(path: &Path, force: bool, ignoring: &[&str]) -> Result<OutputFolder, WriteError> {
        if path.to_str().is_none() {
            return Err(WriteError::NotText { path: path.to_owned() });
        }
        let made = !path.exists();
        if !made && !path.is_dir() {
            return Err(WriteError::NotAFolder { path: path.to_owned() });
        }
        let folder = |action| move |source| WriteError::Folder { path: path.to_owned(), action, source };
        fs::create_dir_all(path).map_err(folder("make the output folder"))?;
        let lock = File::open(path).map_err(folder("open the output folder"))?;
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(WriteError::Busy { path: path.to_owned() }),
            // A file system without locks: nothing can be told.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        if let Some(name) = OUTPUTS.into_iter().find(|name| path.join(name).is_dir()) {
            return Err(WriteError::FolderInTheWay { path: path.join(name) });
        }
        if !force {
            let (ours, others) = contents(path, ignoring).map_err(folder("list the output folder"))?;
            if !ours.is_empty() || others > 0 {
                return Err(WriteError::Occupied { path: path.to_owned(), ours, others });
            }
        }
        probe(path).map_err(folder("write to the output folder"))?;
        Ok(OutputFolder { path: path.to_owned(), made, _lock: lock })
    }

    /// Refuses inputs that a result would replace.
    ///
    /// # Errors
    /// The first input that is, under whatever name, a file that this folder's results are called.
    pub fn spare(&self, inputs: &[PathBuf]) -> Result<(), WriteError> {
        for input in inputs {
            let Ok(real) = input.canonicalize() else { continue };
            let names =
                OUTPUTS.into_iter().chain(SCORES).flat_map(|name| [name.to_owned(), format!("{name}.{PARTIAL}")]);
            for target in names.map(|name| self.path.join(name)) {
                if target.canonicalize().is_ok_and(|target| target == real) {
                    return Err(WriteError::InputInTheWay { input: input.clone(), target });
                }
            }
        }
        Ok(())
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Starts a file: its partial name is free. `name` is one of [`OUTPUTS`].
    pub(crate) fn begin(&self, name: &str) -> Result<Pending, WriteError> {
        let pending = Pending { partial: self.path.join(format!("{name}.{PARTIAL}")), target: self.path.join(name) };
        match fs::remove_file(&pending.partial) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                Err(WriteError::File { path: pending.partial.clone(), action: "replace the unfinished file", source })
            }
            _ => {
                pending.remove_sidecars();
                Ok(pending)
            }
        }
    }

    /// Gives all files, which lie on the disk, their final names, then removes results of an earlier run that
    /// this one did not write, since they would not belong to the others. The report, which comes last, goes first:
    /// where it is, what lies beside it belongs to it.
    pub(crate) fn publish(&self, pending: Vec<Pending>) -> Result<Vec<PathBuf>, WriteError> {
        fail_point("results.before_names");
        let report = self.path.join(REPORT);
        match fs::remove_file(&report) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                return Err(WriteError::File { path: report, action: "remove the report of an earlier run", source });
            }
            Err(_) => {}
            // On the disk, before anything else changes there.
            Ok(()) => self.sync()?,
        }
        let mut published = Vec::with_capacity(pending.len());
        for file in pending {
            let path = file.target.clone();
            fs::rename(&file.partial, &path).map_err(|source| WriteError::File {
                path: path.clone(),
                action: "give the finished file its name",
                source,
            })?;
            published.push(path);
            fail_point("results.between_names");
        }
        fail_point("results.before_removal");
        for name in OUTPUTS.into_iter().chain(SCORES) {
            let old = self.path.join(name);
            // What an interrupted run began to write.
            let _ = fs::remove_file(self.path.join(format!("{name}.{PARTIAL}")));
            if !published.contains(&old) && old.is_file() {
                fs::remove_file(&old).map_err(|source| WriteError::File {
                    path: old.clone(),
                    action: "remove the result of an earlier run",
                    source,
                })?;
            }
        }
        self.sync()?;
        Ok(published)
    }

    fn sync(&self) -> Result<(), WriteError> {
        sync_folder(&self.path).map_err(|source| WriteError::Folder {
            path: self.path.clone(),
            action: "flush the output folder to the disk",
            source,
        })
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if self.made {
            // Only an empty folder can be removed: one without results leaves no trace.
            let _ = fs::remove_dir(&self.path);
        }
    }
}

/// A file that is being written. Dropping it removes what there is of it.
#[derive(Debug)]
pub(crate) struct Pending {
    pub(crate) partial: PathBuf,
    pub(crate) target: PathBuf,
}

impl Pending {
    /// An error about this file, under the name that people know.
    pub(crate) fn error(&self, action: &'static str, source: io::Error) -> WriteError {
        WriteError::File { path: self.target.clone(), action, source }
    }

    /// Flushes the file to the disk.
    pub(crate) fn sync(&self) -> Result<(), WriteError> {
        let sync = || OpenOptions::new().write(true).open(&self.partial)?.sync_all();
        sync().map_err(|source| self.error("flush the file to the disk", source))
    }

    fn remove_sidecars(&self) {
        for suffix in SIDECARS {
            let mut name = self.partial.clone().into_os_string();
            name.push(suffix);
            // Nothing is lost if one stays: it belongs to an unfinished file.
            let _ = fs::remove_file(PathBuf::from(name));
        }
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        // After the rename there is nothing left under this name.
        let _ = fs::remove_file(&self.partial);
        self.remove_sidecars();
    }
}

/// Results that lie in a folder, and the number of other entries.
fn contents(path: &Path, ignoring: &[&str]) -> io::Result<(Vec<String>, usize)> {
    let (mut ours, mut others) = (Vec::new(), 0);
    for entry in fs::read_dir(path)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let unfinished = OUTPUTS.iter().any(|o| name.starts_with(&format!("{o}.{PARTIAL}")));
        if unfinished || name == PROBE || ignoring.contains(&name.as_str()) {
            continue;
        }
        if OUTPUTS.into_iter().chain(SCORES).any(|ours| ours == name) {
            ours.push(name);
        } else {
            others += 1;
        }
    }
    ours.sort_unstable();
    Ok((ours, others))
}

/// Writes and removes a small file, under a name that no result has.
fn probe(path: &Path) -> io::Result<()> {
    let name = path.join(PROBE);
    let write = || -> io::Result<()> {
        let mut file = File::create(&name)?;
        file.write_all(&[0; 4096])?;
        file.sync_all()
    };
    let written = write();
    let removed = fs::remove_file(&name);
    written.and(removed)
}
