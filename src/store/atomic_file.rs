//! A small file that is either the old one or the new one, whatever happens while it is written.

use super::StoreError;
use super::fail_point::fail_point;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Suffix of a file that is being written.
pub const PARTIAL: &str = "partial";

/// Replaces the file at `path`, or makes it. The bytes lie on the disk when this returns.
///
/// They are written as `NAME.partial` beside it, flushed, and renamed. A crash can leave that file, and the
/// next call replaces it. Two processes must not write the same path at once. Of a link it is the file behind it that is
/// replaced; a device or a pipe is written to.
///
/// # Errors
/// The folder is not there or cannot be written to, or the disk is full. The old file is then untouched.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let behind = if path.is_symlink() { path.canonicalize().ok() } else { None };
    let path = behind.as_deref().unwrap_or(path);
    if path.exists() && !path.is_file() && !path.is_dir() {
        return fs::write(path, bytes).map_err(|source| StoreError::io(path, "write to it", source));
    }
    let partial = partial_name(path);
    write_and_sync(&partial, bytes)
        .and_then(|()| {
            fail_point("atomic_file.before_rename");
            fs::rename(&partial, path).map_err(|source| StoreError::io(path, "give the finished file its name", source))
        })
        .inspect_err(|_| {
            // On a full disk, half a file would only be in the way.
            let _ = fs::remove_file(&partial);
        })?;
    fail_point("atomic_file.after_rename");
    let folder = folder_of(path);
    sync_folder(folder).map_err(|source| StoreError::io(folder, "flush the folder to the disk", source))
}

/// Flushes the entries of a folder, so that a rename in it survives a power cut.
///
/// # Errors
/// What the system says. Where folders cannot be flushed, nothing is done.
pub fn sync_folder(path: &Path) -> io::Result<()> {
    if cfg!(unix) { File::open(path)?.sync_all() } else { Ok(()) }
}

fn write_and_sync(partial: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let failed = |action| move |source| StoreError::io(partial, action, source);
    fail_point("atomic_file.before_write");
    let mut file = File::create(partial).map_err(failed("create the file"))?;
    file.write_all(bytes).map_err(failed("write the file"))?;
    fail_point("atomic_file.after_write");
    file.sync_all().map_err(failed("flush the file to the disk"))
}

fn partial_name(path: &Path) -> PathBuf {
    let mut name = path.to_owned().into_os_string();
    name.push(".");
    name.push(PARTIAL);
    PathBuf::from(name)
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_made_and_replaced_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("manifest.json");
        fs::write(partial_name(&path), "half of an interrupted one, longer than the next").unwrap();
        for text in ["first", "second, longer", ""] {
            write_atomically(&path, text.as_bytes()).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        }
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_plain_file_is_not_replaced_by_one() {
        use std::os::unix::fs::{FileTypeExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("real"), "old").unwrap();
        symlink(at("real"), at("link")).unwrap();
        write_atomically(&at("link"), b"new").unwrap();
        assert!(at("link").is_symlink());
        assert_eq!(fs::read_to_string(at("real")).unwrap(), "new");
        let _listener = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
        let error = write_atomically(&at("socket"), b"new").unwrap_err().to_string();
        assert!(error.contains("socket: cannot write to it: "), "{error}");
        assert!(fs::metadata(at("socket")).unwrap().file_type().is_socket());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    #[test]
    fn a_file_that_cannot_be_written_names_itself_and_leaves_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let error = write_atomically(&folder.path().join("none/manifest.json"), b"x").unwrap_err().to_string();
        assert!(error.contains("none/manifest.json.partial: cannot create the file: "), "{error}");
        assert!(error.contains("\nhelp: "), "{error}");
        let occupied = folder.path().join("occupied");
        fs::create_dir_all(occupied.join("by a folder")).unwrap();
        let error = write_atomically(&occupied, b"x").unwrap_err().to_string();
        assert!(error.contains("occupied: cannot give the finished file its name: "), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "the unfinished file is gone");
    }

    #[test]
    fn a_bare_name_lies_in_the_working_folder() {
        assert_eq!(folder_of(Path::new("manifest.json")), Path::new("."));
        assert_eq!(folder_of(Path::new("a/manifest.json")), Path::new("a"));
        assert_eq!(partial_name(Path::new("a/b.c")), Path::new("a/b.c.partial"));
    }
}
