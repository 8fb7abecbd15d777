//! What can go wrong with a UVC depth camera.

use std::path::PathBuf;

/// Errors of the UVC depth driver.
#[derive(Debug, thiserror::Error)]
pub enum UvcDepthError {
    /// The node could not be opened or driven.
    #[error("{node}: cannot {action}: {source}")]
    Device {
        /// Device node.
        node: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
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
        /// What is wrong with it.
        reason: String,
    },
    /// A buffer is too short for its image.
    #[error("a buffer holds {bytes} bytes where {width}x{height} at {stride} bytes a row needs {needed}")]
    ShortBuffer {
        /// Bytes that came.
        bytes: usize,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes a row.
        stride: u32,
        /// Bytes that are needed.
        needed: usize,
    },
}
