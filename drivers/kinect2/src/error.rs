//! Errors of a Kinect v2.

use toile_driver_transport::TransportError;

/// Errors of the Kinect v2 driver.
#[derive(Debug, thiserror::Error)]
pub enum Kinect2Error {
    /// The bus or the device failed.
    #[error("Kinect v2: {0}")]
    Transport(#[from] TransportError),
    /// It is plugged into a slower port.
    #[error("Kinect v2: it is on a USB 2 link but streams only over USB 3: use a blue port and its own cable")]
    SlowLink,
    /// The camera answered a command with something else.
    #[error(
        "Kinect v2: command {command:#04x}: {reason}; unplug the Kinect from power for ten seconds and plug it in again"
    )]
    Answer {
        /// The command.
        command: u32,
        /// The fault of the answer.
        reason: String,
    },
    /// The camera's calibration cannot be true.
    #[error(
        "Kinect v2: its calibration cannot be used: {0}; unplug the Kinect from power for ten seconds and plug it in again"
    )]
    Calibration(String),
    /// A depth packet of another length.
    #[error("Kinect v2: a depth packet of {bytes} bytes instead of {expected}")]
    Packet {
        /// Its length.
        bytes: usize,
        /// The right value.
        expected: usize,
    },
    /// A colour image that cannot be decoded.
    #[error("Kinect v2: colour image: {0}")]
    Color(String),
    /// No frame came although the streams are on.
    #[error(
        "Kinect v2: the camera sent no frame for {0:.1} s; check its power supply, and that nothing else on its USB controller streams"
    )]
    Silent(f64),
}
