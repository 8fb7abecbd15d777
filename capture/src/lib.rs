//! Frames, rigs, calibration, the source trait, takes on disk: recording, replay, import, inspection.
//!
//! - [`Frame`]: depth and colour of one sensor at one time, with device and host time and the device's frame number;
//! - [`Rig`] and [`Sensor`]: cameras, calibration, identity;
//! - [`Source`]: what live devices, replay and the synthetic sensor have in common.

pub mod error;
pub mod frame;
pub mod rig;
pub mod source;

pub use error::CaptureError;
pub use frame::{ColorImage, DepthImage, Frame, RgbImage};
pub use rig::{DeviceIdentity, Rig, Sensor};
pub use source::Source;
