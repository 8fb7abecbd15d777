//! The subjects below a prefix, and how their results stand.

use std::{collections::BTreeMap, path::PathBuf};

use rayon::prelude::*;
use serde::Serialize;
use toile_pipeline::{Options, steps::STEPS};

use super::{
    bucket::{Bucket, Object},
    manifest::{MadeBy, Manifest, NAME, is_result, is_unused},
};
use crate::ArchiveError;

/// A subject in a bucket.
#[derive(Debug, Clone, Serialize)]
pub struct RemoteSubject {
    /// Its path below the prefix.
    pub subject: PathBuf,
    /// True where its results are of these takes, this program and these settings.
    pub up_to_date: bool,
    /// Length of all its files, bytes.
    pub bytes: u64,
    /// What processing it took the last time, or takes usually, seconds.
    pub seconds: f64,
    #[serde(skip)]
    pub(super) objects: BTreeMap<String, Object>,
}

impl Bucket {
    /// The subjects below the prefix in the order of their names, from one listing and one manifest a subject.
    ///
    /// # Errors
    /// [`ArchiveError`] where the store does not answer or does not allow it, or the prefix is a subject itself.
    pub fn subjects(&self, options: &Options) -> Result<Vec<RemoteSubject>, ArchiveError> {
        let by = MadeBy::now(options)?;
        let all = self.list("")?;
        if all.contains_key("subject.toml") {
            let reason = "is a subject itself; give the prefix that holds it";
            return Err(ArchiveError::refused(&PathBuf::from(self.name()), reason));
        }
        let found = by_subject(all);
        self.side_by_side(|| found.into_par_iter().map(|(name, objects)| self.stands(name, objects, &by)).collect())
    }

    fn stands(
        &self,
        name: String,
        objects: BTreeMap<String, Object>,
        by: &MadeBy,
    ) -> Result<RemoteSubject, ArchiveError> {
        let manifest = if objects.contains_key(NAME) { self.manifest(&name)? } else { None };
        let bytes = objects.values().map(|object| object.bytes).sum();
        let usual = || STEPS.iter().map(|step| step.seconds).sum();
        Ok(RemoteSubject {
            subject: name.into(),
            up_to_date: manifest.as_ref().is_some_and(|manifest| manifest.holds(&objects, by)),
            bytes,
            seconds: manifest.map_or_else(usual, |manifest| manifest.seconds),
            objects,
        })
    }

    /// The subject as it is now: another batch may have done it since.
    pub(super) fn look_again(&self, subject: &RemoteSubject, options: &Options) -> Result<RemoteSubject, ArchiveError> {
        let name = subject.subject.to_string_lossy().into_owned();
        let objects = self.list(&name)?;
        self.stands(name, objects, &MadeBy::now(options)?)
    }

    /// The manifest of a subject. One that cannot be read counts as none: the results are made again.
    pub(super) fn manifest(&self, name: &str) -> Result<Option<Manifest>, ArchiveError> {
        let bytes = self.read(&format!("{name}/{NAME}"))?;
        Ok(bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok()))
    }
}

impl RemoteSubject {
    /// Length of all files whose paths begin so, bytes.
    pub(crate) fn bytes_of(&self, begin: &str) -> u64 {
        self.objects.iter().filter(|(path, _)| path.starts_with(begin)).map(|(_, object)| object.bytes).sum()
    }

    /// Names and marks of the files that are meant: the same, the same content.
    pub(crate) fn stamps(&self, is_meant: impl Fn(&str) -> bool) -> String {
        let meant = self.objects.iter().filter(|(path, _)| is_meant(path));
        meant.map(|(path, object)| format!("{path} {:?}\n", object.stamp())).collect()
    }

    /// Room that it needs in the cache, bytes: what is fetched, and results. Results were measured to be 2.0 to 2.3 times as
    /// large as the takes (four takes of 100 frames; a person of 225 MB).
    pub(super) fn room(&self) -> u64 {
        let used = self.objects.iter().filter(|(path, _)| !is_unused(path) && !is_result(path));
        let results: u64 = self.objects.iter().filter(|(path, _)| is_result(path)).map(|(_, o)| o.bytes).sum();
        let sources: u64 = used.map(|(_, object)| object.bytes).sum();
        sources + results.max(sources * 5 / 2)
    }
}

/// The objects of each subject by their paths in it. A subject is where `subject.toml` lies; one inside another belongs to that.
fn by_subject(all: BTreeMap<String, Object>) -> BTreeMap<String, BTreeMap<String, Object>> {
    let mut names: Vec<String> =
        all.keys().filter_map(|path| path.strip_suffix("/subject.toml")).map(String::from).collect();
    let is_hidden = |name: &String| name.split('/').any(|part| part.starts_with('.'));
    names.retain(|name| !is_hidden(name));
    let mut found: BTreeMap<String, BTreeMap<String, Object>> =
        names.into_iter().map(|name| (name, BTreeMap::new())).collect();
    for (path, object) in all {
        // The outermost folder that is a subject: shorter paths come first.
        let cuts = path.match_indices('/').map(|(at, _)| at);
        let owner = cuts.map(|at| (&path[..at], &path[at + 1..])).find(|(name, _)| found.contains_key(*name));
        if let Some((name, inside)) = owner
            && let Some(objects) = found.get_mut(name)
        {
            objects.insert(inside.to_string(), object);
        }
    }
    found.retain(|_, objects| objects.contains_key("subject.toml"));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_belong_to_the_outermost_subject() {
        let paths = [
            "a/subject.toml",
            "a/takes/00-body.mcap",
            "a/takes/inner/subject.toml",
            "2026/b/subject.toml",
            "ab/takes/x",
            "readme",
            ".toile/c/subject.toml",
        ];
        let all = paths.iter().map(|path| ((*path).to_string(), Object { bytes: 1, mark: String::new() })).collect();
        let found = by_subject(all);
        let shape: Vec<(&str, usize)> = found.iter().map(|(name, objects)| (name.as_str(), objects.len())).collect();
        assert_eq!(shape, [("2026/b", 1), ("a", 3)]);
    }
}
