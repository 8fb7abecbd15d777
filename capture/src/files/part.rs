//! Temporary names: a file is called `FILE.part` until it is whole.
//!
//! A process holds a lock on the `.part` that it writes. What is there without a lock was left by a process that ended,
//! or was put there by somebody else, and is removed.

use std::{
    ffi::OsString,
    fs::{self, File, Metadata, OpenOptions, TryLockError},
    io::{self, ErrorKind},
    os::unix::fs::{MetadataExt, OpenOptionsExt},
    path::{Path, PathBuf},
};

use rustix::fs::OFlags;

use crate::CaptureError;

/// How many processes may write the same file at the same time.
const MAX_WRITERS: u32 = 64;
/// How often a name that changes under our hands is tried again.
const ATTEMPTS: u32 = 16;

/// Name of `path` while it is being written.
pub fn part_path(path: &Path) -> PathBuf {
    with_suffix(path, ".part")
}

/// Creates a new file beside `path`: `path.part`, or `path.N.part` while another process writes the one before.
pub(crate) fn create_beside(path: &Path) -> Result<(PathBuf, File), CaptureError> {
    for n in 0..MAX_WRITERS {
        let part = if n == 0 { part_path(path) } else { with_suffix(path, &format!(".{n}.part")) };
        if let Some(file) = claim(&part).map_err(|error| CaptureError::io(&part, error))? {
            return Ok((part, file));
        }
    }
    Err(CaptureError::format(path, format!("{MAX_WRITERS} processes are writing this file already; wait for them")))
}

/// Creates `part` as a new file and locks it. Whatever stood under that name without a running writer is removed (a link
/// itself, not what it points to); `None` where a running process writes it.
pub(crate) fn claim(part: &Path) -> io::Result<Option<File>> {
    for _ in 0..ATTEMPTS {
        match File::create_new(part) {
            Ok(file) if is_held(&file, part)? => return Ok(Some(file)),
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                if !remove_abandoned(part)? {
                    return Ok(None);
                }
            }
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// Locks a file that was just created; false where another process took it for abandoned in between and removed it.
fn is_held(file: &File, part: &Path) -> io::Result<bool> {
    // On a file system without locks every file counts as held.
    if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        return Ok(false);
    }
    match fs::symlink_metadata(part) {
        Ok(now) => Ok(is_same(&file.metadata()?, &now)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Removes what no process writes; false where one does.
fn remove_abandoned(part: &Path) -> io::Result<bool> {
    let found = match fs::symlink_metadata(part) {
        Ok(found) => found,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(true),
        Err(error) => return Err(error),
    };
    if !found.is_file() {
        return fs::remove_file(part).map(|()| true);
    }
    let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits();
    // Who may not read it may still remove it.
    let file = OpenOptions::new().read(true).custom_flags(flags as i32).open(part).ok();
    if file.as_ref().is_some_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock))) {
        return Ok(false);
    }
    match fs::symlink_metadata(part) {
        Ok(now) if is_same(&found, &now) => fs::remove_file(part).map(|()| true),
        _ => Ok(true),
    }
}

/// True where both are the same file.
pub(crate) fn is_same(a: &Metadata, b: &Metadata) -> bool {
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

/// Creates the folder that `path` is to stand in.
pub(crate) fn create_parent(path: &Path) -> Result<(), CaptureError> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => {
            fs::create_dir_all(folder).map_err(|error| CaptureError::io(folder, error))
        }
        _ => Ok(()),
    }
}

/// Makes a rename durable: syncs the folder that `path` stands in. File systems that cannot sync a folder are passed over.
pub(crate) fn sync_parent(path: &Path) -> Result<(), CaptureError> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let opened = File::open(folder).map_err(|error| CaptureError::io(folder, error))?;
    match opened.sync_all() {
        Err(error) if !matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => {
            Err(CaptureError::io(folder, error))
        }
        _ => Ok(()),
    }
}

/// `path` with `suffix` appended to its last component.
pub(crate) fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path.as_os_str());
    name.push(suffix);
    PathBuf::from(name)
}
