//! Errors of a run; every message is one sentence that names the problem, its place and the remedy.

use std::path::{Path, PathBuf};

use toile_animation::AnimationError;
use toile_avatar::AvatarError;
use toile_capture::CaptureError;
use toile_character::CharacterError;
use toile_fitting::FittingError;
use toile_fusion::FusionError;
use toile_garments::GarmentError;
use toile_geometry::GeometryError;
use toile_render::RenderError;
use toile_texture::TextureError;

/// Errors of a run.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's message.
        source: std::io::Error,
    },
    /// The disk has no room left.
    #[error("{path}: the disk is full; free some space and run the same command again (nothing half-written is left)")]
    DiskFull {
        /// The file that did not fit.
        path: PathBuf,
    },
    /// A file of the project's own is not what it should be.
    #[error("{path}: {}{reason}", .field.as_ref().map_or(String::new(), |f| format!("`{f}`: ")))]
    Format {
        /// The file.
        path: PathBuf,
        /// The field in it, where there is one: `stages.fuse.result.frames_seen`.
        field: Option<String>,
        /// The problem and the remedy.
        reason: String,
    },
    /// A stage could not give an answer.
    #[error("{path}: {source}")]
    Stage {
        /// The take, scan or file that the stage worked on.
        path: PathBuf,
        /// The stage's error.
        source: Cause,
    },
    /// Another run holds the subject.
    #[error("{path}: another toile is writing here; wait until it has ended and run the command again")]
    Busy {
        /// The subject's folder.
        path: PathBuf,
    },
    /// The subject has no such layer.
    #[error("{path} has no layer `{layer}`; it has {has}")]
    NoLayer {
        /// The subject's folder.
        path: PathBuf,
        /// The request.
        layer: String,
        /// The names that exist.
        has: String,
    },
    /// A value cannot be written as JSON.
    #[error("a value cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
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

/// Why a stage has no answer.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // a variant a crate
pub enum Cause {
    #[error(transparent)]
    Fusion(#[from] FusionError),
    #[error(transparent)]
    Texture(#[from] TextureError),
    #[error(transparent)]
    Fitting(#[from] FittingError),
    #[error(transparent)]
    Garments(#[from] GarmentError),
    #[error(transparent)]
    Animation(#[from] AnimationError),
    #[error(transparent)]
    Avatar(#[from] AvatarError),
    #[error(transparent)]
    Implicit(#[from] toile_implicit::ImplicitError),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Image(#[from] image::ImageError),
    /// The pipeline itself found the input unusable.
    #[error("{0}")]
    Refused(String),
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
    pub fn stage(path: &Path, source: impl Into<Cause>) -> Self {
        Self::Stage { path: path.to_path_buf(), source: source.into() }
    }

    /// A refusal of the pipeline itself at `path`.
    pub fn refused(path: &Path, reason: impl Into<String>) -> Self {
        Self::stage(path, Cause::Refused(reason.into()))
    }

    /// A format error at `path`.
    pub fn format(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self::Format { path: path.to_path_buf(), field: None, reason: reason.to_string() }
    }

    /// A format error in a field of the file `path`; an empty field is the whole file.
    pub fn field(path: &Path, field: &str, reason: impl std::fmt::Display) -> Self {
        let field = Some(field.to_string()).filter(|f| !f.is_empty());
        Self::Format { path: path.to_path_buf(), field, reason: reason.to_string() }
    }

    /// True where another program holds the subject.
    pub fn is_busy(&self) -> bool {
        matches!(self, Self::Busy { .. } | Self::Capture(CaptureError::Busy { .. }))
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
            Self::Json(_) => "json",
            Self::Capture(_) => "capture",
            Self::Geometry(_) => "geometry",
            Self::Character(_) => "character",
        }
    }

    /// The file or folder that it concerns.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Io { path, .. }
            | Self::DiskFull { path }
            | Self::Format { path, .. }
            | Self::Stage { path, .. }
            | Self::Busy { path }
            | Self::NoLayer { path, .. }
            | Self::Capture(CaptureError::Format { path, .. })
            | Self::Geometry(GeometryError::Format { path, .. }) => Some(path),
            _ => None,
        }
    }

    /// The field of that file, where it is known.
    pub fn field_name(&self) -> Option<&str> {
        match self {
            Self::Format { field, .. } | Self::Capture(CaptureError::Format { field, .. }) => field.as_deref(),
            _ => None,
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
