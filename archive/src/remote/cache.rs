//! The folder that subjects of a bucket are processed in: an archive of its own, of bounded size.

use std::{
    collections::BTreeSet,
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
    time::{SystemTime, UNIX_EPOCH},
};

use super::fetch::{evict, notes};
use crate::{ArchiveError, find::subjects, state};

/// A cache, held by this process alone.
pub struct Cache {
    /// Its folder.
    pub folder: PathBuf,
    /// How large it may become, bytes.
    pub bytes: u64,
    /// The system takes the lock back when the process ends, however it ends.
    _lock: File,
}

impl Cache {
    /// Opens or makes a cache.
    ///
    /// # Errors
    /// [`ArchiveError`] where it cannot be written, or another batch works in it.
    pub fn open(folder: &Path, bytes: u64) -> Result<Self, ArchiveError> {
        let own = state::folder(folder);
        fs::create_dir_all(&own).map_err(|error| ArchiveError::io(&own, error))?;
        let path = own.join("cache.lock");
        let lock = File::create(&path).map_err(|error| ArchiveError::io(&path, error))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { folder: folder.to_path_buf(), bytes, _lock: lock }),
            Err(TryLockError::WouldBlock) => {
                let reason = "another batch works in this cache; wait for it, or give another folder with --cache";
                Err(ArchiveError::refused(folder, reason))
            }
            Err(TryLockError::Error(error)) => Err(ArchiveError::io(&path, error)),
        }
    }

    /// Removes subjects that are not in `kept`, those first that were fetched first, until what stays leaves room for `need` bytes.
    pub(super) fn make_room(&self, kept: &BTreeSet<&Path>, need: u64) -> Result<(), ArchiveError> {
        let mut others: Vec<(SystemTime, PathBuf, u64)> = Vec::new();
        for subject in subjects(&self.folder)?.into_iter().filter(|subject| !kept.contains(subject.as_path())) {
            let fetched = fs::metadata(notes(&self.folder, &subject)).and_then(|found| found.modified());
            let bytes = size(&self.folder.join(&subject))?;
            others.push((fetched.unwrap_or(UNIX_EPOCH), subject, bytes));
        }
        others.sort();
        let mut used: u64 = others.iter().map(|other| other.2).sum();
        for (_, subject, bytes) in others {
            if used + need <= self.bytes {
                break;
            }
            evict(&self.folder, &subject)?;
            used -= bytes;
        }
        Ok(())
    }
}

/// Length of all files in a folder, bytes.
fn size(folder: &Path) -> Result<u64, ArchiveError> {
    let files = crate::keep::list(folder)?;
    Ok(files.iter().filter_map(|file| fs::metadata(folder.join(file)).ok()).map(|found| found.len()).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_goes_first_and_only_as_much_as_must() {
        let dir = tempfile::tempdir().unwrap();
        let cache = Cache::open(dir.path(), 350).unwrap();
        for (age, name) in ["old", "new", "kept"].iter().enumerate() {
            let root = dir.path().join(name);
            fs::create_dir_all(&root).unwrap();
            fs::write(root.join("subject.toml"), [b' '; 100]).unwrap();
            let noted = notes(dir.path(), Path::new(name));
            fs::create_dir_all(noted.parent().unwrap()).unwrap();
            let file = File::create(&noted).unwrap();
            file.set_modified(UNIX_EPOCH + std::time::Duration::from_secs(age as u64)).unwrap();
        }
        let kept = BTreeSet::from([Path::new("kept")]);
        cache.make_room(&kept, 150).unwrap();
        assert_eq!(subjects(dir.path()).unwrap(), [PathBuf::from("kept"), PathBuf::from("new"), PathBuf::from("old")]);
        cache.make_room(&kept, 250).unwrap();
        assert_eq!(subjects(dir.path()).unwrap(), [PathBuf::from("kept"), PathBuf::from("new")]);
        cache.make_room(&kept, 1000).unwrap();
        assert_eq!(subjects(dir.path()).unwrap(), [PathBuf::from("kept")]);
    }

    #[test]
    fn two_batches_do_not_share_a_cache() {
        let dir = tempfile::tempdir().unwrap();
        let _first = Cache::open(dir.path(), 1).unwrap();
        let said = Cache::open(dir.path(), 1).err().unwrap().to_string();
        assert!(said.contains("--cache"), "{said}");
    }
}
