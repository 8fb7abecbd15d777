//! The second Kinect (Kinect for Windows v2 and alike).
//!
//! - [`CameraModel`]: commands, depth packets and colour images over the bus;
//! - [`Content`]: what the camera sees: a [`Pattern`] or a [`Rendered`] scene; [`Optics`]: what it is calibrated to;
//! - [`phases`]: depth and light to what the sensor measures, the inverse of decoding;
//! - [`Fault`], [`CommandFault`]: what goes wrong, and when.
//!
//! Facts were learnt from libfreenect2 (`src/libfreenect2.cpp`, `src/cpu_depth_packet_processor.cpp`,
//! `src/depth_packet_stream_parser.cpp`, `src/rgb_packet_stream_parser.cpp`, `protocol/*.h`). What the camera tells and
//! sends is mirrored; truth here is not.

mod camera;
mod commands;
mod content;
mod descriptors;
mod faults;
mod optics;
pub mod phases;

pub use camera::CameraModel;
pub use content::{Content, Pattern, Rendered};
pub use faults::{CommandFault, Fault, Stream, StreamFault};
pub use optics::Optics;

/// Columns and rows of depth.
pub const SIZE: (usize, usize) = (512, 424);
/// Columns and rows of colour.
pub const COLOR_SIZE: (usize, usize) = (1920, 1080);
/// Bytes of one of a depth packet's ten images.
pub const IMAGE_BYTES: usize = SIZE.0 * SIZE.1 * 11 / 8;
