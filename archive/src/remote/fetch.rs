//! From a bucket into the cache.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use rayon::prelude::*;
use toile_capture::{Subject, files::atomic_write};
use toile_pipeline::{hash_file, json};

use super::{
    bucket::{Bucket, Object},
    manifest::{Manifest, NAME, is_result, is_unused},
    subject::RemoteSubject,
};
use crate::{ArchiveError, keep::inside, state};

/// What the cache notes of a file that it fetched: length and mark. It lies beside the subjects, in the cache's `.toile/`.
type Notes = BTreeMap<String, (u64, String)>;

/// A subject on its way into the cache.
struct Fetching<'a> {
    bucket: &'a Bucket,
    name: String,
    root: PathBuf,
    manifest: Option<Manifest>,
    before: Notes,
}

impl Bucket {
    /// Brings a subject into the cache. What is there already is not fetched again; nothing is fetched of a person who withdrew
    /// consent but `subject.toml`, which says so.
    ///
    /// # Errors
    /// [`ArchiveError`] where the store does not answer, or the cache cannot be written.
    pub fn fetch(&self, subject: &RemoteSubject, cache: &Path) -> Result<(), ArchiveError> {
        let name = subject.subject.to_string_lossy().into_owned();
        let Some(root) = inside(cache, &name) else {
            let at = PathBuf::from(format!("{}/{name}", self.name()));
            return Err(ArchiveError::refused(&at, "leads out of the cache; rename it"));
        };
        let noted = notes(cache, &subject.subject);
        let before = json::read(&noted).unwrap_or_default();
        let fetching = Fetching { bucket: self, manifest: self.manifest(&name)?, name, root, before };
        let (first, rest): (Vec<_>, Vec<_>) = subject
            .objects
            .iter()
            .filter(|(path, _)| fetching.is_wanted(path))
            .partition(|(path, _)| *path == "subject.toml");
        let mut now: Notes = first.into_iter().map(|file| fetching.file(file)).collect::<Result<_, _>>()?;
        if Subject::open(&fetching.root).is_ok_and(|subject| subject.withheld().is_none()) {
            let fetched =
                self.side_by_side(|| rest.into_par_iter().map(|file| fetching.file(file)).collect::<Vec<_>>());
            now.extend(fetched.into_iter().collect::<Result<Vec<_>, _>>()?);
        }
        fetching.remove_others(&now)?;
        Ok(atomic_write(&noted, &json::pretty(&now)?)?)
    }
}

impl Bucket {
    /// Brings the files of a subject that are meant into the folder `root`.
    pub(crate) fn fetch_some(
        &self,
        subject: &RemoteSubject,
        root: &Path,
        is_meant: impl Fn(&str) -> bool,
    ) -> Result<(), ArchiveError> {
        let name = subject.subject.to_string_lossy();
        subject.objects.iter().filter(|(path, _)| is_meant(path)).try_for_each(|(path, object)| {
            let Some(file) = inside(root, path) else { return Ok(()) };
            self.fetch_object(&format!("{name}/{path}"), object, &file)
        })
    }
}

impl Fetching<'_> {
    /// Results without a manifest were being written when somebody died: they are made again.
    fn is_wanted(&self, path: &str) -> bool {
        let is_whole = || self.manifest.as_ref().is_some_and(|manifest| manifest.results.contains_key(path));
        path != NAME && !is_unused(path) && inside(&self.root, path).is_some() && (!is_result(path) || is_whole())
    }

    /// One file, where it is not there yet.
    fn file(&self, (path, object): (&String, &Object)) -> Result<(String, (u64, String)), ArchiveError> {
        let (file, note) = (self.root.join(path), object.stamp());
        let is_here = fs::metadata(&file).is_ok_and(|found| found.len() == object.bytes);
        if !(is_here && self.before.get(path) == Some(&note)) {
            self.bucket.fetch_object(&format!("{}/{path}", self.name), object, &file)?;
        }
        let sent = self.manifest.as_ref().and_then(|manifest| manifest.results.get(path));
        if let Some(sent) = sent
            && hash_file(&file)? != sent.sha256
        {
            // Made by another batch since the manifest was read, or damaged: it is made again.
            fs::remove_file(&file).map_err(|error| ArchiveError::io(&file, error))?;
        }
        Ok((path.clone(), note))
    }

    /// Removes what lies in the cache of sources that are no more in the bucket: a take that was taken back must not be processed.
    fn remove_others(&self, now: &Notes) -> Result<(), ArchiveError> {
        let gone = |path: &String| !is_result(path) && !is_unused(path) && !now.contains_key(path);
        crate::keep::list(&self.root)?.into_iter().filter(gone).try_for_each(|path| {
            let file = self.root.join(path);
            fs::remove_file(&file).map_err(|error| ArchiveError::io(&file, error))
        })
    }
}

/// Removes a subject from the cache.
pub(super) fn evict(cache: &Path, subject: &Path) -> Result<(), ArchiveError> {
    let root = cache.join(subject);
    drop(fs::remove_file(notes(cache, subject)));
    match fs::remove_dir_all(&root) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(ArchiveError::io(&root, error)),
        _ => Ok(()),
    }
}

/// Where the cache notes what it fetched of a subject.
pub(super) fn notes(cache: &Path, subject: &Path) -> PathBuf {
    state::folder(cache).join("fetched").join(format!("{}.json", state::file_name(subject)))
}
