//! Colour from any webcam through nokhwa, by itself or beside a depth camera.
//!
//! A webcam gives colour alone. The camera's own JPEG is kept byte by byte; YUYV is converted.
//!
//! - [`list`]: which webcams there are;
//! - [`Webcam`]: one of them as a [`toile_capture::Source`] of colour; `convert`: device pixels to images, pure;
//! - [`ColorCalibration`]: its lens and its place beside a depth camera, from a file;
//! - [`ColorBeside`]: a depth camera as a [`toile_capture::Source`] whose frames have the webcam's colour: the picture that is
//!   `nearest` in time, of those that the `feed` brought.

mod beside;
mod calibration;
mod convert;
mod device;
mod error;
mod feed;
mod nearest;

pub use beside::ColorBeside;
pub use calibration::ColorCalibration;
pub use device::{Webcam, list};
pub use error::WebcamError;
