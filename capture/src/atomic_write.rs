//! Files that appear whole or not at all.

use std::{
    ffi::OsString,
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
};

use crate::CaptureError;

/// Writes `bytes` to `path` so that readers see the old file or the new one, never a half: beside, synced, renamed.
/// Folders above are created where they are missing.
///
/// # Errors
/// [`CaptureError::DiskFull`] or [`CaptureError::Io`]; `path` is then as it was, and nothing is left beside it.
pub fn atomic_write(path: &Path, bytes: &[u8]) -> Result<(), CaptureError> {
    atomic_write_with(path, |file| file.write_all(bytes))
}

/// Like [`atomic_write`], with a closure that writes the file's content.
///
/// # Errors
/// As [`atomic_write`]; also what the closure answers.
pub fn atomic_write_with(
    path: &Path,
    write: impl FnOnce(&mut std::io::BufWriter<&File>) -> std::io::Result<()>,
) -> Result<(), CaptureError> {
    create_parent(path)?;
    let beside = with_suffix(path, ".tmp");
    let written = write_and_sync(&beside, write).and_then(|()| fs::rename(&beside, path));
    if let Err(error) = written {
        let _ = fs::remove_file(&beside);
        return Err(CaptureError::io(path, error));
    }
    sync_parent(path)
}

fn write_and_sync(
    path: &Path,
    write: impl FnOnce(&mut std::io::BufWriter<&File>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let file = File::create(path)?;
    let mut writer = std::io::BufWriter::new(&file);
    write(&mut writer)?;
    writer.flush()?;
    drop(writer);
    file.sync_all()
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

/// Makes a rename durable: syncs the folder that `path` stands in.
pub(crate) fn sync_parent(path: &Path) -> Result<(), CaptureError> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    File::open(folder).and_then(|folder| folder.sync_all()).map_err(|error| CaptureError::io(folder, error))
}

/// `path` with `suffix` appended to its last component.
pub(crate) fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path.as_os_str());
    name.push(suffix);
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_whole_files_and_leaves_nothing_beside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/file.json");
        atomic_write(&path, b"old").unwrap();
        atomic_write(&path, b"new").unwrap();
        let failed = atomic_write_with(&path, |file| {
            file.write_all(b"half")?;
            Err(std::io::Error::other("the writer gave up"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn a_full_disk_is_named() {
        let full = Path::new("/dev/full");
        let Ok(mut file) = fs::OpenOptions::new().write(true).open(full) else {
            eprintln!("skipped: no /dev/full here");
            return;
        };
        let error = file.write_all(b"x").expect_err("a full device takes nothing");
        assert!(CaptureError::io(full, error).to_string().contains("the disk is full"));
    }
}
