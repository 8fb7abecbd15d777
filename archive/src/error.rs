//! Errors of archives; every message is one sentence that names the problem, its place and the remedy.

use std::path::{Path, PathBuf};

use toile_capture::CaptureError;
use toile_pipeline::PipelineError;

/// Errors of archives.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveError {
    /// Something in the archive is not what it should be, or may not be done.
    #[error("{path}: {reason}")]
    Refused {
        /// The archive, the subject or the file.
        path: PathBuf,
        /// The problem and the remedy.
        reason: String,
    },
    /// The catalogue's file.
    #[error("{path}: {source}; `toile catalog --rebuild` makes it anew from the archive")]
    Catalog {
        /// The SQLite file.
        path: PathBuf,
        /// What SQLite says.
        source: rusqlite::Error,
    },
    /// From a subject.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
}

impl ArchiveError {
    /// A refusal at `path`.
    pub fn refused(path: &Path, reason: impl Into<String>) -> Self {
        Self::Refused { path: path.to_path_buf(), reason: reason.into() }
    }

    /// Wraps an I/O error with the path it concerns.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Pipeline(PipelineError::io(path, source))
    }

    /// True where there is no room on the disk.
    pub fn is_full_disk(&self) -> bool {
        matches!(self, Self::Pipeline(error) if error.kind() == "disk-full")
    }
}

impl From<CaptureError> for ArchiveError {
    fn from(error: CaptureError) -> Self {
        Self::Pipeline(error.into())
    }
}
