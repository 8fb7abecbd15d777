//! What a subject's results in a bucket were made of.

use std::{collections::BTreeMap, path::Path};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use toile_pipeline::{Options, hash_file, steps::STEPS};

use super::bucket::Object;
use crate::ArchiveError;

/// Its name in the subject.
pub(super) const NAME: &str = "toile-manifest.json";

/// Written last, removed first: while it is there, every file that it names is whole.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Manifest {
    /// Version of this format: 1.
    pub(super) version: u32,
    /// What the results were made by.
    pub(super) by: MadeBy,
    /// Length of what a person or a camera made, and the store's mark of it.
    pub(super) sources: BTreeMap<String, (u64, String)>,
    /// Every result.
    pub(super) results: BTreeMap<String, Sent>,
    /// Seconds of all steps, each as it ran last.
    pub(super) seconds: f64,
}

/// A result that was sent.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Sent {
    pub(super) bytes: u64,
    pub(super) sha256: String,
    /// The store's mark of it.
    pub(super) mark: String,
}

/// What decides results beside the sources.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct MadeBy {
    /// Name and version of the program.
    pub(super) program: String,
    /// The version of every step.
    pub(super) steps: BTreeMap<String, u32>,
    /// SHA-256 of the file of settings that the batch was given, or null.
    pub(super) given: Value,
}

impl MadeBy {
    /// This program with these options.
    pub(super) fn now(options: &Options) -> Result<Self, ArchiveError> {
        let given = match &options.settings {
            None => Value::Null,
            Some(file) => Value::String(hash_file(file)?),
        };
        Ok(Self {
            program: concat!("toile ", env!("CARGO_PKG_VERSION")).into(),
            steps: STEPS.iter().map(|step| (step.name.to_string(), step.version)).collect(),
            given,
        })
    }
}

impl Manifest {
    /// True where the objects of a subject are those that it names, made by the same.
    pub(super) fn holds(&self, objects: &BTreeMap<String, Object>, by: &MadeBy) -> bool {
        let is_there = |(path, sent): (&String, &Sent)| {
            objects.get(path).is_some_and(|object| object.stamp() == (sent.bytes, sent.mark.clone()))
        };
        self.version == 1
            && self.by == *by
            && self.sources == sources(objects)
            && self.results.iter().all(is_there)
            && objects.keys().filter(|path| is_result(path)).all(|path| self.results.contains_key(path))
    }
}

/// What of a subject decides its results: length and mark of each.
pub(super) fn sources(objects: &BTreeMap<String, Object>) -> BTreeMap<String, (u64, String)> {
    let is_source = |path: &String| !is_result(path) && path != NAME && !is_unused(path);
    objects.iter().filter(|(path, _)| is_source(path)).map(|(path, object)| (path.clone(), object.stamp())).collect()
}

/// True where a path in a subject is a result, which can be built again.
pub(super) fn is_result(path: &str) -> bool {
    let is_built = path.starts_with("build/") || path.starts_with("motion/");
    is_built || matches!(path, "avatar.glb" | "avatar.vrm" | "report.html")
}

/// True for what nothing is made of: takes that were replaced, and files that are not whole.
pub(super) fn is_unused(path: &str) -> bool {
    path.starts_with("takes/rejected/")
        || Path::new(path).extension().is_some_and(|e| e == "part")
        || path.starts_with('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn objects(marks: &[(&str, &str)]) -> BTreeMap<String, Object> {
        let object = |mark: &str| Object { bytes: 3, mark: format!("\"{mark}\"") };
        marks.iter().map(|(path, mark)| ((*path).to_string(), object(mark))).collect()
    }

    #[test]
    fn a_manifest_holds_while_nothing_is_replaced_added_or_gone() {
        let by = MadeBy::now(&Options::default()).unwrap();
        let made = [("subject.toml", "a"), ("takes/00-body.mcap", "b"), ("avatar.glb", "c"), (NAME, "x")];
        let sent = Sent { bytes: 3, sha256: String::new(), mark: "c".into() };
        let manifest = Manifest {
            version: 1,
            by: by.clone(),
            sources: sources(&objects(&made)),
            results: [("avatar.glb".to_string(), sent)].into(),
            seconds: 1.0,
        };
        assert!(manifest.holds(&objects(&made), &by));
        for (at, other) in [(0, ("subject.toml", "new")), (2, ("avatar.glb", "torn")), (2, ("build/more", "c"))] {
            let mut changed = made;
            changed[at] = other;
            assert!(!manifest.holds(&objects(&changed), &by), "{other:?}");
        }
        let older = MadeBy { program: "toile 0.0.1".into(), ..by.clone() };
        assert!(!manifest.holds(&objects(&made), &older));
        let with_retake = [&made[..], &[("takes/rejected/00-body.mcap", "r")]].concat();
        assert!(manifest.holds(&objects(&with_retake), &by));
    }
}
