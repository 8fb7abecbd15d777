//! Errors: why a service cannot be opened, and how a request is refused.

use std::{io, net::SocketAddr, path::PathBuf};

use axum::{
    Json,
    http::StatusCode,
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize};
use toile_capture::{CaptureError, printable_path};
use toile_live::LiveError;
use toile_pipeline::PipelineError;
use utoipa::ToSchema;

/// Why the service cannot be opened; every message is one sentence.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The archive is no folder.
    #[error("{}: is not a folder; give the folder that holds the subjects, or the path of a new one", printable_path(.0))]
    NotAFolder(PathBuf),
    /// The archive cannot be made or written.
    #[error("{}: cannot be written ({source}); give a folder that you may write to", printable_path(path))]
    NoPermission {
        /// The archive.
        path: PathBuf,
        /// The system's message.
        source: io::Error,
    },
    /// Another service has the archive.
    #[error("{}: another `toile serve` works on this archive; use that one, or end it first", printable_path(.0))]
    InUse(PathBuf),
    /// The file of the queue.
    #[error(
        "{}: the queue of jobs cannot be read ({reason}); move the file away to begin with an empty one",
        printable_path(path)
    )]
    Queue {
        /// The database.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The address cannot be listened on.
    #[error("{address}: {reason}")]
    Address {
        /// Where it was to listen.
        address: SocketAddr,
        /// The problem and the remedy.
        reason: String,
    },
    /// Certificate or key.
    #[error("{}: {reason}", printable_path(path))]
    Tls {
        /// The file.
        path: PathBuf,
        /// The problem and the remedy.
        reason: String,
    },
    /// The system gives no threads, or no random numbers.
    #[error("the service cannot start: {0}")]
    System(#[from] io::Error),
}

/// What a refused request is answered with: one sentence.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[schema(example = json!({ "error": "anna: another toile is writing here; wait until it has ended and run the command again" }))]
pub struct Told {
    /// What is wrong, where, and what to do.
    pub error: String,
}

/// A refused request: its status and its sentence.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// The status of the answer.
    pub status: StatusCode,
    /// What is wrong, where, and what to do.
    pub sentence: String,
}

impl Refusal {
    /// A refusal with `status`.
    pub fn new(status: StatusCode, sentence: impl Into<String>) -> Self {
        Self { status, sentence: sentence.into() }
    }

    /// 400: the request is malformed.
    pub fn malformed(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, sentence)
    }

    /// 404: there is no such thing.
    pub fn missing(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, sentence)
    }

    /// 409: not now.
    pub fn conflict(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, sentence)
    }

    /// 422: the content cannot be used.
    pub fn unusable(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, sentence)
    }

    /// 500: a failure of ours or of the disk.
    pub fn failure(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, sentence)
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        if self.status.is_server_error() {
            tracing::error!("{}", self.sentence);
        }
        (self.status, Json(Told { error: self.sentence })).into_response()
    }
}

impl From<CaptureError> for Refusal {
    fn from(error: CaptureError) -> Self {
        let status = match &error {
            CaptureError::Busy { .. } => StatusCode::CONFLICT,
            CaptureError::DiskFull { .. } => StatusCode::INSUFFICIENT_STORAGE,
            CaptureError::Io { source, .. } if source.kind() == io::ErrorKind::NotFound => StatusCode::NOT_FOUND,
            CaptureError::Io { .. } => StatusCode::INTERNAL_SERVER_ERROR,
            _ => StatusCode::UNPROCESSABLE_ENTITY,
        };
        Self::new(status, error.to_string())
    }
}

impl From<LiveError> for Refusal {
    fn from(error: LiveError) -> Self {
        match error {
            LiveError::Capture(error) => error.into(),
            other => Self::unusable(other.to_string()),
        }
    }
}

impl From<PipelineError> for Refusal {
    fn from(error: PipelineError) -> Self {
        let status = if error.is_busy() { StatusCode::CONFLICT } else { StatusCode::UNPROCESSABLE_ENTITY };
        Self::new(status, error.to_string())
    }
}

impl From<rusqlite::Error> for Refusal {
    fn from(error: rusqlite::Error) -> Self {
        Self::failure(format!("the queue of jobs: {error}"))
    }
}

impl From<tokio::task::JoinError> for Refusal {
    fn from(error: tokio::task::JoinError) -> Self {
        Self::failure(format!("a mistake inside Toile ({error}); please report it"))
    }
}
