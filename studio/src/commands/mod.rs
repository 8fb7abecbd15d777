//! The commands, a file each: what it takes, what it calls, what it tells.

pub mod capture;
pub mod completions;
pub mod demo;
pub mod devices;
pub mod edit;
pub mod export;
pub mod extract;
pub mod fit;
pub mod fuse;
pub mod import;
pub mod inspect;
pub mod measure;
pub mod process;
pub mod synthesize;

use std::path::Path;

use serde_json::json;

use crate::{
    StudioError,
    outcome::Answer,
    pipeline::{self, Goal, Options, Summary},
    run::Session,
};

/// Takes one subject to a goal and tells which files there are now.
fn reach(subject: &Path, goal: Goal, options: &Options, session: &Session) -> Result<Answer, StudioError> {
    let summary = pipeline::process(subject, goal, options, &session.progress)?;
    let text = summary.files.iter().map(|f| format!("{f}\n")).collect();
    Ok(answer(summary, text))
}

/// What a summary is to people and machines.
fn answer(summary: Summary, text: String) -> Answer {
    let stages: serde_json::Map<_, _> = summary.stages.iter().map(|(k, r)| (k.clone(), r.result.clone())).collect();
    let Summary { layers, measurements, files, warnings, lost, failures, .. } = summary;
    let results = json!({ "layers": layers, "measurements": measurements, "files": files, "stages": stages });
    Answer { text, results, warnings, lost, failures }
}

/// Fails with a sentence where there is nothing at `path`.
fn must_exist(path: &Path) -> Result<(), StudioError> {
    std::fs::metadata(path).map(drop).map_err(|e| StudioError::io(path, e))
}

/// True where `path` is the folder of a subject.
fn is_subject(path: &Path) -> bool {
    path.join("subject.toml").is_file()
}
