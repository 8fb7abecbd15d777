//! A take that is being recorded, and the note of it on disk.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{about::parse_toml, layer::Layer, scan_take::EXTENSION};
use crate::{
    CaptureError,
    files::{atomic_write, read_text},
};

/// A take that is being recorded; [`LockedSubject::accept`](super::LockedSubject::accept) makes it part of the subject.
#[derive(Debug, Clone, PartialEq)]
pub struct PendingTake {
    /// The layer it will be.
    pub layer: Layer,
    /// Where to record to.
    pub path: PathBuf,
    /// The name of the rig; entered into `subject.toml` where that names none yet.
    pub rig: String,
    /// Where the frames come from (an imported folder); empty for cameras.
    pub source: String,
    pub(super) retake: bool,
}

impl PendingTake {
    /// The same, for a finished scan instead of a recording: its path is a folder.
    pub fn of_scan(mut self) -> Self {
        self.path.set_extension(EXTENSION);
        self
    }
}

/// The content of `pending.toml`: enough to enter the take into `subject.toml` when the program was killed before it could.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Note {
    pub(super) number: usize,
    pub(super) retake: bool,
    pub(super) rig: String,
    pub(super) source: String,
    pub(super) layer: Layer,
}

impl Note {
    pub(super) fn of(take: &PendingTake) -> Self {
        Self {
            number: take.layer.number,
            retake: take.retake,
            rig: take.rig.clone(),
            source: take.source.clone(),
            layer: take.layer.clone(),
        }
    }

    /// The note in a subject's folder; `None` where there is none or it cannot be used.
    pub(super) fn read(folder: &Path) -> Option<Self> {
        let text = read_text(&note_path(folder)).ok()?;
        let mut note: Self = parse_toml(&text).ok()?;
        note.layer.number = note.number;
        Some(note)
    }

    pub(super) fn write(&self, folder: &Path) -> Result<(), CaptureError> {
        let path = note_path(folder);
        let text = toml::to_string(self).map_err(|error| CaptureError::format(&path, error.to_string()))?;
        atomic_write(&path, text.as_bytes())
    }

    pub(super) fn remove(folder: &Path) -> Result<(), CaptureError> {
        let path = note_path(folder);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(CaptureError::io(&path, error)),
            _ => Ok(()),
        }
    }
}

fn note_path(folder: &Path) -> PathBuf {
    folder.join("pending.toml")
}
