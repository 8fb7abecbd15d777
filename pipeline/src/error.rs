//! What can go wrong in a run; every message is one sentence that says what, where and what to do.

use std::path::{Path, PathBuf};

use toile_capture::CaptureError;
use toile_character::CharacterError;
use toile_geometry::GeometryError;

/// Errors of a run.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The disk has no room left.
    #[error(
        "{path}: no room left on the disk; free some space and run the same command again (nothing half-written is left)"
    )]
    DiskFull {
        /// The file that did not fit.
        path: PathBuf,
    },
    /// A file of the project's own is not what it should be.
    #[error("{path}: {reason}")]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        reason: String,
    },
    /// A stage could not give an answer.
    #[error("{path}: {reason}")]
    Stage {
        /// The take, scan or file that the stage worked on.
        path: PathBuf,
        /// What is wrong and what to do.
        reason: String,
    },
    /// The subject has no such layer.
    #[error("{path} has no layer `{layer}`; it has {has}")]
    NoLayer {
        /// The subject's folder.
        path: PathBuf,
        /// What was asked for.
        layer: String,
        /// What there is.
        has: String,
    },
    /// Another run holds the subject.
    #[error("{path}: another toile works on this subject; wait for it to end")]
    Busy {
        /// The subject's folder.
        path: PathBuf,
    },
    /// From the recordings.
    #[error(transparent)]
    Capture(CaptureError),
    /// From meshes and their files.
    #[error(transparent)]
    Geometry(GeometryError),
    /// From the body asset.
    #[error(transparent)]
    Character(#[from] CharacterError),
}

impl PipelineError {
    /// Wraps an I/O error with the path it concerns; a full disk or quota gets its own sentence.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        match source.kind() {
            StorageFull | QuotaExceeded | FileTooLarge => Self::DiskFull { path: path.to_path_buf() },
            _ => Self::Io { path: path.to_path_buf(), source },
        }
    }

    /// A stage's error at `path`.
    pub fn stage(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self::Stage { path: path.to_path_buf(), reason: reason.to_string() }
    }

    /// A format error at `path`.
    pub fn format(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self::Format { path: path.to_path_buf(), reason: reason.to_string() }
    }

    /// A short name of the kind of error, for machines.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::NoLayer { .. } => "usage",
            Self::Io { .. } => "io",
            Self::DiskFull { .. } => "disk-full",
            Self::Format { .. } => "format",
            Self::Stage { .. } => "stage",
            Self::Busy { .. } => "busy",
            Self::Capture(_) => "capture",
            Self::Geometry(_) => "geometry",
            Self::Character(_) => "character",
        }
    }
}

impl From<CaptureError> for PipelineError {
    fn from(error: CaptureError) -> Self {
        match error {
            CaptureError::Io { path, source } => Self::io(&path, source),
            CaptureError::DiskFull { path } => Self::DiskFull { path },
            CaptureError::Busy { path } => Self::Busy { path },
            other => Self::Capture(other),
        }
    }
}

impl From<GeometryError> for PipelineError {
    fn from(error: GeometryError) -> Self {
        match error {
            GeometryError::Io { path, source } => Self::io(&path, source),
            other => Self::Geometry(other),
        }
    }
}
