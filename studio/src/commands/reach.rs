//! What commands share: taking a subject to a goal, and looking at paths.

use std::path::Path;

use serde_json::json;

use toile_pipeline::{Goal, Options, Summary, process};

use crate::{StudioError, outcome::Answer, session::Session};

/// Takes one subject to a goal and tells which files there are now.
pub(super) fn reach(subject: &Path, goal: Goal, options: &Options, session: &Session) -> Result<Answer, StudioError> {
    let summary = process(subject, goal, options, session.progress.as_ref())?;
    let text = summary.files.iter().map(|f| format!("{f}\n")).collect();
    Ok(answer(summary, text))
}

/// What a summary is to people and machines.
pub(super) fn answer(summary: Summary, text: String) -> Answer {
    let stages: serde_json::Map<_, _> = summary.stages.iter().map(|(k, r)| (k.clone(), r.result.clone())).collect();
    let Summary { layers, measurements, files, warnings, lost, failures, .. } = summary;
    let results = json!({ "layers": layers, "measurements": measurements, "files": files, "stages": stages });
    Answer { text, results, warnings, lost, failures }
}

/// Fails with a sentence where there is nothing at `path`.
pub(super) fn must_exist(path: &Path) -> Result<(), StudioError> {
    std::fs::metadata(path).map(drop).map_err(|e| StudioError::io(path, e))
}

/// True where `path` is the folder of a subject.
pub(super) fn is_subject(path: &Path) -> bool {
    path.join("subject.toml").is_file()
}
