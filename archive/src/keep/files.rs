//! The files of a subject, and what a pack says of them.

use std::{
    collections::BTreeMap,
    fs,
    os::unix::fs::MetadataExt,
    path::{Component, Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use crate::ArchiveError;

/// A file of a subject.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct FileFacts {
    /// Its length.
    pub(super) bytes: u64,
    /// Time of its last change, nanoseconds since 1970.
    pub(super) modified_ns: u64,
    /// SHA-256 of its content.
    pub(super) sha256: String,
}

/// The first entry of a pack: what is in it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Manifest {
    /// Version of this format: 1.
    pub(super) version: u32,
    /// The subject's path in its archive.
    pub(super) subject: String,
    /// Every file by its path in the subject's folder.
    pub(super) files: BTreeMap<String, FileFacts>,
}

/// Name of the manifest in a pack.
pub(super) const MANIFEST: &str = "toile-pack.json";

/// Every regular file below `folder` by its path in it, in order, without unfinished ones. Links are passed over.
pub(crate) fn list(folder: &Path) -> Result<Vec<String>, ArchiveError> {
    let (mut found, mut waiting) = (Vec::new(), vec![folder.to_path_buf()]);
    while let Some(at) = waiting.pop() {
        let wrong = |error| ArchiveError::io(&at, error);
        for entry in fs::read_dir(&at).map_err(wrong)? {
            let entry = entry.map_err(wrong)?;
            let kind = entry.file_type().map_err(wrong)?;
            if kind.is_dir() {
                waiting.push(entry.path());
            } else if kind.is_file() {
                let path = entry.path();
                let inside = path.strip_prefix(folder).unwrap_or(&path);
                let name =
                    inside.to_str().ok_or_else(|| ArchiveError::refused(&path, "its name is not UTF-8; rename it"))?;
                found.push(name.to_string());
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Length and time of a file.
pub(super) fn stamp(path: &Path) -> Result<(u64, u64), ArchiveError> {
    let found = fs::metadata(path).map_err(|error| ArchiveError::io(path, error))?;
    Ok((found.size(), (found.mtime() * 1_000_000_000 + found.mtime_nsec()).max(0) as u64))
}

/// `name` below `folder`, where it stays inside.
pub(crate) fn inside(folder: &Path, name: &str) -> Option<PathBuf> {
    let path = Path::new(name);
    let plain = !name.is_empty() && path.components().all(|part| matches!(part, Component::Normal(_)));
    plain.then(|| folder.join(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_leads_out_of_the_folder() {
        let folder = Path::new("/a");
        assert_eq!(inside(folder, "takes/00-body.mcap"), Some("/a/takes/00-body.mcap".into()));
        for name in ["", "/etc/passwd", "../b", "x/../../b", "./x"] {
            assert_eq!(inside(folder, name), None, "{name}");
        }
    }
}
