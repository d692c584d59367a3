//! Reads and writes at places that the caller names, from several threads at once.
//!
//! No memory maps: the system counts mapped pages as memory of the process.

use std::fs::File;
use std::io;

/// An open file without a place of its own.
#[derive(Debug)]
pub(super) struct Positioned {
    file: File,
    #[cfg(not(unix))]
    turn: std::sync::Mutex<()>,
}

impl Positioned {
    pub(super) fn new(file: File) -> Positioned {
        Positioned {
            file,
            #[cfg(not(unix))]
            turn: std::sync::Mutex::default(),
        }
    }

    pub(super) fn file(&self) -> &File {
        &self.file
    }

    #[cfg(unix)]
    pub(super) fn read_exact_at(&self, bytes: &mut [u8], position: u64) -> io::Result<()> {
        std::os::unix::fs::FileExt::read_exact_at(&self.file, bytes, position)
    }

    #[cfg(unix)]
    pub(super) fn write_all_at(&self, bytes: &[u8], position: u64) -> io::Result<()> {
        std::os::unix::fs::FileExt::write_all_at(&self.file, bytes, position)
    }

    #[cfg(not(unix))]
    pub(super) fn read_exact_at(&self, bytes: &mut [u8], position: u64) -> io::Result<()> {
        by_turns::read_exact_at(&self.file, &self.turn, bytes, position)
    }

    #[cfg(not(unix))]
    pub(super) fn write_all_at(&self, bytes: &[u8], position: u64) -> io::Result<()> {
        by_turns::write_all_at(&self.file, &self.turn, bytes, position)
    }
}

/// For systems where a file has one place only, which all threads share.
#[cfg(any(not(unix), test))]
mod by_turns {
    use std::fs::File;
    use std::io::{self, Read, Seek, SeekFrom, Write};
    use std::sync::{Mutex, PoisonError};

    pub(super) fn read_exact_at(mut file: &File, turn: &Mutex<()>, bytes: &mut [u8], position: u64) -> io::Result<()> {
        let _mine = turn.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(position))?;
        file.read_exact(bytes)
    }

    pub(super) fn write_all_at(mut file: &File, turn: &Mutex<()>, bytes: &[u8], position: u64) -> io::Result<()> {
        let _mine = turn.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(position))?;
        file.write_all(bytes)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn reads_and_writes_by_turns_equal_those_at_positions() {
        let file = Positioned::new(tempfile::tempfile().unwrap());
        let turn = Mutex::default();
        std::thread::scope(|scope| {
            for thread in 0..4u8 {
                let (file, turn) = (&file, &turn);
                scope.spawn(move || {
                    for i in (u64::from(thread)..400).step_by(4) {
                        by_turns::write_all_at(file.file(), turn, &[i as u8, thread, 7], 3 * i).unwrap();
                    }
                });
            }
        });
        for i in 0..400 {
            let (mut turned, mut placed) = ([0; 3], [0; 3]);
            by_turns::read_exact_at(file.file(), &turn, &mut turned, 3 * i).unwrap();
            file.read_exact_at(&mut placed, 3 * i).unwrap();
            assert_eq!((turned, placed), ([i as u8, (i % 4) as u8, 7], turned));
        }
        assert!(by_turns::read_exact_at(file.file(), &turn, &mut [0; 4], 1197).is_err());
    }
}
