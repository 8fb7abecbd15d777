//! The first Kinect (Kinect for Xbox 360, models 1414 and alike) as a capture source.
//!
//! The way of a frame, a file each:
//!
//! 1. [`protocol`]: bytes to packets and commands, and back, pure;
//! 2. [`assembler`]: packets to whole frames; what is lost is counted, what is torn is dropped;
//! 3. [`decode`]: packed depth, infrared and Bayer colours to images, pure;
//! 4. [`calibration`]: the device's own numbers; raw depth to millimetres; [`registration`]: depth as colour sees it;
//! 5. [`toile_capture::pairing`]: depth and colour of one time to one frame;
//! 6. [`device`]: [`Kinect1`], the [`toile_capture::Source`] over it all, as [`settings`] say; [`health`]: how it went; [`motor`]: LED, tilt, accelerometer.
//!
//! Protocol facts were learnt from libfreenect (<https://github.com/OpenKinect/libfreenect>), the OpenKinect wiki and
//! Linux' `drivers/media/usb/gspca/kinect.c`; each constant names its place.
//!
//! ```
//! use toile_capture::Source;
//! use toile_driver_kinect1::{Kinect1, Settings};
//! # use std::sync::{Arc, Mutex};
//! # use toile_driver_models::kinect1::{CameraModel, Pattern};
//! # let bus = toile_driver_transport::twin::VirtualBus::default();
//! # bus.plug(Arc::new(Mutex::new(CameraModel::new(Pattern::default()))));
//! # // On a machine with a Kinect: let bus = toile_driver_transport::libusb::LibusbBus::new()?;
//! let mut kinect = Kinect1::open(&bus, None, Settings::default())?;
//! let frame = kinect.next_frame()?.ok_or("it streams")?;
//! assert_eq!(frame.depth.ok_or("with depth")?.values.len(), 640 * 480);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod assembler;
pub mod calibration;
mod commands;
pub mod decode;
pub mod device;
pub mod error;
pub mod health;
pub mod motor;
pub mod protocol;
pub mod registration;
pub mod settings;

pub use calibration::Calibration;
pub use device::{Kinect1, list};
pub use error::Kinect1Error;
pub use health::Health;
pub use motor::{Led, Motor, MotorState};
pub use settings::{DepthMode, Settings, VideoMode};
