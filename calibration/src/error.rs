//! Errors of calibration.

/// Why there is no calibration.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// A camera sees the board too seldom.
    #[error(
        "camera `{camera}` sees the board in {views} pictures; {least} at least are needed, in different places and \
         tilted by 20 to 45 degrees each way"
    )]
    TooFewViews {
        /// Its name.
        camera: String,
        /// Pictures with the board, all of it where it has no markers.
        views: usize,
        /// The number that is needed.
        least: usize,
    },
    /// The pictures do not determine a camera.
    #[error(
        "the pictures do not determine the lens of camera `{camera}`: the board is parallel to the picture in all of them, or \
         always the same; tilt it by 20 to 45 degrees each way"
    )]
    Degenerate {
        /// Its name.
        camera: String,
    },
    /// A camera shares no board with the others.
    #[error(
        "no picture shows the board to camera `{camera}` and to another camera at the same time; hold it where both see it"
    )]
    NotConnected {
        /// Its name.
        camera: String,
    },
}
