//! Models of depth cameras that stand in for hardware.
//!
//! A model answers what the camera would: descriptors, control requests, the next packet. What it sends is known, so what
//! arrives can be compared pixel by pixel. The same model sits behind the in-process bus (every `cargo test`) and serves a
//! real kernel over USB/IP (the wire tier). The models share no code with the drivers that they test.
//!
//! - [`kinect1`]: camera and motor of the first Kinect, with faults on demand;
//! - [`kinect2`]: the second Kinect;
//! - [`d435`]: the RealSense D435: depth, infrared pair, colour, its monitor and its calibration;
//! - [`uvc`]: UVC cameras of any shape; [`side_by_side`]: a stereo camera among them;
//! - [`trials`]: what any camera must stand (unplugs, long takes, replay), for the tests of the drivers;
//! - [`descriptors`]: standard requests, for kernels; [`usbip`]: a model behind USB/IP; [`vhci`]: plugged into a kernel;
//!   [`proof`]: what is proven there.
//!
//! ```
//! use std::sync::{Arc, Mutex};
//! use toile_driver_models::kinect1::{CameraModel, Pattern};
//! use toile_driver_transport::{Bus, twin::VirtualBus};
//! let bus = VirtualBus::default();
//! bus.plug(Arc::new(Mutex::new(CameraModel::new(Pattern::default()))));
//! assert_eq!(bus.list().expect("a virtual bus can be read")[0].product, 0x02ae);
//! ```

pub mod d435;
pub mod descriptors;
pub mod kinect1;
pub mod kinect2;
pub mod proof;
pub mod side_by_side;
pub mod trials;
pub mod usbip;
pub mod uvc;
pub mod vhci;
