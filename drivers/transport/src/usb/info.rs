//! Facts about a device that is not open, and the requests that it is sent.

use std::fmt;

use serde::Serialize;

/// How fast a device is linked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinkSpeed {
    /// The system does not say.
    Unknown,
    /// USB 1: 12 Mbit/s or less.
    Full,
    /// USB 2: 480 Mbit/s.
    High,
    /// USB 3: 5 Gbit/s or more.
    Super,
}

/// A device on the bus, known without opening it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DeviceInfo {
    /// USB vendor id.
    pub vendor: u16,
    /// USB product id.
    pub product: u16,
    /// Release number of the device (`bcdDevice`).
    pub release: u16,
    /// Bus and address; a device that is plugged in again gets another address.
    pub address: (u8, u8),
    /// Ports from the root to the device's hub, without the device's own: equal for devices inside one housing.
    pub hub: Vec<u8>,
    /// Speed of its link.
    pub speed: LinkSpeed,
}

impl fmt::Display for DeviceInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (bus, address) = self.address;
        write!(f, "usb {bus:03}:{address:03} ({:04x}:{:04x})", self.vendor, self.product)
    }
}

/// The eight bytes that begin a control request (USB 2.0 §9.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Setup {
    /// Direction (bit 7: device to host), type and recipient.
    pub request_type: u8,
    /// The request.
    pub request: u8,
    /// Its value.
    pub value: u16,
    /// Its index.
    pub index: u16,
    /// Bytes that follow, or at most may be answered.
    pub length: u16,
}

impl Setup {
    /// A vendor's request to the device as a whole: host to device.
    pub const fn vendor_out(request: u8, value: u16) -> Self {
        Self { request_type: 0x40, request, value, index: 0, length: 0 }
    }

    /// A vendor's request to the device as a whole: device to host.
    pub const fn vendor_in(request: u8, value: u16) -> Self {
        Self { request_type: 0xc0, request, value, index: 0, length: 0 }
    }
}
