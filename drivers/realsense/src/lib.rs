//! RealSense D4xx (D415, D435, D435i, D455 and alike) as a capture source, through the kernel's video nodes.
//!
//! The way of a frame, a file each:
//!
//! 1. [`list`]: cameras by their USB device, and their nodes: depth, infrared, colour, and the metadata node of each;
//! 2. [`monitor`]: commands to the firmware over the extension unit, pure; [`Calibration`]: its tables to cameras;
//! 3. [`Controls`]: laser, exposure, preset;
//! 4. [`metadata`]: payload headers to device time and frame number, pure; `stream`: pictures with their metadata;
//! 5. [`toile_capture::pixels`], [`infrared_pair`]: buffers to images, pure; `streams`: depth and colour of one time to one
//!    frame ([`toile_capture::pairing`]);
//! 6. [`Realsense`]: the [`toile_capture::Source`] over it all, as [`Settings`] say; [`Health`]: how well it went.
//!
//! Facts were learnt from librealsense (<https://github.com/IntelRealSense/librealsense>) and Linux' `uvcvideo`; each
//! constant names its place.
//!
//! ```
//! use toile_capture::Source;
//! use toile_driver_realsense::{Realsense, Settings};
//! # use std::sync::{Arc, Mutex};
//! # use toile_driver_simulated::{d435, uvc::Wire};
//! # use toile_driver_transport::{simulated::{SimulatedBus, SimulatedVideo}};
//! # let bus = SimulatedBus::default();
//! # bus.plug(Arc::new(Mutex::new(d435::model(d435::Pattern::default(), Wire::Bulk))));
//! # let video = SimulatedVideo::new(bus);
//! // On a machine with a camera: let video = toile_driver_transport::video::kernel::KernelVideo::default();
//! let mut camera = Realsense::open(&video, None, Settings::default())?;
//! let frame = camera.next_frame()?.ok_or("it streams")?;
//! assert_eq!(frame.depth.ok_or("with depth")?.values.len(), 640 * 480);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod calibration;
mod choose;
mod clock;
mod controls;
mod decode;
mod device;
mod error;
mod find;
mod health;
pub mod metadata;
pub mod monitor;
mod rig;
mod settings;
mod stream;
mod streams;

pub use calibration::Calibration;
pub use controls::{Controls, Exposure};
pub use decode::infrared_pair;
pub use device::Realsense;
pub use error::RealsenseError;
pub use find::{Camera, Nodes, list};
pub use health::Health;
pub use settings::Settings;
pub use toile_driver_transport::streaming::VideoMode;
