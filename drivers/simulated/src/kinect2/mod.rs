//! The second Kinect (Kinect for Windows v2 and alike).
//!
//! - [`SimulatedCamera`]: commands, depth packets and colour images over the bus;
//! - [`Content`]: what the camera sees: a [`Pattern`] or a [`Rendered`] scene; [`Optics`]: what it is calibrated to;
//! - [`phases`]: depth and light to what the sensor measures, the inverse of decoding;
//! - [`Fault`], [`CommandFault`]: what goes wrong, and when.
//!
//! Facts were learnt from libfreenect2 (`src/libfreenect2.cpp`, `src/cpu_depth_packet_processor.cpp`,
//! `src/depth_packet_stream_parser.cpp`, `src/rgb_packet_stream_parser.cpp`, `protocol/*.h`). What the camera states and
//! sends is mirrored; truth here is not.

mod camera;
mod commands;
mod content;
mod descriptors;
mod faults;
mod optics;
pub mod phases;

pub use camera::SimulatedCamera;
pub use content::{Content, Pattern, Rendered};
pub use faults::CommandFault;
pub use optics::Optics;

pub use crate::faults::StreamFault;

/// One of the camera's streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Depth, in isochronous packets: nine for each of ten images.
    Depth,
    /// Colour, in bulk transfers.
    Color,
}

/// A fault of one of the streams.
pub type Fault = crate::faults::Fault<Stream>;

/// Columns and rows of depth.
pub const SIZE: (usize, usize) = (512, 424);
/// Columns and rows of colour.
pub const COLOR_SIZE: (usize, usize) = (1920, 1080);
/// Bytes of one of a depth packet's ten images.
pub const IMAGE_BYTES: usize = SIZE.0 * SIZE.1 * 11 / 8;
