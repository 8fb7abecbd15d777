//! Errors of a stereo rig.

use std::path::PathBuf;

use toile_driver_transport::TransportError;
use toile_stereo::StereoError;

use crate::pairing::Side;

/// Errors of the stereo driver.
#[derive(Debug, thiserror::Error)]
pub enum StereoDriverError {
    /// A node could not be opened or driven.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// The camera offers no picture format that is understood.
    #[error("{node}: offers {offered} at {width}x{height}, but pictures must be MJPG, YUYV or GREY of that size")]
    Format {
        /// Device node.
        node: PathBuf,
        /// The formats it offers, or the one it gave.
        offered: String,
        /// Columns asked for.
        width: u32,
        /// Rows asked for.
        height: u32,
    },
    /// The settings ask for pictures larger than any camera's.
    #[error("`width` and `height` are {width} and {height}, but must be at most 16384; give those of one view")]
    Size {
        /// Columns of a view.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A picture is not whole. The one after it may be.
    #[error("the {side} camera's picture {sequence} {reason}")]
    Picture {
        /// Which camera.
        side: Side,
        /// The camera's number of the picture.
        sequence: u64,
        /// The problem.
        reason: String,
    },
    /// A folder or file of recorded pictures cannot be used.
    #[error("{path}: {reason}")]
    Recorded {
        /// The folder or file.
        path: PathBuf,
        /// The problem and the remedy.
        reason: String,
    },
    /// Reading a recording failed.
    #[error(transparent)]
    Recording(#[from] toile_capture::CaptureError),
    /// Calibration, rectification or matching.
    #[error(transparent)]
    Stereo(#[from] StereoError),
}
