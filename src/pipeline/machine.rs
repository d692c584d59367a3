//! What the machine has.

use std::fs;
use std::path::Path;

/// Memory that this process can still take: what the system has available, or the limit of its control
/// group where that is lower. None on systems without `/proc`.
pub fn memory_there_bytes() -> Option<u64> {
    let available = fs::read_to_string("/proc/meminfo").ok().and_then(|text| available_bytes(&text));
    let limit = fs::read_to_string("/proc/self/cgroup").ok().and_then(|text| group_limit_bytes(&text));
    available.into_iter().chain(limit).min()
}

fn available_bytes(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    line.split_ascii_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
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
        assert_eq!(available_bytes(text), Some(20_480_000_000));
        assert_eq!(available_bytes("MemTotal: 5 kB\n"), None);
    }
}
