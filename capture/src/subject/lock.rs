//! The lock of a subject.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    os::unix::fs::{MetadataExt, OpenOptionsExt},
    path::Path,
};

use rustix::fs::OFlags;

use crate::CaptureError;

/// How often a folder that is removed and made again meanwhile is tried.
const ATTEMPTS: u32 = 8;

/// Shows that this process alone writes into a subject's folder, until it is dropped.
///
/// Whoever writes holds one: `import` and `capture` (inside a [`LockedSubject`](super::LockedSubject)), `process` and the
/// other stages, `edit`. Who only reads needs none. The system takes the lock back when a process ends, however it ends.
#[derive(Debug)]
pub struct SubjectLock {
    /// The locked folder; `None` on a file system without locks, where nothing can be promised.
    _folder: Option<File>,
}

impl SubjectLock {
    /// Locks an existing folder, or refuses at once.
    ///
    /// # Errors
    /// [`CaptureError::Busy`] where another process holds the lock; [`CaptureError::Io`] where the folder cannot be
    /// opened.
    pub fn acquire(folder: &Path) -> Result<Self, CaptureError> {
        for _ in 0..ATTEMPTS {
            let flags = OFlags::DIRECTORY.bits() as i32;
            let opened = OpenOptions::new().read(true).custom_flags(flags).open(folder);
            let file = opened.map_err(|error| CaptureError::io(folder, error))?;
            match file.try_lock() {
                Ok(()) if is_still(&file, folder) => return Ok(Self { _folder: Some(file) }),
                // Removed, and perhaps made again, between opening and locking.
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => break,
                Err(TryLockError::Error(_)) => return Ok(Self { _folder: None }),
            }
        }
        Err(CaptureError::Busy { path: folder.to_path_buf() })
    }
}

/// True where `folder` is still the folder that was opened.
fn is_still(opened: &File, folder: &Path) -> bool {
    let same = |a: &fs::Metadata, b: &fs::Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
    opened.metadata().is_ok_and(|opened| fs::metadata(folder).is_ok_and(|now| same(&opened, &now)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holder_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let first = SubjectLock::acquire(folder.path()).unwrap();
        let second = SubjectLock::acquire(folder.path()).unwrap_err();
        assert!(matches!(second, CaptureError::Busy { .. }), "{second}");
        drop(first);
        assert!(SubjectLock::acquire(folder.path()).is_ok());
        assert!(matches!(SubjectLock::acquire(&folder.path().join("none")), Err(CaptureError::Io { .. })));
    }
}
