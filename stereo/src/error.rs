//! Errors between two images and depth.

/// Errors of the stereo crate.
#[derive(Debug, thiserror::Error)]
pub enum StereoError {
    /// The two images cannot be a pair.
    #[error(
        "left image {left:?}, right image {right:?} (columns, rows, pixels): both must have the same size and as many pixels as it says"
    )]
    Images {
        /// Columns, rows, pixels of the left image.
        left: (u32, u32, usize),
        /// Columns, rows, pixels of the right image.
        right: (u32, u32, usize),
    },
    /// A setting is out of its range.
    #[error("stereo matching: {0}")]
    Settings(String),
    /// A calibration file cannot be used.
    #[error("{place}: {reason}")]
    Calibration {
        /// The file or files.
        place: String,
        /// The problem, its place, and the remedy.
        reason: String,
    },
    /// The two cameras cannot be rectified.
    #[error("the cameras cannot be rectified: {0}")]
    Rectification(String),
}
