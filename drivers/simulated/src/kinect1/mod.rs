//! Camera and motor of the first Kinect (models 1414 and alike).
//!
//! - [`SimulatedCamera`]: commands over control requests, depth and video as isochronous packets;
//! - [`SimulatedMotor`]: LED, tilt and accelerometer;
//! - [`Content`]: what the camera sees: a [`Pattern`] or a [`Rendered`] scene; [`Optics`]: what it is calibrated to;
//! - [`Fault`], [`CommandFault`]: what goes wrong, and when.
//!
//! Facts were learnt from libfreenect (`src/cameras.c`, `src/flags.c`, `src/registration.c`, `src/tilt.c`) and the
//! OpenKinect wiki ("Protocol Documentation").

mod camera;
mod commands;
mod content;
mod faults;
mod motor;
mod optics;
mod packets;

pub use camera::SimulatedCamera;
pub use content::{Content, Pattern, Rendered, RenderedFrame, Repeated};
pub use faults::CommandFault;
pub use motor::SimulatedMotor;
pub use optics::Optics;
pub use packets::{DEPTH_ENDPOINT, Stream, VIDEO_ENDPOINT};

pub use crate::faults::StreamFault;

/// A fault of one of the streams.
pub type Fault = crate::faults::Fault<Stream>;

/// Columns and rows of depth and colour.
pub const SIZE: (usize, usize) = (640, 480);
/// Columns and rows of infrared.
pub const INFRARED_SIZE: (usize, usize) = (640, 488);
/// Depth value of pixels without depth.
pub const NO_DEPTH: u16 = 2047;
