//! Camera and motor of the first Kinect (models 1414 and alike).
//!
//! - [`CameraModel`]: commands over control requests, depth and video as isochronous packets;
//! - [`MotorModel`]: LED, tilt and accelerometer;
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

pub use camera::CameraModel;
pub use content::{Content, Pattern, Rendered, RenderedFrame, Repeated};
pub use faults::{CommandFault, Fault, StreamFault};
pub use motor::MotorModel;
pub use optics::Optics;
pub use packets::{DEPTH_ENDPOINT, Stream, VIDEO_ENDPOINT};

/// Columns and rows of depth and colour.
pub const SIZE: (usize, usize) = (640, 480);
/// Columns and rows of infrared.
pub const INFRARED_SIZE: (usize, usize) = (640, 488);
/// Depth value of pixels without depth.
pub const NO_DEPTH: u16 = 2047;
