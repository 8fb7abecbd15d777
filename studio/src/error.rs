//! Errors of the program; every message is one sentence that names the problem, its place and the remedy.

use std::path::Path;

use toile_archive::ArchiveError;
use toile_capture::CaptureError;
use toile_character::CharacterError;
use toile_live::LiveError;
use toile_pipeline::PipelineError;
use toile_service::ServiceError;

/// Errors of the program.
#[derive(Debug, thiserror::Error)]
pub enum StudioError {
    /// The command line asks for something that makes no sense.
    #[error("{0}")]
    Usage(String),
    /// Ctrl-C cannot be watched.
    #[error("Ctrl-C cannot be watched: {0}")]
    Signal(std::io::Error),
    /// A device, its settings, or the permission to use it.
    #[error(transparent)]
    Live(LiveError),
    /// From an archive.
    #[error(transparent)]
    Archive(ArchiveError),
    /// The service cannot be opened.
    #[error(transparent)]
    Service(ServiceError),
    /// From a stage or its files.
    #[error(transparent)]
    Pipeline(PipelineError),
}

impl StudioError {
    /// Wraps an I/O error with the path it concerns; a full disk or quota gets its own sentence.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Pipeline(PipelineError::io(path, source))
    }

    /// A refusal of the program itself at `path`.
    pub fn refused(path: &Path, reason: impl Into<String>) -> Self {
        Self::Pipeline(PipelineError::refused(path, reason))
    }

    /// A format error at `path`.
    pub fn format(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self::Pipeline(PipelineError::format(path, reason))
    }

    /// A short name of the kind of error, for machines.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Usage(_) => "usage",
            Self::Signal(_) => "device",
            Self::Live(error) => error.kind(),
            Self::Archive(_) => "archive",
            Self::Service(_) => "service",
            Self::Pipeline(error) => error.kind(),
        }
    }

    /// The file that it concerns, where there is one.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Pipeline(error) => error.file(),
            Self::Live(error) => error.file(),
            Self::Archive(ArchiveError::Refused { path, .. } | ArchiveError::Catalog { path, .. }) => Some(path),
            Self::Usage(_) | Self::Signal(_) | Self::Archive(_) | Self::Service(_) => None,
        }
    }

    /// The field of that file, where it is known.
    pub fn field(&self) -> Option<&str> {
        match self {
            Self::Pipeline(error) => error.field_name(),
            Self::Usage(_) | Self::Signal(_) | Self::Live(_) | Self::Archive(_) | Self::Service(_) => None,
        }
    }
}

impl From<PipelineError> for StudioError {
    fn from(error: PipelineError) -> Self {
        match error {
            PipelineError::NoLayer { .. } => Self::Usage(error.to_string()),
            other => Self::Pipeline(other),
        }
    }
}

impl From<ArchiveError> for StudioError {
    fn from(error: ArchiveError) -> Self {
        match error {
            ArchiveError::Pipeline(error) => error.into(),
            other => Self::Archive(other),
        }
    }
}

impl From<LiveError> for StudioError {
    fn from(error: LiveError) -> Self {
        match error {
            LiveError::Usage(reason) => Self::Usage(reason),
            LiveError::Capture(error) => error.into(),
            other => Self::Live(other),
        }
    }
}

impl From<CaptureError> for StudioError {
    fn from(error: CaptureError) -> Self {
        Self::Pipeline(error.into())
    }
}

impl From<CharacterError> for StudioError {
    fn from(error: CharacterError) -> Self {
        Self::Pipeline(error.into())
    }
}
