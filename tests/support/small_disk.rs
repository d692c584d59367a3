//! A disk that is soon full.

use std::path::Path;
use std::process::Command;

/// A disk of some size, gone when dropped.
pub struct SmallDisk(tempfile::TempDir);

impl SmallDisk {
    /// None where this user cannot mount one.
    pub fn new(kibibytes: u32) -> Option<SmallDisk> {
        let folder = tempfile::tempdir().expect("temporary folder");
        let option = format!("size={kibibytes}k");
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &option, "tmpfs"]).arg(folder.path()).output();
        mounted.is_ok_and(|o| o.status.success()).then_some(SmallDisk(folder))
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0.path()).status();
    }
}
