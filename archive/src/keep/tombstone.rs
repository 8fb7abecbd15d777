//! Tombstones: that somebody was removed, without saying who.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use toile_capture::{files::atomic_write, subject::today};
use toile_pipeline::{hash_bytes, json};

use crate::{ArchiveError, state};

/// That a subject was removed: `ARCHIVE/.toile/forgotten/HASH.json`. It holds no name: the file is called by the SHA-256 of the
/// subject's path, so that a copy that comes back is recognised.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Tombstone {
    /// The day.
    pub(crate) forgotten: String,
    /// True once everything was removed; until then `forget` goes on.
    pub(crate) complete: bool,
    /// How many files went.
    pub(crate) files: usize,
    /// How many bytes.
    pub(crate) bytes: u64,
}

impl Tombstone {
    /// Of a subject that is being removed today.
    pub(crate) fn new() -> Self {
        Self { forgotten: today(), complete: false, files: 0, bytes: 0 }
    }

    pub(crate) fn read(archive: &Path, subject: &Path) -> Option<Self> {
        json::read(&path(archive, subject)).ok()
    }

    pub(crate) fn write(&self, archive: &Path, subject: &Path) -> Result<(), ArchiveError> {
        Ok(atomic_write(&path(archive, subject), &json::pretty(self)?)?)
    }
}

/// Since which day a subject counts as removed.
pub(crate) fn forgotten(archive: &Path, subject: &Path) -> Option<String> {
    // Most archives forgot nobody: one look at a folder.
    fs::metadata(folder(archive)).ok()?;
    Tombstone::read(archive, subject).map(|tombstone| tombstone.forgotten)
}

fn folder(archive: &Path) -> PathBuf {
    state::folder(archive).join("forgotten")
}

fn path(archive: &Path, subject: &Path) -> PathBuf {
    folder(archive).join(format!("{}.json", hash_bytes(subject.to_string_lossy().as_bytes())))
}
