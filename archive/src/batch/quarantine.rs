//! Subjects that failed twice: left out until they, their settings or the program change.

use std::{
    collections::BTreeMap,
    fs,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use toile_capture::files::atomic_write;
use toile_pipeline::{Asked, Options, json};

use crate::{ArchiveError, state};

/// Why a subject is left out, and what it was like then: `ARCHIVE/.toile/quarantine/NAME.json`. Removing the file lets it be
/// tried again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Quarantine {
    /// The subject's path in the archive.
    pub(crate) subject: String,
    /// What happened the last time.
    pub(crate) why: String,
    /// What was asked.
    asked: Asked,
    /// Bytes and nanoseconds of the last change of each take.
    takes: BTreeMap<String, [u64; 2]>,
}

impl Quarantine {
    /// Of `subject` as it is now.
    pub(crate) fn new(archive: &Path, subject: &Path, options: &Options, why: &str) -> Result<Self, ArchiveError> {
        let root = archive.join(subject);
        Ok(Self {
            subject: subject.to_string_lossy().into_owned(),
            why: why.into(),
            asked: Asked::now(&root, options)?,
            takes: takes(&root),
        })
    }

    /// Keeps it for later batches.
    pub(crate) fn write(&self, archive: &Path) -> Result<(), ArchiveError> {
        Ok(atomic_write(&path(archive, Path::new(&self.subject)), &json::pretty(self)?)?)
    }

    /// Why the subject is left out: it failed, and nothing has changed since.
    pub(crate) fn holds(archive: &Path, subject: &Path, options: &Options) -> Option<String> {
        let kept: Self = json::read(&path(archive, subject)).ok()?;
        let now = Self::new(archive, subject, options, &kept.why).ok()?;
        (kept == now).then_some(kept.why)
    }

    /// Forgets it: the subject could be processed.
    pub(crate) fn lift(archive: &Path, subject: &Path) {
        drop(fs::remove_file(path(archive, subject)));
    }
}

fn path(archive: &Path, subject: &Path) -> PathBuf {
    state::folder(archive).join("quarantine").join(format!("{}.json", state::file_name(subject)))
}

fn takes(root: &Path) -> BTreeMap<String, [u64; 2]> {
    let files = fs::read_dir(root.join("takes")).into_iter().flatten().flatten();
    let stamp = |entry: &fs::DirEntry| {
        let found = entry.metadata().ok()?;
        Some([found.size(), (found.mtime() * 1_000_000_000 + found.mtime_nsec()).max(0) as u64])
    };
    files.filter_map(|entry| Some((entry.file_name().to_string_lossy().into_owned(), stamp(&entry)?))).collect()
}
