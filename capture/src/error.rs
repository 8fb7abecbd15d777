//! Errors of capturing, recording and replaying.

use std::{io::ErrorKind, path::PathBuf};

use crate::printable::printable_path;

/// Errors of the capture crate.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// A file could not be read or written.
    #[error("{}: {source}", printable_path(path))]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's message.
        source: std::io::Error,
    },
    /// There is no room left for a file.
    #[error(
        "{}: the disk is full; free some space and run the command again (files that were complete before are untouched)",
        printable_path(path)
    )]
    DiskFull {
        /// The file that was being written.
        path: PathBuf,
    },
    /// A file or folder is not what its format says.
    #[error("{}: {}{reason}", printable_path(path), .field.as_ref().map_or(String::new(), |f| format!("field `{f}` ")))]
    Format {
        /// The file or folder.
        path: PathBuf,
        /// The field in it, where there is one: `color.fx`.
        field: Option<String>,
        /// The problem, its place, and the remedy.
        reason: String,
    },
    /// Another process writes the same subject or recording.
    #[error(
        "{}: another toile is writing here; wait until it has ended and run the command again",
        printable_path(path)
    )]
    Busy {
        /// The subject's folder, or the recording.
        path: PathBuf,
    },
    /// A frame cannot be used.
    #[error("frame {index}: {reason}")]
    Frame {
        /// Index of the frame in its source, from 0.
        index: u64,
        /// The problem.
        reason: String,
    },
    /// A device failed.
    #[error("{device}: {reason}")]
    Device {
        /// Which device.
        device: String,
        /// The problem and the remedy.
        reason: String,
    },
}

impl CaptureError {
    /// Wraps an I/O error with the path it concerns; a full disk (or quota) becomes [`Self::DiskFull`].
    pub fn io(path: &std::path::Path, source: std::io::Error) -> Self {
        match source.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
                Self::DiskFull { path: path.to_path_buf() }
            }
            _ => Self::Io { path: path.to_path_buf(), source },
        }
    }

    /// What is wrong, without the file: for errors of others that name the file themselves.
    pub fn reason(&self) -> String {
        match self {
            Self::Io { source, .. } => source.to_string(),
            Self::Format { reason, .. } => reason.clone(),
            other => other.to_string(),
        }
    }

    /// A format error at `path`.
    pub fn format(path: &std::path::Path, reason: impl Into<String>) -> Self {
        Self::Format { path: path.to_path_buf(), field: None, reason: reason.into() }
    }

    /// A format error in a field of the file `path`; `reason` goes on after the field's name.
    pub fn field(path: &std::path::Path, field: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Format { path: path.to_path_buf(), field: Some(field.into()), reason: reason.into() }
    }
}
