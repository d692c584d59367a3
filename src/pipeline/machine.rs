//! What the machine has, and what this process has taken of it so far.

use std::fs;
use std::path::Path;

/// Memory that this process can still take: what the system has available, or the limit of its control
/// group where that is lower. None on systems without `/proc`.
pub fn memory_there_bytes() -> Option<u64> {
    let available = fs::read_to_string("/proc/meminfo").ok().and_then(|text| kibibytes(&text, "MemAvailable:"));
    let limit = fs::read_to_string("/proc/self/cgroup").ok().and_then(|text| group_limit_bytes(&text));
    available.into_iter().chain(limit).min()
}

/// The bytes of a line such as `MemAvailable:   20000000 kB`.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|l| l.strip_prefix(name))?;
    line.split_ascii_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// CPU seconds that this process has used: user and system, all threads, those that ended included. None
/// on systems without `/proc`. Counted in hundredths of a second, which is enough for a stage of a survey.
pub fn cpu_seconds() -> Option<f64> {
    fs::read_to_string("/proc/self/stat").ok().and_then(|text| stat_seconds(&text))
}

/// Most memory that this process ever had resident, mapped parts of input files included. None on systems
/// without `/proc`.
pub fn peak_memory_bytes() -> Option<u64> {
    fs::read_to_string("/proc/self/status").ok().and_then(|text| kibibytes(&text, "VmHWM:"))
}

/// Linux tells times to programs in this unit on every architecture that Rust is built for, whatever the
/// kernel's own tick (proc_pid_stat(5), `sysconf(_SC_CLK_TCK)`).
const TICKS_A_SECOND: f64 = 100.0;

/// Fields 14 and 15, `utime` and `stime`. The second, the program's name, may hold spaces and parentheses.
fn stat_seconds(stat: &str) -> Option<f64> {
    let mut from_third = stat.rsplit_once(')')?.1.split_ascii_whitespace();
    let user: u64 = from_third.nth(11)?.parse().ok()?;
    let system: u64 = from_third.next()?.parse().ok()?;
    Some((user + system) as f64 / TICKS_A_SECOND)
}

/// The lowest limit of the process's group and those above it, of version 2, else of version 1.
fn group_limit_bytes(groups: &str) -> Option<u64> {
    let (root, file, group) = groups.lines().find_map(|line| {
        let (_, rest) = line.split_once(':')?;
        let (controllers, group) = rest.split_once(':')?;
        match controllers {
            "" => Some(("/sys/fs/cgroup", "memory.max", group)),
            c if c.split(',').any(|c| c == "memory") => Some(("/sys/fs/cgroup/memory", "memory.limit_in_bytes", group)),
            _ => None,
        }
    })?;
    let path = Path::new(root).join(group.trim_start_matches('/'));
    // Within a container the group's own path may be hidden, but the root then shows the container's limit.
    path.ancestors()
        .take_while(|p| p.starts_with(root))
        .filter_map(|p| fs::read_to_string(p.join(file)).ok())
        .filter_map(|text| text.trim().parse().ok())
        .min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn available_memory_is_read_in_kibibytes() {
        let text = "MemTotal:       24640000 kB\nMemFree:  1 kB\nMemAvailable:   20000000 kB\n";
        assert_eq!(kibibytes(text, "MemAvailable:"), Some(20_480_000_000));
        assert_eq!(kibibytes("MemTotal: 5 kB\n", "MemAvailable:"), None);
    }

    #[test]
    fn cpu_time_is_user_and_system_whatever_the_program_is_called() {
        let text = "7 (a) b (c) S 1 2 3 4 5 6 7 8 9 10 1234 66 13 14 20 0 2 0 15";
        assert_eq!(stat_seconds(text), Some(13.0));
        assert_eq!(stat_seconds("7 (short) S 1 2 3"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn work_and_memory_show_in_the_figures_of_this_process() {
        let (cpu_s, memory_bytes) = (cpu_seconds().expect("/proc"), peak_memory_bytes().expect("/proc"));
        let mut numbers: Vec<u64> = (0..20_000_000).collect();
        // Pages of 160 MB more than before are touched; other tests run beside this one and only add to it.
        while cpu_seconds().expect("/proc") < cpu_s + 0.05 {
            numbers.iter_mut().for_each(|n| *n = n.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        }
        assert!(std::hint::black_box(&numbers).len() == 20_000_000);
        assert!(peak_memory_bytes().expect("/proc") >= memory_bytes.max(160_000_000));
    }
}
