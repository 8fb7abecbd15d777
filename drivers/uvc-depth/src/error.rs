//! Errors of a UVC depth camera.

use std::path::PathBuf;

use toile_capture::pixels::PixelError;
use toile_driver_transport::TransportError;

/// Errors of the UVC depth driver.
#[derive(Debug, thiserror::Error)]
pub enum UvcDepthError {
    /// The node could not be opened or driven.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// No frame came although the stream is on.
    #[error(
        "the camera sent no frame for {0:.1} s; check its cable, and that nothing else on its USB controller streams"
    )]
    Silent(f64),
    /// The camera offers no depth format.
    #[error(
        "{node}: offers {offered}, but depth needs Z16 or Y16; choose the camera's depth node with `toile devices`"
    )]
    Format {
        /// Device node.
        node: PathBuf,
        /// The formats it offers.
        offered: String,
    },
    /// The calibration file cannot be used.
    #[error("{path}: {reason}")]
    Calibration {
        /// The file.
        path: PathBuf,
        /// The problem.
        reason: String,
    },
    /// A buffer is too short for its image.
    #[error(transparent)]
    Pixels(#[from] PixelError),
}
