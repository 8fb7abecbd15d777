//! Errors of a RealSense camera.

use std::path::PathBuf;

use toile_driver_transport::TransportError;

/// Errors of the RealSense driver.
#[derive(Debug, thiserror::Error)]
pub enum RealsenseError {
    /// A node or the device failed.
    #[error("RealSense: {0}")]
    Transport(#[from] TransportError),
    /// A camera that the kernel shows no node of for this.
    #[error(
        "RealSense: it has no video node for {0}; is the kernel module `uvcvideo` loaded? Unplug the camera and plug it in again"
    )]
    NoNode(&'static str),
    /// A node gives another picture than was asked for.
    #[error("RealSense: {node} gives {given} where {asked} was asked for; choose a size and rate that it has")]
    Format {
        /// Device node.
        node: PathBuf,
        /// The rate that it gives.
        given: String,
        /// The request.
        asked: String,
    },
    /// The firmware answered a command with something else.
    #[error("RealSense: command {command:#04x}: {reason}; unplug the camera and plug it in again")]
    Answer {
        /// The command.
        command: u32,
        /// The fault of the answer.
        reason: String,
    },
    /// The calibration cannot be true.
    #[error("RealSense: its calibration cannot be used: {0}; unplug the camera and plug it in again")]
    Calibration(String),
    /// No frame came although the streams are on.
    #[error(
        "RealSense: the camera sent no frame for {0:.1} s; use another cable or port, and check that nothing else on its USB controller streams"
    )]
    Silent(f64),
}
