//! The catalogue of an archive in a bucket: read from the small files of its subjects, without a take.

use std::{
    fs,
    path::{Path, PathBuf},
};

use toile_pipeline::{Standing, hash_bytes};

use super::{Catalog, Synced, facts::Facts};
use crate::{
    ArchiveError,
    remote::{Bucket, RemoteSubject},
    state,
};

impl Catalog {
    /// Reads every subject of a bucket whose small files changed since it was read last, and forgets those that are no more. The
    /// catalogue itself lies in the `archive` that it was opened with: the cache of the bucket.
    ///
    /// # Errors
    /// [`ArchiveError`] where the catalogue cannot be written. A subject that cannot be fetched is told as one that cannot be read.
    pub fn sync_bucket(&mut self, bucket: &Bucket, subjects: &[RemoteSubject]) -> Result<Synced, ArchiveError> {
        let found: Vec<(PathBuf, String)> =
            subjects.iter().map(|subject| (subject.subject.clone(), stamp(subject))).collect();
        let small = state::folder(&self.archive).join("small");
        let read = |name: &Path| {
            let missing = || ArchiveError::refused(name, "is no more in the bucket");
            let subject = subjects.iter().find(|subject| subject.subject == name).ok_or_else(missing)?;
            let root = small.join(state::file_name(name));
            let facts = facts(bucket, subject, &root);
            // What is left of it is fetched anew the next time.
            drop(fs::remove_dir_all(&root));
            facts
        };
        bucket.side_by_side(|| self.bring(&found, read))
    }
}

fn facts(bucket: &Bucket, subject: &RemoteSubject, root: &Path) -> Result<Facts, ArchiveError> {
    bucket.fetch_some(subject, root, is_small)?;
    let mut facts = Facts::read(root)?;
    // Its takes were not fetched: what the manifest tells holds.
    facts.plan.standing = match facts.plan.standing {
        Standing::Withheld => Standing::Withheld,
        _ if subject.up_to_date => Standing::UpToDate,
        _ => Standing::Stale,
    };
    for take in &mut facts.takes {
        take.bytes = subject.bytes_of(&format!("takes/{}.", take.layer));
    }
    Ok(facts)
}

/// What [`Facts`] are read from.
fn is_small(path: &str) -> bool {
    let name = PathBuf::from(path);
    let name = name.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let is_report = path.starts_with("build/") && matches!(name, "report.json" | "timings.json" | "measurements.json");
    is_report || matches!(path, "subject.toml" | "toile.toml") || path.starts_with("edits/")
}

/// Marks of the files that the facts are read from, and how the results stand.
fn stamp(subject: &RemoteSubject) -> String {
    let text = format!("{} {}", subject.up_to_date, subject.stamps(is_small));
    format!("bucket {}", hash_bytes(text.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_need_no_takes_and_no_meshes() {
        for path in ["subject.toml", "edits/01-top.json", "build/timings.json", "build/body/measurements.json"] {
            assert!(is_small(path), "{path}");
        }
        for path in ["takes/00-body.mcap", "build/body/body.ply", "avatar.glb", "takes/report.json"] {
            assert!(!is_small(path), "{path}");
        }
    }
}
