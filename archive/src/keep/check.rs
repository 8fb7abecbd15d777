//! Checking an archive: every take read, and every file compared with the hash that it had.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use rayon::prelude::*;
use serde::Serialize;
use serde_json::Value;
use toile_capture::inspect;
use toile_pipeline::{hash_file, json};

use super::files::list;
use crate::{ArchiveError, find::subjects};

/// What checking a subject found.
#[derive(Debug, Clone, Serialize)]
pub struct Checked {
    /// The subject's path in the archive.
    pub subject: PathBuf,
    /// Takes that were read to their end.
    pub takes: usize,
    /// Frames in them.
    pub frames: u64,
    /// Files that have the hash that a step noted.
    pub same: usize,
    /// Takes with recorded data that is lost or cannot be read, a sentence each.
    pub lost: Vec<String>,
    /// Files that are not what a step read or wrote, a sentence each.
    pub changed: Vec<String>,
}

/// Reads every take of every subject, and compares takes and results with the hashes in the records.
///
/// # Errors
/// [`ArchiveError`] where the archive cannot be listed. What is wrong with a subject is told in its [`Checked`].
pub fn check(archive: &Path) -> Result<Vec<Checked>, ArchiveError> {
    Ok(subjects(archive)?.into_par_iter().map(|subject| check_subject(archive, subject)).collect())
}

fn check_subject(archive: &Path, subject: PathBuf) -> Checked {
    let root = archive.join(&subject);
    let mut checked = Checked { subject, takes: 0, frames: 0, same: 0, lost: Vec::new(), changed: Vec::new() };
    match inspect(&root) {
        Ok(found) => {
            for take in &found.takes {
                checked.takes += 1;
                checked.frames += take.frames;
                let told = take.unreadable.iter().chain(take.problems.iter().filter(|_| take.data_lost()));
                checked.lost.extend(told.map(|sentence| format!("{}: {sentence}", take.name)));
            }
        }
        Err(error) => checked.lost.push(error.to_string()),
    }
    // A fault of a recording is both unreadable and a problem of the take.
    checked.lost.dedup();
    let mut seen = BTreeMap::new();
    for (name, hash) in noted(&root) {
        let now = seen.entry(name.clone()).or_insert_with(|| hash_file(&root.join(&name)).ok());
        match now {
            Some(now) if *now == hash => checked.same += 1,
            Some(_) => checked.changed.push(format!("{name} is not what a step read or wrote")),
            None => checked.changed.push(format!("{name} is gone or cannot be read")),
        }
    }
    checked.changed.dedup();
    checked
}

/// Every file that a record in `build/` names with its hash.
fn noted(root: &Path) -> Vec<(String, String)> {
    let build = root.join("build");
    let reports = list(&build).unwrap_or_default().into_iter().filter(|name| name.ends_with("/report.json"));
    let mut all = Vec::new();
    for name in reports {
        let report: Value = json::read(&build.join(name)).unwrap_or_default();
        for record in report["stages"].as_object().into_iter().flat_map(|stages| stages.values()) {
            let files = ["inputs", "outputs"].into_iter().filter_map(|key| record[key].as_object()).flatten();
            // A hash that is empty is of a file that differs from run to run; a name without a folder may be outside.
            all.extend(
                files.filter_map(|(name, hash)| {
                    Some((name.clone(), hash.as_str().filter(|h| !h.is_empty())?.to_string()))
                }),
            );
        }
    }
    all.retain(|(name, _)| name.contains('/') || root.join(name).exists());
    all.sort();
    all.dedup();
    all
}
