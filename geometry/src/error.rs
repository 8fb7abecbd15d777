//! Errors of geometry and its files.

use std::path::PathBuf;

/// Errors of the geometry crate.
#[derive(Debug, thiserror::Error)]
pub enum GeometryError {
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file is not what its format says.
    #[error("{path}: {reason}")]
    Format {
        /// The file.
        path: PathBuf,
        /// The reason and the place.
        reason: String,
    },
    /// A mesh breaks its own rules.
    #[error("mesh: {0}")]
    Mesh(String),
}

impl GeometryError {
    /// Wraps an I/O error with the path it concerns.
    pub fn io(path: &std::path::Path, source: std::io::Error) -> Self {
        Self::Io { path: path.to_path_buf(), source }
    }

    /// A format error at `path`.
    pub fn format(path: &std::path::Path, reason: impl Into<String>) -> Self {
        Self::Format { path: path.to_path_buf(), reason: reason.into() }
    }
}
