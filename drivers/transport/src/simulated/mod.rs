//! Devices made of code, and the bus and the video nodes in this process that they plug into: drivers see the same traits
//! as with libusb and V4L2.
//!
//! Time is bus time: a transfer is filled when it is waited for, each isochronous packet takes one microframe (125 µs),
//! and of several endpoints the one whose transfer ends first is served first. So a run is the same every time, at
//! whatever speed the machine has.
//!
//! - [`SimulatedDevice`]: what a device made of code answers; it serves a real kernel over USB/IP just as well;
//! - [`SimulatedBus`]: plug and unplug;
//! - [`SimulatedVideo`]: what `uvcvideo` makes of the devices on that bus; [`uvc`]: its descriptors and payloads, pure.

mod bus;
mod device;
mod flow;
mod node;
mod open;
mod plugged;
pub mod uvc;
mod video;

pub use bus::SimulatedBus;
pub use device::{Answer, Packet, SimulatedDevice, SimulatedInfo};
pub use video::SimulatedVideo;
