//! Where the subjects of an archive are.

use std::{
    fs,
    path::{Path, PathBuf},
};

use toile_capture::Subject;

use crate::ArchiveError;

/// Folders within folders that are looked into: `archive/2026/05/anna` has a depth of three.
const DEPTH: usize = 8;

/// The subjects of an archive by their paths in it, in the order of their names. Hidden folders and links are passed over.
///
/// # Errors
/// [`ArchiveError`] where a folder cannot be listed, or the archive is a subject itself.
pub fn subjects(archive: &Path) -> Result<Vec<PathBuf>, ArchiveError> {
    if Subject::exists(archive) {
        return Err(ArchiveError::refused(
            archive,
            "is a subject itself; give the folder that holds it, or use `toile process`",
        ));
    }
    let mut found = Vec::new();
    look(archive, DEPTH, &mut found)?;
    let inside = |path: PathBuf| path.strip_prefix(archive).map(Path::to_path_buf).unwrap_or(path);
    let mut found: Vec<PathBuf> = found.into_iter().map(inside).collect();
    found.sort();
    Ok(found)
}

fn look(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), ArchiveError> {
    let wrong = |error| ArchiveError::io(folder, error);
    for entry in fs::read_dir(folder).map_err(wrong)? {
        let entry = entry.map_err(wrong)?;
        let is_hidden = entry.file_name().to_string_lossy().starts_with('.');
        if is_hidden || !entry.file_type().map_err(wrong)?.is_dir() {
            continue;
        }
        if Subject::exists(&entry.path()) {
            found.push(entry.path());
        } else if depth > 1 {
            look(&entry.path(), depth - 1, found)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subjects_are_found_in_order_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["b", "a/2026/x", ".toile/old", "a/2026/x/takes/inner"] {
            fs::create_dir_all(dir.path().join(name)).unwrap();
            fs::write(dir.path().join(name).join("subject.toml"), "name = \"x\"").unwrap();
        }
        std::os::unix::fs::symlink(dir.path(), dir.path().join("loop")).unwrap();
        assert_eq!(subjects(dir.path()).unwrap(), [PathBuf::from("a/2026/x"), PathBuf::from("b")]);
        assert!(subjects(&dir.path().join("b")).unwrap_err().to_string().contains("a subject itself"));
        assert!(subjects(&dir.path().join("none")).is_err());
    }
}
