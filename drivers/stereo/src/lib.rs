//! Stereo rigs as depth cameras: one side-by-side camera, two cameras paired by time, or recorded pairs.
//!
//! - [`nodes`]: which video nodes look like stereo cameras;
//! - [`Pictures`]: those of one camera from a video node or from a folder; [`decode`]: their bytes, pure;
//! - `pairing`: two streams to pairs by time, pure; [`Pairs`]: side by side, two cameras, two sensors of a recording;
//! - [`StereoCamera`]: the [`toile_capture::Source`] over it all. Matching itself is `toile_stereo`'s.
//!
//! ```no_run
//! use toile_capture::Source;
//! use toile_driver_stereo::{Cameras, StereoCamera, StereoSettings};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # use toile_driver_transport::video::kernel::KernelVideo;
//! let settings = StereoSettings {
//!     name: "front".into(),
//!     cameras: Cameras::SideBySide { node: "/dev/video0".into() },
//!     width: 640,
//!     height: 480,
//!     fps: 30.0,
//!     calibration: vec!["intrinsics.yml".into(), "extrinsics.yml".into()],
//!     metres_per_unit: 0.001,
//!     alpha: 0.0,
//!     depth: Default::default(),
//! };
//! let mut camera = StereoCamera::open(&KernelVideo::default(), &settings)?;
//! while let Some(frame) = camera.next_frame()? {
//!     assert!(frame.color.is_some());
//! }
//! # Ok(())
//! # }
//! ```

pub mod decode;
mod device;
mod error;
pub mod nodes;
mod pairing;
mod pairs;
mod stream;

pub use device::{Cameras, PairCounts, StereoCamera, StereoSettings};
pub use error::StereoDriverError;
pub use pairing::{Moment, Picture, Side};
pub use pairs::{Pairs, SideBySide, TwoCameras, TwoSensors};
pub use stream::{FolderPictures, NodePictures, Pictures};
