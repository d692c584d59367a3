//! Record files after a crash: a process that is killed at any point of a commit, and a disk that fills up.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use gravelometer::store::{Column, KILL_AT, Ledger, StoreError, write_atomically};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};
use support::small_disk::SmallDisk;

/// Where the child works: this binary again, running `keep_records` only.
const FOLDER: &str = "GRAVELOMETER_TEST_RECORDS";
const IDENTITY: &str = "{\"input\":\"a bed\"}";
const RECORDS: u64 = 6;

fn payload(key: u64) -> Vec<u8> {
    (0..1000 + 7000 * key).map(|i| (i * (key + 3)) as u8).collect()
}

fn manifest(key: u64) -> String {
    format!("{key} records, {}", "and so on; ".repeat(40 * key as usize))
}

/// Adds what is missing, and says in the manifest how many records there are, after each.
fn keep_records(folder: &Path) -> Result<(), StoreError> {
    let (mut ledger, _) = Ledger::open(&folder.join("tiles.ledger"), IDENTITY)?;
    for key in 0..RECORDS {
        ledger.append(key, &payload(key))?;
        ledger.sync()?;
        write_atomically(&folder.join("manifest"), manifest(key + 1).as_bytes())?;
    }
    Ok(())
}

#[test]
fn a_child_keeps_records_where_it_is_told() {
    if let Some(folder) = std::env::var_os(FOLDER) {
        keep_records(&PathBuf::from(folder)).unwrap();
    }
}

/// Runs the child; whether it came to its end.
fn child(folder: &Path, kill_at: &str) -> bool {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "a_child_keeps_records_where_it_is_told"])
        .env(FOLDER, folder)
        .env(KILL_AT, kill_at)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    assert!(!text.contains("panicked"), "{text}");
    output.status.success()
}

/// Number of records there are, all of them right; the manifest is whole and tells of no record too many.
fn recorded(folder: &Path) -> u64 {
    let path = folder.join("tiles.ledger");
    let found = match path.exists() {
        true => {
            let (ledger, entries) = Ledger::open(&path, IDENTITY).unwrap();
            for (entry, key) in entries.iter().zip(0..) {
                let record = ledger.read(entry.position).unwrap();
                assert!(record.key == key && record.payload == payload(key), "record {key}");
            }
            entries.len() as u64
        }
        false => 0,
    };
    if let Ok(text) = std::fs::read_to_string(folder.join("manifest")) {
        assert!((1..=found).any(|n| text == manifest(n)), "{found} records, but the manifest says: {text}");
    }
    found
}

/// Held by tests that start children: for a moment a child shares what is open here, locks as well.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Places in the commit of a record or of a small file.
fn record_points() -> impl Iterator<Item = &'static str> {
    let ours = |name: &&str| name.starts_with("ledger.") || name.starts_with("atomic_file.");
    gravelometer::store::FAIL_POINTS.into_iter().filter(ours)
}

#[cfg(debug_assertions)]
#[test]
fn a_kill_at_every_commit_point_leaves_whole_records_and_the_next_run_completes_them() {
    let _alone = alone();
    for name in record_points() {
        for visit in 1..=RECORDS {
            let folder = tempfile::tempdir().unwrap();
            let kill_at = format!("{name}:{visit}");
            assert!(!child(folder.path(), &kill_at), "{kill_at}: the child was not killed");
            let least = match name {
                "ledger.before_write" => visit - 1,
                "ledger.after_write" | "ledger.after_sync" => visit,
                // The first file that is written so is the ledger's header.
                _ => visit - 1,
            };
            assert_eq!(recorded(folder.path()), least, "{kill_at}");
            assert!(child(folder.path(), ""), "{kill_at}: the second run");
            assert_eq!(recorded(folder.path()), RECORDS);
        }
    }
}

#[cfg(not(debug_assertions))]
#[test]
fn a_release_build_knows_no_fail_points() {
    let _alone = alone();
    for name in record_points() {
        let folder = tempfile::tempdir().unwrap();
        assert!(child(folder.path(), name), "{name}");
        assert_eq!(recorded(folder.path()), RECORDS);
    }
}

#[cfg(unix)]
#[test]
fn a_process_killed_from_outside_at_any_time_leaves_whole_records() {
    let _alone = alone();
    for delay_us in (0..40u64).map(|i| i * i * 25) {
        let folder = tempfile::tempdir().unwrap();
        let mut running = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "a_child_keeps_records_where_it_is_told"])
            .env(FOLDER, folder.path())
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_micros(delay_us));
        let _ = running.kill();
        running.wait().unwrap();
        let before = recorded(folder.path());
        assert!(before <= RECORDS);
        keep_records(folder.path()).unwrap();
        assert_eq!(recorded(folder.path()), RECORDS, "{before} before");
    }
}

#[test]
fn a_full_disk_is_called_so_and_what_was_recorded_stays() {
    let _alone = alone();
    let mut refused = 0;
    for kibibytes in (8..120).step_by(8) {
        let Some(disk) = SmallDisk::new(kibibytes) else {
            println!("skipped: this user cannot mount a small disk");
            return;
        };
        match keep_records(disk.path()) {
            Err(error) => {
                assert!(matches!(error, StoreError::Full { .. }), "{kibibytes} KiB: {error}");
                assert!(error.to_string().contains("\nhelp: free some space"), "{error}");
                assert!(recorded(disk.path()) < RECORDS, "{kibibytes} KiB");
                refused += 1;
            }
            Ok(()) => panic!("{kibibytes} KiB took everything"),
        }
    }
    assert!(refused > 5, "only {refused} disks were tried");
    let disk = SmallDisk::new(1024).unwrap();
    keep_records(disk.path()).unwrap();
    assert_eq!(recorded(disk.path()), RECORDS);
}

#[test]
fn a_column_on_a_full_disk_is_called_so() {
    let _alone = alone();
    let Some(disk) = SmallDisk::new(64) else {
        println!("skipped: this user cannot mount a small disk");
        return;
    };
    let written = Column::create(&disk.path().join("positions"), 10_000)
        .and_then(|column| column.write(0, vec![[1.0f64, 2.0, 3.0]; 10_000]));
    assert!(matches!(written, Err(StoreError::Full { .. })), "{written:?}");
}
