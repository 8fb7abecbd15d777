//! Errors of recording a take; every message is one sentence that names the problem, its place and the remedy.

use toile_capture::CaptureError;

/// Errors of recording.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// An impossible request: a rig file, a device's settings.
    #[error("{0}")]
    Settings(String),
    /// A device, or the permission to use it.
    #[error("{0}")]
    Device(String),
    /// From the recording or the subject's folder.
    #[error(transparent)]
    Capture(#[from] CaptureError),
}
