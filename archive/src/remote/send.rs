//! From the cache into the bucket: results whole, and a manifest of them last.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use rayon::prelude::*;
use toile_pipeline::{Options, Ticket, hash_file, json};

use super::{
    bucket::Bucket,
    manifest::{MadeBy, Manifest, NAME, Sent, is_result, is_unused, sources},
    subject::RemoteSubject,
};
use crate::ArchiveError;

impl Bucket {
    /// Sends the results of a subject in the cache: first the old manifest goes, then every file that changed is written
    /// whole, what is no result any more is removed, and last comes the new manifest. Then the store is asked what it has.
    ///
    /// # Errors
    /// [`ArchiveError`] where the store does not answer, has something else then, or the results cannot be read.
    pub fn send_results(&self, subject: &RemoteSubject, cache: &Path, options: &Options) -> Result<(), ArchiveError> {
        let (name, root) = (subject.subject.to_string_lossy(), cache.join(&subject.subject));
        let old = self.manifest(&name)?.map(|manifest| manifest.results).unwrap_or_default();
        let found: Vec<String> =
            crate::keep::list(&root)?.into_iter().filter(|path| is_result(path) && !is_unused(path)).collect();
        self.remove(&format!("{name}/{NAME}"))?;
        let send = |path: &String| {
            let (bytes, sha256) = facts(&root.join(path))?;
            let is_there = |sent: &&Sent| {
                let object = subject.objects.get(path);
                (sent.bytes, &sent.sha256) == (bytes, &sha256)
                    && object.is_some_and(|object| object.stamp() == (sent.bytes, sent.mark.clone()))
            };
            let mark = match old.get(path).filter(is_there) {
                Some(sent) => sent.mark.clone(),
                None => self.send(&format!("{name}/{path}"), &root.join(path))?.trim_matches('"').to_string(),
            };
            Ok((path.clone(), Sent { bytes, sha256, mark }))
        };
        let results: BTreeMap<String, Sent> =
            self.side_by_side(|| found.par_iter().map(send).collect::<Result<_, ArchiveError>>())?;
        let gone = subject.objects.keys().filter(|path| is_result(path) && !results.contains_key(*path));
        gone.into_iter().try_for_each(|path| self.remove(&format!("{name}/{path}")))?;
        let manifest = Manifest {
            version: 1,
            by: MadeBy::now(options)?,
            sources: sources(&subject.objects),
            results,
            seconds: Ticket::read(&root).map_or(0.0, |ticket| ticket.seconds),
        };
        self.write(&format!("{name}/{NAME}"), json::pretty(&manifest)?)?;
        if manifest.holds(&self.list(&name)?, &manifest.by) {
            return Ok(());
        }
        let at = PathBuf::from(format!("{}/{name}", self.name()));
        Err(ArchiveError::refused(&at, "was changed while its results were sent; run the batch again"))
    }
}

/// Length and SHA-256 of a file.
fn facts(file: &Path) -> Result<(u64, String), ArchiveError> {
    let bytes = fs::metadata(file).map_err(|error| ArchiveError::io(file, error))?.len();
    Ok((bytes, hash_file(file)?))
}
