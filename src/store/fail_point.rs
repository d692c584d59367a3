//! Places where a test can end the process as a power cut would: between two steps of a commit.

use std::process::Command;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Environment variable that names where the process ends: `NAME`, or `NAME:N` for the N-th visit, from 1.
pub const KILL_AT: &str = "GRAVELOMETER_KILL_AT";

/// Every name that [`fail_point`] is called with.
pub const FAIL_POINTS: [&str; 15] = [
    "ledger.before_write",
    "ledger.after_write",
    "ledger.after_sync",
    "atomic_file.before_write",
    "atomic_file.after_write",
    "atomic_file.before_rename",
    "atomic_file.after_rename",
    "index.before_manifest",
    "curvature.before_record",
    "results.before_sync",
    "results.before_names",
    "results.between_names",
    "results.before_removal",
    "work_folder.before_removal",
    "work_folder.before_last_removal",
];

/// Environment variable that names a part of the work that panics, `PASS:NUMBER`.
pub const PANIC_AT: &str = "GRAVELOMETER_PANIC_AT";

/// Panics if the environment names this part of the work. A build without debug assertions does nothing here.
///
/// # Panics
/// As it is asked to.
#[inline]
pub fn panic_point(pass: &str, number: u64) {
    if cfg!(debug_assertions) {
        let asked = std::env::var(PANIC_AT).is_ok_and(|text| text == format!("{pass}:{number}"));
        assert!(!asked, "{PANIC_AT} asks for it");
    }
}

/// Ends the process at once, without cleaning up, if the environment says so. A build without debug
/// assertions does nothing here.
///
/// # Panics
/// In a build with debug assertions, when `name` or the variable names no place in [`FAIL_POINTS`]: a test
/// that waits for a place that nobody visits would pass for nothing.
#[inline]
pub fn fail_point(name: &str) {
    if cfg!(debug_assertions) {
        visit(name);
    }
}

/// Where to end, and how often that place was visited.
struct Kill {
    name: String,
    at_visit: u64,
    visits: AtomicU64,
}

impl Kill {
    fn parse(text: &str) -> Kill {
        let (name, at_visit) = match text.split_once(':') {
            Some((name, number)) => (name, number.parse().ok()),
            None => (text, Some(1)),
        };
        assert!(FAIL_POINTS.contains(&name), "{KILL_AT}={text}: the names are {FAIL_POINTS:?}");
        let at_visit = at_visit.filter(|&n| n > 0);
        let Some(at_visit) = at_visit else { panic!("{KILL_AT}={text}: what follows the colon is no count from 1") };
        Kill { name: name.to_owned(), at_visit, visits: AtomicU64::new(0) }
    }

    fn is_due(&self, name: &str) -> bool {
        name == self.name && self.visits.fetch_add(1, Ordering::Relaxed) + 1 == self.at_visit
    }
}

fn visit(name: &str) {
    static KILL: OnceLock<Option<Kill>> = OnceLock::new();
    assert!(FAIL_POINTS.contains(&name), "{name} is missing in FAIL_POINTS");
    let kill =
        KILL.get_or_init(|| std::env::var(KILL_AT).ok().filter(|text| !text.is_empty()).map(|text| Kill::parse(&text)));
    if kill.as_ref().is_some_and(|kill| kill.is_due(name)) {
        die();
    }
}

fn die() -> ! {
    if cfg!(unix) {
        // A signal that nothing can catch; where there is no such program, abort comes near.
        let _ = Command::new("sh").args(["-c", &format!("kill -9 {}", std::process::id())]).status();
    }
    std::process::abort()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_due_at_the_named_visit_only() {
        let third = Kill::parse("ledger.after_write:3");
        let due: Vec<bool> = (0..5).map(|_| third.is_due("ledger.after_write")).collect();
        assert_eq!(due, [false, false, true, false, false]);
        let first = Kill::parse("ledger.after_sync");
        assert!(!first.is_due("ledger.after_write"));
        assert!(first.is_due("ledger.after_sync"));
    }

    #[test]
    fn a_place_that_does_not_exist_is_refused() {
        for text in ["ledger.never", "ledger.after_write:0", "ledger.after_write:twice", "ledger"] {
            assert!(std::panic::catch_unwind(|| Kill::parse(text)).is_err(), "{text}");
        }
    }

    #[test]
    fn no_name_is_listed_twice() {
        for (i, name) in FAIL_POINTS.iter().enumerate() {
            assert!(!FAIL_POINTS[..i].contains(name), "{name}");
        }
    }
}
