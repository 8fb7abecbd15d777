//! USB: the bus, open devices, transfers in flight, and which depth cameras are plugged in.

use std::time::Duration;

mod bus;
mod cameras;
mod find;
mod info;
pub mod known;
mod transfer;

pub use bus::{Bus, UsbDevice};
pub use cameras::{UsbCamera, list};
pub use find::{choose, open_known, wait_for};
pub use info::{DeviceInfo, LinkSpeed, Setup};
pub(crate) use transfer::PacketResult;
pub use transfer::{PacketStatus, Transfer, TransferKind, TransferStatus};

/// The time of an isochronous packet on the bus (USB 2.0 §8.4.3.1): an eighth of a millisecond.
pub const MICROFRAME: Duration = Duration::from_micros(125);
