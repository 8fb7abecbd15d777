//! Depth cameras made of code, which stand in for hardware.
//!
//! A simulated camera answers what the real one would: descriptors, control requests, the next packet. What it sends is
//! known, so what arrives can be compared pixel by pixel. The same camera sits on the bus in this process (every
//! `cargo test`) and serves a real kernel over USB/IP (the wire tier). They share no code with the drivers that they test.
//!
//! - [`kinect1`]: camera and motor of the first Kinect, with faults on demand;
//! - [`kinect2`]: the second Kinect;
//! - [`d435`]: the RealSense D435: depth, infrared pair, colour, its monitor and its calibration;
//! - [`uvc`]: UVC cameras of any shape; [`side_by_side`]: a stereo camera among them;
//! - [`trials`]: trials that every camera has to pass (unplugs, long takes, replay), for the tests of the drivers;
//! - [`descriptors`]: standard requests, for kernels; [`usbip`]: a simulated device behind USB/IP; [`vhci`]: plugged into a kernel;
//!   [`proof`]: the proofs of the wire tier.
//!
//! ```
//! use std::sync::{Arc, Mutex};
//! use toile_driver_simulated::kinect1::{SimulatedCamera, Pattern};
//! use toile_driver_transport::{Bus, simulated::SimulatedBus};
//! let bus = SimulatedBus::default();
//! bus.plug(Arc::new(Mutex::new(SimulatedCamera::new(Pattern::default()))));
//! assert_eq!(bus.list().expect("a simulated bus can be read")[0].product, 0x02ae);
//! ```

pub mod d435;
pub mod descriptors;
mod faults;
pub mod kinect1;
pub mod kinect2;
pub mod proof;
pub mod side_by_side;
pub mod trials;
pub mod usbip;
pub mod uvc;
pub mod vhci;
