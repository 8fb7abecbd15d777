//! Frames, rigs, calibration, the source trait, takes on disk: recording, replay, import, inspection.
//!
//! - [`Frame`]: depth and colour of one sensor at one time, with device and host time and the device's frame number;
//! - [`Rig`] and [`Sensor`]: cameras, calibration, identity;
//! - [`ClockDomain`], [`ClockFit`]: which clock stamps frames, and its fit to the host's;
//! - [`TickClock`]: a device's ticks, which wrap, as a time that does not;
//! - [`pairing`]: depth and colour of one time made one frame, for devices that send them apart;
//! - [`pixels`]: the bytes of cameras to images: depth, grey, YUYV, JPEG markers;
//! - [`Source`]: the trait that live devices, replay and the synthetic sensor have in common;
//! - [`Recorder`] writes frames to an MCAP file, [`Replay`] is the file as a source; [`depth_codec`] packs depth;
//! - [`import`](mod@import) reads other people's folders; [`Subject`] is a person's folder with its takes,
//!   [`LockedSubject`] the same for the one process that may write it; [`inspect`](mod@inspect) lists the contents of any of
//!   them and whether it is healthy;
//! - [`trajectory`]: poses over time as text; [`files`]: files that appear whole or not at all.
//!
//! ```
//! use toile_capture::{DepthImage, DeviceIdentity, Frame, Recorder, RecorderOptions, Replay, Rig, Sensor, Source};
//! use toile_geometry::{Rigid, camera::PinholeCamera};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let sensor = Sensor {
//!     name: "front".into(),
//!     identity: DeviceIdentity::default(),
//!     depth: PinholeCamera::ideal(2, 1, 2.0, 2.0, 0.5, 0.0),
//!     depth_scale: 0.001,
//!     color: None,
//!     color_from_depth: Rigid::identity(),
//!     rig_from_depth: Rigid::identity(),
//!     fps: 30.0,
//! };
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("take.mcap");
//! let mut recorder = Recorder::create(&path, &Rig { sensors: vec![sensor] }, RecorderOptions::default())?;
//! let depth = DepthImage { width: 2, height: 1, values: vec![1500, 0] };
//! recorder.write(&Frame {
//!     sensor: 0,
//!     index: 0,
//!     device_frame: 17,
//!     lost_before: 0,
//!     device_time_ns: 1_000_000,
//!     host_time_ns: 2_000_000,
//!     depth: Some(depth.clone().into()),
//!     color: None,
//! })?;
//! recorder.finish()?;
//! let mut replay = Replay::open(&path)?;
//! let frame = replay.next_frame()?.ok_or("one frame was recorded")?;
//! assert_eq!(*frame.depth.ok_or("with depth")?, depth);
//! # Ok(())
//! # }
//! ```

mod associate;
mod clock;
mod encoded;
mod error;
pub mod files;
mod frame;
#[doc(hidden)]
pub mod fuzzing;
pub mod import;
pub mod inspect;
pub mod pairing;
mod picture;
pub mod pixels;
mod printable;
pub mod recording;
mod rig;
mod source;
pub mod subject;
mod tick_clock;
pub mod trajectory;

pub use clock::{ClockDomain, ClockFit, host_now_ns};
pub use error::CaptureError;
pub use files::{atomic_write, atomic_write_all, atomic_write_with};
pub use frame::{ColorImage, Frame};
pub use inspect::{Inspection, inspect};
pub use picture::{DepthImage, RgbImage};
pub use printable::{printable, printable_lines, printable_path};
pub use recording::{
    DepthEncoding, FrameInfo, Loss, Recorder, RecorderOptions, RecordingSummary, Replay, depth_codec, export_standard,
};
pub use rig::{DeviceIdentity, Rig, Sensor};
pub use source::Source;
pub use subject::{Layer, LockedSubject, PendingTake, ScanTake, Subject, SubjectLock};
pub use tick_clock::TickClock;
pub use trajectory::TimedPose;
