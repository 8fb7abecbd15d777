//! Removing a person everywhere.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde::Serialize;
use toile_capture::{Subject, SubjectLock};

use super::{
    files::{list, stamp},
    pack::packed_path,
    tombstone::Tombstone,
};
use crate::{ArchiveError, catalog::Catalog, state};

/// What was removed.
#[derive(Debug, Clone, Serialize)]
pub struct Forgotten {
    /// Files of the subject.
    pub files: usize,
    /// Their bytes.
    pub bytes: u64,
    /// Folders and packs that were removed.
    pub places: Vec<PathBuf>,
}

/// Removes a subject from an archive: its folder, its lines in the catalogue, its logs, what is kept of its failures, and its
/// pack or folder in each of `also` (folders of packs, copies of the archive). A tombstone without a name stays, by which a
/// batch or an unpacking that meets a copy recognises it.
///
/// A removal that was interrupted goes on with the same call.
///
/// # Errors
/// [`ArchiveError`] where there is no such subject and never was, another program writes it, or a file cannot be removed.
pub fn forget(archive: &Path, subject: &Path, also: &[PathBuf]) -> Result<Forgotten, ArchiveError> {
    let root = archive.join(subject);
    let begun = Tombstone::read(archive, subject);
    if !Subject::exists(&root) && begun.is_none() {
        return Err(ArchiveError::refused(&root, "is not a subject of this archive; give its path inside the archive"));
    }
    // Held until its folder is gone.
    let lock = root.is_dir().then(|| SubjectLock::acquire(&root)).transpose()?;
    let mut tombstone = begun.unwrap_or_else(Tombstone::new);
    tombstone.complete = false;
    tombstone.write(archive, subject)?;
    let mut places = Vec::new();
    if root.is_dir() {
        for name in list(&root)? {
            tombstone.files += 1;
            tombstone.bytes += stamp(&root.join(name))?.0;
        }
    }
    let own = state::folder(archive);
    let name = state::file_name(subject);
    let kept = [own.join("quarantine").join(format!("{name}.json")), own.join("logs").join(format!("{name}.log"))];
    let copies = also.iter().flat_map(|folder| [packed_path(folder, subject), folder.join(subject)]);
    for place in [root].into_iter().chain(kept).chain(copies) {
        if remove(&place)? {
            places.push(place);
        }
    }
    drop(lock);
    Catalog::open(archive)?.forget(subject)?;
    tombstone.complete = true;
    tombstone.write(archive, subject)?;
    Ok(Forgotten { files: tombstone.files, bytes: tombstone.bytes, places })
}

/// Removes a file or a folder; false where there is none.
fn remove(place: &Path) -> Result<bool, ArchiveError> {
    let found = match fs::symlink_metadata(place) {
        Ok(found) => found,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(ArchiveError::io(place, error)),
    };
    let removed = if found.is_dir() { fs::remove_dir_all(place) } else { fs::remove_file(place) };
    removed.map(|()| true).map_err(|error| ArchiveError::io(place, error))
}
