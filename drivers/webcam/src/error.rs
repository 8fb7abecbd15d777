//! Errors of a webcam.

use std::path::PathBuf;

use nokhwa::utils::FrameFormat;

/// Errors of the webcam driver.
#[derive(Debug, thiserror::Error)]
pub enum WebcamError {
    /// nokhwa could not list, open or stream.
    #[error("webcam: {0}; is it plugged in, free and readable (group video)?")]
    Device(#[from] nokhwa::NokhwaError),
    /// A picture is torn or short; the next one may be whole.
    #[error("webcam: {0}")]
    Pixels(String),
    /// It sends pictures in a format that is not understood.
    #[error("webcam: it sends {0}, but pictures must be MJPEG or YUYV; choose another webcam or size")]
    Format(FrameFormat),
    /// The calibration file cannot be used.
    #[error("{path}: {reason}")]
    Calibration {
        /// The file.
        path: PathBuf,
        /// The problem.
        reason: String,
    },
    /// Its colour cannot be put beside this depth camera.
    #[error("colour beside depth: {0}")]
    Beside(String),
}
