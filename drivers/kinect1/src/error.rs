//! Errors of a Kinect.

use toile_driver_transport::TransportError;

/// Errors of the Kinect v1 driver.
#[derive(Debug, thiserror::Error)]
pub enum Kinect1Error {
    /// The bus or the device failed.
    #[error("Kinect v1: {0}")]
    Transport(#[from] TransportError),
    /// The camera answered a command with something else.
    #[error(
        "Kinect v1: command {command:#04x}: {reason}; unplug the Kinect from power for ten seconds and plug it in again"
    )]
    Answer {
        /// The command.
        command: u16,
        /// The fault of the answer.
        reason: String,
    },
    /// The camera's calibration cannot be true.
    #[error(
        "Kinect v1: its calibration cannot be used: {0}; unplug the Kinect from power for ten seconds and plug it in again"
    )]
    Calibration(String),
    /// No frame came although the streams are on.
    #[error(
        "Kinect v1: the camera sent no frame for {0:.1} s; check its power supply, and that nothing else on its USB controller streams"
    )]
    Silent(f64),
}
