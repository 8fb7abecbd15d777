//! What was built of a subject, read without building anything: the records of all steps, and whether they still hold.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde_json::Value;
use toile_capture::{Subject, files::is_there};

use crate::{Folders, Record, hash, record, step::Step, steps::cut::Cut};

/// The record of one step in one folder of `build/`.
#[derive(Debug, Clone)]
pub struct Built {
    /// Name of the folder, such as `01-trousers`, `body` or `avatar`.
    pub folder: String,
    /// Name of the step, such as `cut`.
    pub step: String,
    /// Its record, the decisions as JSON.
    pub record: Record<Value>,
}

/// The records of all steps that worked for the subject at `root`, by folder and step. Records that were changed since
/// count as none.
pub fn built(root: &Path) -> Vec<Built> {
    let folders = std::fs::read_dir(Folders::new(root).build()).into_iter().flatten().flatten();
    let mut all = Vec::new();
    for folder in folders.filter(|entry| entry.path().is_dir()) {
        let name = folder.file_name().to_string_lossy().into_owned();
        let records = record::all_in(&folder.path()).into_iter();
        all.extend(records.map(|(step, record)| Built { folder: name.clone(), step, record }));
    }
    all.sort_by(|a, b| (&a.folder, &a.step).cmp(&(&b.folder, &b.step)));
    all
}

/// True where nothing that the steps of a subject read has changed since, no take lacks its scan, and no edit by hand waits
/// to be applied. Every input is read and hashed once.
pub fn is_up_to_date(root: &Path) -> bool {
    let (folders, all) = (Folders::new(root), built(root));
    let Ok(subject) = Subject::open(root) else { return false };
    let has = |folder: &str, step: &str| all.iter().any(|b| b.folder == folder && b.step == step);
    let is_built = subject.layers().iter().all(|layer| {
        let (label, edits) = (layer.label(), folders.edits(&layer.label()));
        let applied = |b: &Built| b.record.inputs.keys().any(|input| root.join(input) == edits);
        let is_applied = || all.iter().any(|b| b.folder == label && b.step == Cut::NAME && applied(b));
        (has(&label, "fuse") || has(&label, "read")) && (!is_there(&edits) || is_applied())
    });
    is_built && inputs_hold(root, &all)
}

fn inputs_hold(root: &Path, all: &[Built]) -> bool {
    let mut known: BTreeMap<PathBuf, Option<String>> = BTreeMap::new();
    let inputs = all.iter().flat_map(|b| &b.record.inputs);
    inputs.into_iter().all(|(path, was)| {
        let path = root.join(path);
        let now = known.entry(path.clone()).or_insert_with(|| hash::file(&path).ok());
        // Files from elsewhere, such as settings, are named without their folder.
        now.is_none() && !is_there(&path) && path.parent() == Some(root) || now.as_ref() == Some(was)
    })
}
