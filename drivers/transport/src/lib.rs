//! USB and video nodes: the bus, devices with asynchronous transfers, cameras that a kernel driver serves, and both of
//! them made of code in this process.
//!
//! - [`Bus`] lists and opens devices; [`UsbDevice`] is an open one: control and bulk requests with a time limit, and
//!   transfers in flight ([`Transfer`]: owned by whoever may touch it, by nobody while the kernel fills it);
//! - [`usb`]: these traits, the depth cameras on the bus with what is wrong with each, and which cameras are known;
//! - [`libusb`]: the machine's bus over libusb (through rusb), with an event thread of its own; this and [`video`] are the only places with `unsafe`;
//! - [`video`]: video nodes (V4L2): buffers, controls, extension units, metadata, and which USB device they belong to;
//! - [`streaming`]: how a camera that streams is driven, restarted after a silence and ended; numbers of frames;
//! - [`simulated`]: bus and video nodes in this process, over a [`simulated::SimulatedDevice`], in bus time instead of the clock's;
//! - [`udev`]: the rule that gives a user access to the cameras.
//!
//! ```
//! use std::time::Duration;
//! use toile_driver_transport::{Bus, TransportError, simulated::SimulatedBus};
//! let bus = SimulatedBus::default();
//! assert!(bus.list()?.is_empty());
//! let missing = toile_driver_transport::open_known(&bus, |info| info.vendor == 0x045e, "a Kinect");
//! assert!(matches!(missing.err(), Some(TransportError::NotFound { .. })));
//! # Ok::<(), TransportError>(())
//! ```

mod error;
pub mod libusb;
pub mod simulated;
pub mod streaming;
pub mod udev;
pub mod usb;
pub mod video;

pub use error::TransportError;
pub use usb::known;
pub use usb::{
    Bus, DeviceInfo, LinkSpeed, PacketStatus, Setup, Transfer, TransferKind, TransferStatus, UsbDevice, choose,
    open_known, wait_for,
};
