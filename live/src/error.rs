//! What can go wrong while a take is recorded; every message is one sentence that says what, where and what to do.

use toile_capture::CaptureError;

/// Errors of recording.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// What was asked for makes no sense: a rig file, a device's settings.
    #[error("{0}")]
    Settings(String),
    /// A device, or the permission to use it.
    #[error("{0}")]
    Device(String),
    /// From the recording or the subject's folder.
    #[error(transparent)]
    Capture(#[from] CaptureError),
}
