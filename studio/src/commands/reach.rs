//! Shared by commands: taking a subject to a goal, and looking at paths.

use std::path::Path;

use serde_json::json;
use toile_capture::printable_path;
use toile_pipeline::{Goal, MotionChoice, Options, Remarks, Summary, process};

use crate::{StudioError, outcome::Answer, session::Session};

/// Takes one subject to a goal and says which files there are now.
pub(super) fn reach(subject: &Path, goal: Goal, options: &Options, session: &Session) -> Result<Answer, StudioError> {
    let summary = process(subject, goal, options, session.progress.as_ref())?;
    let text = summary.files.iter().map(|f| format!("{}\n", printable_path(f))).collect();
    answer(summary, text)
}

/// The answer to people and machines, from a summary.
fn answer(summary: Summary, text: String) -> Result<Answer, StudioError> {
    let Summary { layers, measurements, files, decided, remarks, notes } = summary;
    let files: Vec<String> = files.iter().map(|f| printable_path(f)).collect();
    let stages = decided.by_step()?;
    let results = json!({ "layers": layers, "measurements": measurements, "files": files, "stages": stages });
    let Remarks { mut warnings, lost, failures } = remarks;
    warnings.extend(notes);
    Ok(Answer { text, results, warnings, lost, failures })
}

/// Fails with a sentence where there is nothing at `path`.
pub(super) fn must_exist(path: &Path) -> Result<(), StudioError> {
    std::fs::metadata(path).map(drop).map_err(|e| StudioError::io(path, e))
}

/// True where `path` is the folder of a subject.
pub(super) fn is_subject(path: &Path) -> bool {
    path.join("subject.toml").is_file()
}

/// How the avatar moves: a file, `walk` for the shipped walk, or as before where nothing is said.
pub(super) fn motion_choice(motion: Option<&Path>) -> MotionChoice {
    match motion {
        None => MotionChoice::AsBefore,
        // A file of that name without an extension is not a motion that anybody writes.
        Some(path) if path == Path::new("walk") => MotionChoice::Walk,
        Some(path) => MotionChoice::File(path.to_path_buf()),
    }
}
