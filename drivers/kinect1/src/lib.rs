//! The first Kinect (Kinect for Xbox 360, models 1414 and alike) as a capture source.
//!
//! The way of a frame, a file each:
//!
//! 1. [`protocol`]: bytes to packets and commands, and back, pure;
//! 2. [`Assembler`]: packets to whole frames; losses are counted, torn ones are dropped;
//! 3. [`decode`]: packed depth, infrared and Bayer colours to images, pure;
//! 4. [`Calibration`]: the device's own calibration; raw depth to millimetres; [`Registration`]: depth as colour sees it;
//! 5. `streams`: transfers to frames, depth and colour of one time paired ([`toile_capture::pairing`]);
//! 6. [`Kinect1`]: the [`toile_capture::Source`] over it all, as [`Settings`] say; [`Health`]: how well it went;
//!    [`Motor`]: LED, tilt, accelerometer.
//!
//! Protocol facts were learnt from libfreenect (<https://github.com/OpenKinect/libfreenect>), the OpenKinect wiki and
//! Linux' `drivers/media/usb/gspca/kinect.c`; each constant names its place.
//!
//! ```
//! use toile_capture::Source;
//! use toile_driver_kinect1::{Kinect1, Settings};
//! # use std::sync::{Arc, Mutex};
//! # use toile_driver_simulated::kinect1::{SimulatedCamera, Pattern};
//! # let bus = toile_driver_transport::simulated::SimulatedBus::default();
//! # bus.plug(Arc::new(Mutex::new(SimulatedCamera::new(Pattern::default()))));
//! # // On a machine with a Kinect: let bus = toile_driver_transport::libusb::LibusbBus::new()?;
//! let mut kinect = Kinect1::open(&bus, None, Settings::default())?;
//! let frame = kinect.next_frame()?.ok_or("it streams")?;
//! assert_eq!(frame.depth.ok_or("with depth")?.values.len(), 640 * 480);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assembler;
mod calibration;
mod commands;
pub mod decode;
mod device;
mod error;
mod find;
mod health;
mod motor;
pub mod protocol;
mod registration;
mod rig;
mod settings;
mod streams;

pub use assembler::{Assembler, Losses};
pub use calibration::Calibration;
pub use device::Kinect1;
pub use error::Kinect1Error;
pub use find::list;
pub use health::Health;
pub use motor::{Led, Motor, MotorState};
pub use registration::Registration;
pub use settings::{DepthMode, Settings};
pub use toile_driver_transport::streaming::VideoMode;
