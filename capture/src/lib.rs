//! Frames, rigs, calibration, the source trait, takes on disk: recording, replay, import, inspection.
//!
//! - [`Frame`]: depth and colour of one sensor at one time, with device and host time and the device's frame number;
//! - [`Rig`] and [`Sensor`]: cameras, calibration, identity;
//! - [`Source`]: what live devices, replay and the synthetic sensor have in common.

pub mod atomic_write;
mod container;
pub mod depth_codec;
pub mod error;
pub mod frame;
pub mod import;
mod message;
mod protobuf;
pub mod recording;
pub mod replay;
pub mod rig;
mod schema;
pub mod source;
pub mod trajectory;

pub use atomic_write::{atomic_write, atomic_write_with};
pub use error::CaptureError;
pub use frame::{ColorImage, DepthImage, Frame, RgbImage};
pub use recording::{DepthEncoding, Recorder, RecorderOptions, RecordingSummary, export_standard};
pub use replay::{FrameInfo, Loss, Replay};
pub use rig::{DeviceIdentity, Rig, Sensor};
pub use source::Source;
pub use trajectory::TimedPose;
