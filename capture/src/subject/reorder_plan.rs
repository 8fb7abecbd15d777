//! `reorder.toml`: what is to be done to the names of a subject's takes and edits.

use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::about::parse_toml;
use crate::{
    CaptureError,
    files::{atomic_write, read_text},
};

/// The content of `reorder.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Plan {
    /// True once every file has moved aside.
    pub(super) set_aside: bool,
    /// The new text of `subject.toml`.
    pub(super) subject: String,
    /// Folders of `build/` that no longer belong to the take that they are called by.
    pub(super) outdated: Vec<String>,
    /// Files and folders by their paths in the subject's folder.
    #[serde(default)]
    pub(super) moves: Vec<Move>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Move {
    pub(super) from: String,
    pub(super) to: String,
}

/// True where a new order was begun and is not complete.
pub(super) fn is_reordering(folder: &Path) -> bool {
    plan_path(folder).is_file()
}

impl Plan {
    pub(super) fn read(folder: &Path) -> Result<Self, CaptureError> {
        let path = plan_path(folder);
        Self::parse(&read_text(&path)?).map_err(|reason| CaptureError::format(&path, reason))
    }

    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let plan: Self = parse_toml(text)?;
        let outside = plan.paths().find(|path| !is_inside(path)).map(str::to_string);
        outside.map_or(Ok(plan), |path| Err(format!("names `{path}`, which is not in the subject's folder")))
    }

    fn paths(&self) -> impl Iterator<Item = &str> {
        let moved = self.moves.iter().flat_map(|step| [&step.from, &step.to]);
        moved.chain(&self.outdated).map(String::as_str)
    }

    pub(super) fn write(&self, folder: &Path) -> Result<(), CaptureError> {
        let path = plan_path(folder);
        let text = toml::to_string(self).map_err(|error| CaptureError::format(&path, error.to_string()))?;
        atomic_write(&path, text.as_bytes())
    }
}

/// Where the plan stands.
pub(super) fn plan_path(folder: &Path) -> PathBuf {
    folder.join("reorder.toml")
}

fn is_inside(path: &str) -> bool {
    !path.is_empty() && Path::new(path).components().all(|part| matches!(part, Component::Normal(_)))
}
