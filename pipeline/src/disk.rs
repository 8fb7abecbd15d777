//! Files that appear whole or not at all: written beside, synced, renamed.

use std::{
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
};

use crate::PipelineError;

/// Name of `path` while it is being written.
pub fn part_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    PathBuf::from(name)
}

/// Writes `bytes` to `path`; a reader sees the old file or the whole new one. Folders are made as needed.
///
/// # Errors
/// [`PipelineError::DiskFull`] or [`PipelineError::Io`]; the old file is then untouched and no `.part` is left.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), PipelineError> {
    let part = write_part(path, bytes)?;
    publish(&part, path)
}

/// Writes several files so that none appears unless all could be written.
///
/// # Errors
/// As [`write_whole`]; on an error none of the files was replaced (a kill between two renames can leave some
/// replaced, which the stage's record then shows).
pub fn write_all_whole(files: &[(PathBuf, Vec<u8>)]) -> Result<(), PipelineError> {
    let mut parts = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        match write_part(path, bytes) {
            Ok(part) => parts.push(part),
            Err(error) => {
                parts.iter().for_each(|p: &PathBuf| drop(fs::remove_file(p)));
                return Err(error);
            }
        }
    }
    files.iter().zip(&parts).try_for_each(|((path, _), part)| publish(part, path))
}

/// Makes a folder and those above it.
///
/// # Errors
/// [`PipelineError::Io`] where it cannot be made.
pub fn make_folder(path: &Path) -> Result<(), PipelineError> {
    fs::create_dir_all(path).map_err(|e| PipelineError::io(path, e))
}

fn write_part(path: &Path, bytes: &[u8]) -> Result<PathBuf, PipelineError> {
    if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
        make_folder(folder)?;
    }
    let part = part_path(path);
    let written = File::create(&part).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    written.map_err(|e| {
        drop(fs::remove_file(&part));
        PipelineError::io(path, e)
    })?;
    Ok(part)
}

fn publish(part: &Path, path: &Path) -> Result<(), PipelineError> {
    fs::rename(part, path).map_err(|e| PipelineError::io(path, e))?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // The rename itself must survive a power cut; file systems without folder sync say so, which is no failure.
    if let Ok(folder) = File::open(folder) {
        drop(folder.sync_all());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_leaves_the_old_file_and_no_part() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scan.ply");
        fs::write(&path, b"old").unwrap();
        std::os::unix::fs::symlink("/dev/full", part_path(&path)).unwrap();
        let error = write_whole(&path, b"new").unwrap_err();
        assert!(matches!(error, PipelineError::DiskFull { .. }), "{error}");
        assert!(error.to_string().contains("free some space"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert!(!part_path(&path).is_symlink());
    }

    #[test]
    fn of_several_files_none_appears_when_one_does_not_fit() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|n| dir.path().join(n));
        std::os::unix::fs::symlink("/dev/full", part_path(&b)).unwrap();
        let files = [(a.clone(), vec![1]), (b.clone(), vec![2])];
        assert!(write_all_whole(&files).is_err());
        assert!(!a.exists() && !b.exists() && !part_path(&a).exists());
        write_all_whole(&files).unwrap();
        assert_eq!(fs::read(&b).unwrap(), [2]);
    }
}
