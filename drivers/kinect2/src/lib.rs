//! The second Kinect (Kinect for Xbox One, Kinect for Windows v2) as a capture source.
//!
//! The way of a frame, a file each:
//!
//! 1. [`protocol`]: bytes to commands, answers, depth images and colour images, pure;
//! 2. [`DepthStream`], [`ColorStream`]: transfers to whole packets; losses are counted;
//! 3. `streams`: transfers to frames, depth and colour of one time paired ([`toile_capture::pairing`]);
//! 4. [`Decoder`]: ten images of measurements to depth in millimetres, pure; [`color`]: the JPEG to pixels;
//! 5. [`Calibration`]: the device's own calibration; [`Registration`]: colour as depth sees it;
//! 6. [`Kinect2`]: the [`toile_capture::Source`] over it all, as [`Settings`] say; [`Health`]: how well it went.
//!
//! The sensor sees everything mirrored; the images of this crate are not. Protocol facts were learnt from libfreenect2
//! (<https://github.com/OpenKinect/libfreenect2>); each constant names its place.
//!
//! ```
//! use toile_capture::Source;
//! use toile_driver_kinect2::{Kinect2, Settings};
//! # use std::sync::{Arc, Mutex};
//! # use toile_driver_simulated::kinect2::{SimulatedCamera, Pattern};
//! # let bus = toile_driver_transport::simulated::SimulatedBus::default();
//! # bus.plug(Arc::new(Mutex::new(SimulatedCamera::new(Pattern::default()))));
//! # // On a machine with a Kinect: let bus = toile_driver_transport::libusb::LibusbBus::new()?;
//! let mut kinect = Kinect2::open(&bus, None, Settings::default())?;
//! let frame = kinect.next_frame()?.ok_or("it streams")?;
//! assert_eq!(frame.depth.ok_or("with depth")?.values.len(), 512 * 424);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod calibration;
pub mod color;
mod color_stream;
mod commands;
mod decode;
mod depth_stream;
mod device;
mod error;
mod find;
mod health;
pub mod protocol;
mod registration;
mod rig;
mod settings;
mod size;
mod streams;

pub use calibration::Calibration;
pub use color_stream::ColorStream;
pub use decode::{DecodeSettings, Decoded, Decoder};
pub use depth_stream::DepthStream;
pub use device::Kinect2;
pub use error::Kinect2Error;
pub use find::list;
pub use health::{Health, Losses};
pub use registration::Registration;
pub use settings::{ColorMode, Settings};
