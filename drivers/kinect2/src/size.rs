//! Sizes of the camera's images, pixels.

/// Columns of depth and infrared.
pub(crate) const COLUMNS: usize = 512;
/// Rows of depth and infrared.
pub(crate) const ROWS: usize = 424;
