//! How many processors and how much memory a batch may use.

use std::{fs, path::Path, thread};

use rustix::process::{Resource, getrlimit};
use serde::Serialize;

/// Memory that a batch may use, and who says so.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Memory {
    /// For all processes together, bytes.
    pub bytes: u64,
    /// Who says so.
    pub by: &'static str,
}

/// Processors that this process may use: those of its cgroup and affinity.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// The smallest of what was `given`, what the cgroup leaves, `ulimit -v`, and what the machine has free.
pub fn memory(given: Option<u64>) -> Memory {
    let limits = [
        given.map(|bytes| (bytes, "--memory")),
        cgroup(Path::new("/sys/fs/cgroup"), &read("/proc/self/cgroup")).map(|bytes| (bytes, "the cgroup")),
        getrlimit(Resource::As).current.map(|bytes| (bytes, "ulimit -v")),
        field(&read("/proc/meminfo"), "MemAvailable:").map(|bytes| (bytes, "the machine's free memory")),
    ];
    let least = limits.into_iter().flatten().min_by_key(|limit| limit.0);
    let (bytes, by) = least.unwrap_or((FALLBACK, "nobody"));
    Memory { bytes, by }
}

/// Where the system does not say: 2 GiB, what the smallest machines have that process a subject at all.
const FALLBACK: u64 = 2 << 30;

/// What the cgroups of this process leave, bytes: of each the limit without what is in use already. Version 2, or 1.
fn cgroup(root: &Path, own: &str) -> Option<u64> {
    let mut least = None;
    for line in own.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next()?, parts.next()?.trim_start_matches('/'));
        let (base, limit, stat) = match controllers {
            "" => (root.to_path_buf(), "memory.max", "anon"),
            "memory" => (root.join("memory"), "memory.limit_in_bytes", "rss"),
            _ => continue,
        };
        let mut folder = base.join(path);
        while folder.starts_with(&base) {
            let value = fs::read_to_string(folder.join(limit)).ok().and_then(|text| text.trim().parse::<u64>().ok());
            // Version 1 says "no limit" with the largest number of pages.
            if let Some(limit) = value.filter(|limit| *limit < 1 << 60) {
                let stats = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
                let used = stats.lines().find_map(|l| l.strip_prefix(stat)?.trim().parse::<u64>().ok()).unwrap_or(0);
                least = Some(least.unwrap_or(u64::MAX).min(limit.saturating_sub(used)));
            }
            if !folder.pop() {
                break;
            }
        }
    }
    least
}

/// A line of `/proc/meminfo` and its kin, kB, as bytes.
fn field(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kb| kb * 1024)
}

fn read(path: &str) -> String {
    fs::read_to_string(path).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tightest_cgroup_on_the_way_up_counts() {
        let root = tempfile::tempdir().unwrap();
        let inner = root.path().join("a/b");
        fs::create_dir_all(&inner).unwrap();
        fs::write(root.path().join("a/memory.max"), "1500000000\n").unwrap();
        fs::write(root.path().join("a/memory.stat"), "anon 500000000\nfile 7\n").unwrap();
        fs::write(inner.join("memory.max"), "max\n").unwrap();
        assert_eq!(cgroup(root.path(), "0::/a/b\n"), Some(1_000_000_000));
        assert_eq!(cgroup(root.path(), "0::/c\n"), None);
        let first = root.path().join("memory/a");
        fs::create_dir_all(&first).unwrap();
        fs::write(first.join("memory.limit_in_bytes"), "300\n").unwrap();
        fs::write(root.path().join("memory/memory.limit_in_bytes"), "9223372036854771712\n").unwrap();
        assert_eq!(cgroup(root.path(), "4:cpu:/a\n3:memory:/a\n"), Some(300));
    }

    #[test]
    fn what_was_given_wins_where_it_is_the_least() {
        assert_eq!(memory(Some(1 << 20)), Memory { bytes: 1 << 20, by: "--memory" });
        assert!(memory(None).bytes > 1 << 20 && cores() > 0);
        assert_eq!(field("MemFree: 1 kB\nMemAvailable:   2048 kB\n", "MemAvailable:"), Some(2 << 20));
    }
}
