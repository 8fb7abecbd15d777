//! Who holds which folder, seen without taking a lock oneself: a moment's lock of ours would turn a command line away.

use std::{collections::BTreeSet, fs, os::unix::fs::MetadataExt, path::Path};

/// Device and inode of all files on which some process holds a lock, by the system's own list.
///
/// Empty where the system has no such list; then nobody seems busy, and whoever writes finds out by the lock itself.
pub struct Held(BTreeSet<(u64, u64)>);

impl Held {
    /// All locks that are held now.
    pub fn now() -> Self {
        let list = fs::read_to_string("/proc/locks").unwrap_or_default();
        Self(list.lines().filter_map(parse).collect())
    }

    /// True where somebody holds the lock of a folder.
    pub fn holds(&self, folder: &Path) -> bool {
        let of = |about: fs::Metadata| (about.dev(), about.ino());
        !self.0.is_empty() && fs::metadata(folder).is_ok_and(|about| self.0.contains(&of(about)))
    }
}

/// `1: FLOCK ADVISORY WRITE 4711 fe:01:393218 0 EOF` to the file's device and inode.
fn parse(line: &str) -> Option<(u64, u64)> {
    let mut words = line.split_whitespace().skip_while(|word| *word != "FLOCK");
    let place = words.nth(4)?;
    let mut parts = place.split(':');
    let mut hex = || u32::from_str_radix(parts.next()?, 16).ok();
    let (major, minor) = (hex()?, hex()?);
    Some((rustix::fs::makedev(major, minor), parts.next()?.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use toile_capture::SubjectLock;

    use super::*;

    #[test]
    fn a_lock_is_seen_while_it_is_held() {
        let dir = tempfile::tempdir().unwrap();
        assert!(!Held::now().holds(dir.path()));
        let lock = SubjectLock::acquire(dir.path()).unwrap();
        assert!(Held::now().holds(dir.path()));
        drop(lock);
        assert!(!Held::now().holds(dir.path()));
        assert_eq!(parse("1: FLOCK  ADVISORY  WRITE 7 00:10:12 0 EOF"), Some((rustix::fs::makedev(0, 0x10), 12)));
        assert_eq!(parse("1: POSIX  ADVISORY  WRITE 7 00:10:12 0 EOF"), None);
    }
}
