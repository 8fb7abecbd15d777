//! Keeping the results of a subject before another version replaces them.

use std::{fs, path::Path};

use crate::ArchiveError;

/// What a comparison reads of a folder in `build/`.
const KEPT: [&str; 6] = ["report.json", "garment.ply", "body.ply", "body.json", "measurements.json", "scan.ply"];

/// Keeps the results at `root` in `old`, where nothing is kept of them yet. Files are linked where both are on one file system: a
/// step never writes into a file, it replaces it.
///
/// # Errors
/// [`ArchiveError`] where a file can be neither linked nor copied.
pub fn keep(root: &Path, old: &Path) -> Result<(), ArchiveError> {
    let Ok(folders) = fs::read_dir(root.join("build")) else { return Ok(()) };
    for folder in folders.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()) {
        let to = old.join("build").join(folder.file_name().unwrap_or_default());
        fs::create_dir_all(&to).map_err(|error| ArchiveError::io(&to, error))?;
        for (from, to) in KEPT.iter().map(|name| (folder.join(name), to.join(name))) {
            if from.is_file() && !to.exists() {
                let linked = fs::hard_link(&from, &to).or_else(|_| fs::copy(&from, &to).map(drop));
                linked.map_err(|error| ArchiveError::io(&to, error))?;
            }
        }
    }
    Ok(())
}
