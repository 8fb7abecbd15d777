//! The second Kinect (Kinect for Xbox One, Kinect for Windows v2) as a capture source.
//!
//! The way of a frame, a file each:
//!
//! 1. [`protocol`]: bytes to commands, answers, depth images and colour images, pure;
//! 2. [`depth_stream`], [`color_stream`]: what the bus brings to whole packets; what is lost is counted;
//! 3. [`toile_capture::pairing`]: depth and colour of one time to one frame;
//! 4. [`decode`]: ten images of measurements to depth in millimetres, pure; [`color`]: the JPEG to pixels;
//! 5. [`calibration`]: the device's own numbers; [`registration`]: colour as depth sees it;
//! 6. [`device`]: [`Kinect2`], the [`toile_capture::Source`] over it all, as [`settings`] say; [`health`]: how it went.
//!
//! The sensor sees everything mirrored; what this crate gives is not. Protocol facts were learnt from libfreenect2
//! (<https://github.com/OpenKinect/libfreenect2>); each constant names its place.
//!
//! ```
//! use toile_capture::Source;
//! use toile_driver_kinect2::{Kinect2, Settings};
//! # use std::sync::{Arc, Mutex};
//! # use toile_driver_models::kinect2::{CameraModel, Pattern};
//! # let bus = toile_driver_transport::twin::VirtualBus::default();
//! # bus.plug(Arc::new(Mutex::new(CameraModel::new(Pattern::default()))));
//! # // On a machine with a Kinect: let bus = toile_driver_transport::libusb::LibusbBus::new()?;
//! let mut kinect = Kinect2::open(&bus, None, Settings::default())?;
//! let frame = kinect.next_frame()?.ok_or("it streams")?;
//! assert_eq!(frame.depth.ok_or("with depth")?.values.len(), 512 * 424);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod calibration;
pub mod color;
pub mod color_stream;
mod commands;
pub mod decode;
pub mod depth_stream;
pub mod device;
pub mod error;
pub mod health;
pub mod protocol;
pub mod registration;
pub mod settings;

pub use calibration::Calibration;
pub use decode::{DecodeSettings, Decoded, Decoder};
pub use device::{Kinect2, list};
pub use error::Kinect2Error;
pub use health::{Health, Losses};
pub use settings::{ColorMode, Settings};
