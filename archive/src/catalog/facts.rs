//! What the catalogue knows of a subject, read from its small files.

use std::{
    fs,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
};

use serde_json::Value;
use toile_capture::Subject;
use toile_pipeline::{Folders, Options, Plan, json, plan};

use crate::ArchiveError;

/// A subject, as the catalogue lists it.
#[derive(Debug)]
pub(super) struct Facts {
    pub(super) subject: Subject,
    pub(super) plan: Plan,
    pub(super) takes: Vec<TakeFacts>,
    pub(super) steps: Vec<StepFacts>,
    /// Those of ISO 8559-1, as the fit wrote them.
    pub(super) measures: Vec<Value>,
}

#[derive(Debug)]
pub(super) struct TakeFacts {
    pub(super) number: usize,
    pub(super) layer: String,
    pub(super) garment: Option<String>,
    pub(super) bytes: u64,
}

/// What one step left: its record, and its times.
#[derive(Debug)]
pub(super) struct StepFacts {
    pub(super) folder: String,
    pub(super) step: String,
    pub(super) program: String,
    pub(super) record: Value,
    pub(super) times: Value,
}

impl Facts {
    /// Of the subject at `root`.
    pub(super) fn read(root: &Path) -> Result<Self, ArchiveError> {
        let subject = Subject::open(root)?;
        let plan = plan(root, &Options::default())?;
        let take = |layer: &toile_capture::Layer| TakeFacts {
            number: layer.number,
            layer: layer.label(),
            garment: layer.garment.clone(),
            bytes: size(&subject.take_path(layer)),
        };
        let takes = subject.layers().iter().map(take).collect();
        let folders = Folders::new(root);
        let steps = folders_in(&folders.build()).iter().flat_map(|folder| steps_of(folder)).collect();
        let mut table: Value = json::read(&folders.measurements()).unwrap_or_default();
        let measures = table.get_mut("measures").and_then(Value::as_array_mut).map(std::mem::take).unwrap_or_default();
        Ok(Self { plan, takes, steps, measures, subject })
    }

    /// The verdict of the fit, and whether the body was estimated under clothes.
    pub(super) fn fit(&self) -> (Option<&str>, Option<bool>) {
        let fit = self.steps.iter().find(|step| step.step == "fit").map(|step| &step.record["result"]);
        (fit.and_then(|fit| fit["verdict"].as_str()), fit.and_then(|fit| fit["estimated"].as_bool()))
    }
}

/// Names, sizes and times of the files that [`Facts`] are read from; the same stamp, the same facts.
pub(super) fn stamp(root: &Path) -> String {
    let files = ["subject.toml", "toile.toml", "takes", "worn", "edits", "build", "build/timings.json"]
        .map(|name| root.join(name));
    let reports = folders_in(&root.join("build")).into_iter().map(|folder| folder.join("report.json"));
    let stamps = files.into_iter().chain(reports).map(|path| {
        let found =
            fs::metadata(&path).map(|found| (found.size(), found.mtime(), found.mtime_nsec())).unwrap_or_default();
        format!("{}.{}.{}", found.0, found.1, found.2)
    });
    stamps.collect::<Vec<_>>().join(" ")
}

fn steps_of(folder: &Path) -> Vec<StepFacts> {
    let report: Value = json::read(&folder.join("report.json")).unwrap_or_default();
    let times: Value = json::read(&folder.join("timings.json")).unwrap_or_default();
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let program = report["program"].as_str().unwrap_or_default().to_string();
    let stages = report["stages"].as_object().cloned().unwrap_or_default();
    let fact = |(step, record): (String, Value)| StepFacts {
        folder: name.clone(),
        program: program.clone(),
        times: times[&step].clone(),
        step,
        record,
    };
    stages.into_iter().map(fact).collect()
}

fn folders_in(build: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(build).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    found.sort();
    found
}

/// Bytes of a file, or of all files in a folder.
fn size(path: &Path) -> u64 {
    let Ok(found) = fs::metadata(path) else { return 0 };
    if found.is_file() {
        return found.len();
    }
    fs::read_dir(path)
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|entry| entry.metadata().ok())
        .map(|file| file.len())
        .sum()
}
