//! Errors of the stage.

/// Why there is no texture.
#[derive(Debug, thiserror::Error)]
pub enum TextureError {
    /// No picture shows the surface.
    #[error(
        "none of the {photos} colour pictures shows the surface; check that the take's colour camera and its place beside the \
         depth camera (`color`, `color_from_depth`) are right"
    )]
    NothingSeen {
        /// Pictures that were tried.
        photos: usize,
    },
    /// A picture is of another size than its camera.
    #[error(
        "the colour picture of frame {frame} has {width} x {height} pixels, but its calibration says {expected_width} x \
         {expected_height}; correct the calibration and import again"
    )]
    Size {
        /// Frame index.
        frame: u64,
        /// Columns of the picture.
        width: u32,
        /// Its rows.
        height: u32,
        /// Columns by the calibration.
        expected_width: u32,
        /// Rows by the calibration.
        expected_height: u32,
    },
    /// The surface cannot be flattened.
    #[error("the surface cannot be unwrapped: {0}")]
    Unwrap(String),
    /// The settings contradict themselves.
    #[error("settings: {0}")]
    Settings(String),
    /// A picture cannot be written.
    #[error("the texture cannot be encoded: {0}")]
    Encode(String),
}
