//! Subjects as the list of the archive shows them. Thousands must be quick: what was read of one is kept while its files
//! are the same.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::{SystemTime, UNIX_EPOCH},
};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_capture::Subject;
use toile_pipeline::{Folders, built, is_up_to_date};
use utoipa::ToSchema;

use super::{Archive, locks::Held};

/// How a subject stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// There is no take yet.
    Empty,
    /// There are takes, and nothing was made of them yet.
    Recorded,
    /// An avatar was made, but takes or edits are newer.
    Stale,
    /// The avatar is made of everything that is there.
    Processed,
    /// The last job on it failed.
    Failed,
    /// Somebody writes into its folder: a job, a capture, or another program.
    Busy,
    /// Its `subject.toml` cannot be read.
    Damaged,
}

/// A layer of a subject.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LayerName {
    /// Its name without the number.
    pub name: String,
    /// The type of the garment, where somebody said it.
    #[serde(rename = "type")]
    pub garment: Option<String>,
}

/// A subject in the list.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(example = json!({ "id": "anna", "name": "Anna", "date": "2026-11-29", "state": "processed",
    "layers": [{ "name": "body", "type": null }, { "name": "trousers", "type": "trousers" }], "takes": 2, "warnings": 0,
    "picture": "/api/subjects/anna/picture?v=1796000000", "modified": 1796000000.0, "problem": null }))]
pub struct Summary {
    /// The name of its folder.
    pub id: String,
    /// The subject's name.
    pub name: String,
    /// Date of the visit, `YYYY-MM-DD`.
    pub date: String,
    /// How it stands.
    pub state: State,
    /// The layers in their order.
    pub layers: Vec<LayerName>,
    /// How many takes there are.
    pub takes: usize,
    /// How many warnings, losses and failures the steps have said.
    pub warnings: usize,
    /// Where a picture of it is.
    pub picture: Option<String>,
    /// When anything of it changed last, Unix seconds.
    pub modified: f64,
    /// Why it is damaged.
    pub problem: Option<String>,
}

/// Times and sizes of the files that a summary follows from.
type Stamp = Vec<Option<(SystemTime, u64)>>;

/// Summaries that were made, with the stamps of their files.
#[derive(Default)]
pub struct Summaries(Mutex<BTreeMap<PathBuf, (Stamp, Summary)>>);

impl Summaries {
    /// All subjects of an archive. `failed` says of which the last job failed.
    pub fn all(&self, archive: &Archive, failed: &(dyn Fn(&str) -> bool + Sync)) -> Vec<Summary> {
        let held = Held::now();
        let ids = archive.subjects();
        ids.par_iter().map(|id| self.of(archive, id, &held, failed(id))).collect()
    }

    /// One subject.
    pub fn one(&self, archive: &Archive, id: &str, failed: bool) -> Summary {
        self.of(archive, id, &Held::now(), failed)
    }

    fn of(&self, archive: &Archive, id: &str, held: &Held, failed: bool) -> Summary {
        let path = archive.root().join(id);
        let stamp = stamp(&path);
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner).get(&path).cloned();
        let mut summary = match known {
            Some((was, summary)) if was == stamp => summary,
            _ => {
                let summary = read(&path, id);
                let entry = (stamp, summary.clone());
                self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(path.clone(), entry);
                summary
            }
        };
        if held.holds(&path) {
            summary.state = State::Busy;
        } else if failed && summary.state != State::Damaged {
            summary.state = State::Failed;
        }
        summary
    }
}

/// The files and folders whose times change whenever a summary does.
fn stamp(path: &Path) -> Stamp {
    let mut files: Vec<PathBuf> = ["", "subject.toml", "takes", "worn", "edits", "build", "avatar.glb", "report.html"]
        .map(|name| path.join(name))
        .into();
    let below = ["build", "edits", "takes", "worn"]
        .map(|folder| fs::read_dir(path.join(folder)).into_iter().flatten().flatten());
    files.extend(below.into_iter().flatten().map(|entry| entry.path()));
    let of = |path: &PathBuf| {
        let about = fs::symlink_metadata(path).ok()?;
        Some((about.modified().ok()?, about.len()))
    };
    files.iter().map(of).collect()
}

fn read(path: &Path, id: &str) -> Summary {
    let newest = stamp(path).into_iter().flatten().map(|(time, _)| time).max().unwrap_or(UNIX_EPOCH);
    let modified = newest.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
    let mut summary = Summary {
        id: id.into(),
        name: id.into(),
        date: String::new(),
        state: State::Damaged,
        layers: Vec::new(),
        takes: 0,
        warnings: 0,
        picture: None,
        modified,
        problem: None,
    };
    let subject = match Subject::open(path) {
        Ok(subject) => subject,
        Err(error) => return Summary { problem: Some(error.to_string()), ..summary },
    };
    summary.name = subject.name().into();
    summary.date = subject.date().into();
    let name = |layer: &toile_capture::Layer| LayerName { name: layer.name.clone(), garment: layer.garment.clone() };
    summary.layers = subject.layers().iter().map(name).collect();
    summary.takes = subject.layers().iter().filter(|layer| subject.take_path(layer).exists()).count();
    let records = built(path);
    let said = |b: &toile_pipeline::Built| b.record.warnings.len() + b.record.lost.len() + b.record.failures.len();
    summary.warnings = records.iter().map(said).sum::<usize>() + subject.remarks().len();
    let folders = Folders::new(path);
    let has_avatar = folders.glb().exists();
    summary.state = match (summary.layers.is_empty(), has_avatar) {
        (true, _) => State::Empty,
        (_, false) => State::Recorded,
        _ if is_newest(&folders) || is_up_to_date(path) => State::Processed,
        _ => State::Stale,
    };
    let has_scan = subject.layers().iter().any(|layer| folders.scan(&layer.label()).exists());
    summary.picture = (has_avatar || has_scan).then(|| format!("/api/subjects/{id}/picture?v={}", modified as u64));
    summary
}

/// True where avatar and page are at least as new as all takes, edits and garments: then nothing need be read.
fn is_newest(folders: &Folders) -> bool {
    let root = &folders.root;
    let made = [folders.glb(), folders.report()].map(|path| fs::metadata(path).and_then(|about| about.modified()).ok());
    let [Some(avatar), Some(report)] = made else { return false };
    let listed = |folder: PathBuf| fs::read_dir(folder).into_iter().flatten().flatten();
    let time = |path: &Path| fs::symlink_metadata(path).and_then(|about| about.modified()).ok();
    let given =
        ["takes", "worn", "edits"].into_iter().flat_map(|name| listed(root.join(name))).map(|entry| entry.path());
    let garments = listed(folders.build()).map(|entry| entry.path().join("garment.ply"));
    let inputs = given.chain(garments).chain([folders.subject_toml()]);
    inputs.filter_map(|path| time(&path)).all(|time| time <= avatar && time <= report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_follows_the_files() {
        let dir = tempfile::tempdir().unwrap();
        let archive = Archive::open(dir.path()).unwrap();
        let path = archive.create("anna", None).unwrap();
        let summaries = Summaries::default();
        let one = || summaries.one(&archive, "anna", false);
        assert_eq!((one().state, one().takes), (State::Empty, 0));
        fs::create_dir(path.join("takes")).unwrap();
        fs::write(path.join("takes/00-body.mcap"), "").unwrap();
        assert_eq!((one().state, one().takes), (State::Recorded, 1));
        assert_eq!(summaries.one(&archive, "anna", true).state, State::Failed);
        let lock = toile_capture::SubjectLock::acquire(&path).unwrap();
        assert_eq!(one().state, State::Busy);
        drop(lock);
        fs::write(path.join("subject.toml"), "name = 3").unwrap();
        let damaged = one();
        assert!(damaged.state == State::Damaged && damaged.problem.unwrap().contains("subject.toml"));
    }
}
