//! Errors of recording a take; every message is one sentence that names the problem, its place and the remedy.

use std::path::{Path, PathBuf};

use toile_capture::{CaptureError, printable_path};
use toile_driver_kinect1::Kinect1Error;
use toile_driver_kinect2::Kinect2Error;
use toile_driver_realsense::RealsenseError;
use toile_driver_stereo::StereoDriverError;
use toile_driver_transport::TransportError;
use toile_driver_uvc_depth::UvcDepthError;
use toile_driver_webcam::WebcamError;
use toile_synthetic::SyntheticError;

/// Errors of recording.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// Options that do not go together.
    #[error("{0}")]
    Usage(String),
    /// A file with the settings of a rig or of a stereo pair.
    #[error("{}: {reason}", printable_path(path))]
    Settings {
        /// The file.
        path: PathBuf,
        /// The problem and the remedy.
        reason: String,
    },
    /// Colour that cannot be put beside depth: its calibration, or its size.
    #[error(transparent)]
    Color(WebcamError),
    /// A device, or the permission to use it.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// From the recording or the subject's folder.
    #[error(transparent)]
    Capture(#[from] CaptureError),
}

/// Why a device gives no frames.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // a variant a driver
pub enum DeviceError {
    #[error(transparent)]
    Bus(#[from] TransportError),
    #[error(transparent)]
    Kinect1(#[from] Kinect1Error),
    #[error(transparent)]
    Kinect2(#[from] Kinect2Error),
    #[error(transparent)]
    Realsense(#[from] RealsenseError),
    #[error(transparent)]
    Stereo(#[from] StereoDriverError),
    #[error(transparent)]
    Synthetic(#[from] SyntheticError),
    #[error(transparent)]
    UvcDepth(#[from] UvcDepthError),
    #[error(transparent)]
    Webcam(#[from] WebcamError),
    /// It was opened, and ended before its first frame; why, where that is known.
    #[error("{0}")]
    NoFrames(String),
}

impl LiveError {
    /// An error in the settings file `path`.
    pub(crate) fn settings(path: &Path, reason: impl Into<String>) -> Self {
        Self::Settings { path: path.to_path_buf(), reason: reason.into() }
    }

    /// A short name of the kind of error, for machines.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Usage(_) | Self::Settings { .. } | Self::Color(_) => "usage",
            Self::Device(_) => "device",
            Self::Capture(_) => "capture",
        }
    }

    /// The file that it concerns, where there is one.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Settings { path, .. } | Self::Color(WebcamError::Calibration { path, .. }) => Some(path),
            _ => None,
        }
    }
}
