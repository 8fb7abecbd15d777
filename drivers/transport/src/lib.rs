//! USB and video nodes: the bus, devices with asynchronous transfers, cameras that a kernel driver serves, and an
//! in-process twin of both that device models plug into.
//!
//! - [`Bus`] lists and opens devices; [`UsbDevice`] is an open one: control and bulk requests with a time limit, and
//!   transfers in flight ([`Transfer`]: owned by whoever may touch it, by nobody while the kernel fills it);
//! - [`libusb`]: both over libusb (through rusb), with an event thread of its own; this and [`video`] are the only places with `unsafe`;
//! - [`twin`]: both in this process, over a [`twin::DeviceModel`], in bus time instead of the clock's;
//! - [`video`]: video nodes (V4L2): buffers, controls, extension units, metadata, and which USB device they belong to;
//! - [`usb::list`]: the depth cameras on the bus, with what is wrong with each; [`known`]: which those are;
//! - [`udev`]: the rule that gives a user access to them.
//!
//! ```
//! use std::time::Duration;
//! use toile_driver_transport::{Bus, TransportError, twin::VirtualBus};
//! let bus = VirtualBus::default();
//! assert!(bus.list()?.is_empty());
//! let missing = toile_driver_transport::open_known(&bus, |info| info.vendor == 0x045e, "a Kinect");
//! assert!(matches!(missing.err(), Some(TransportError::NotFound { .. })));
//! # Ok::<(), TransportError>(())
//! ```

pub mod bus;
pub mod error;
pub mod known;
pub mod libusb;
pub mod transfer;
pub mod twin;
pub mod udev;
pub mod usb;
pub mod video;

pub use bus::{Bus, DeviceInfo, LinkSpeed, Setup, UsbDevice, choose, open_known, wait_for};
pub use error::TransportError;
pub use transfer::{PacketStatus, Transfer, TransferKind, TransferStatus};
