//! What a program sees of USB: a bus that lists and opens, and open devices.

use std::{
    fmt,
    time::{Duration, Instant},
};

use serde::Serialize;

use crate::{Transfer, TransportError};

/// How fast a device is linked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinkSpeed {
    /// Not told by the system.
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

/// A bus that lists and opens devices.
pub trait Bus: Send + Sync {
    /// What is plugged in now, ordered by address.
    ///
    /// # Errors
    /// [`TransportError::Usb`] where the bus cannot be read at all.
    fn list(&self) -> Result<Vec<DeviceInfo>, TransportError>;

    /// Opens a device of the list.
    ///
    /// # Errors
    /// [`TransportError::NotFound`], [`TransportError::NoPermission`], [`TransportError::Busy`].
    fn open(&self, info: &DeviceInfo) -> Result<Box<dyn UsbDevice>, TransportError>;
}

/// An open device. One thread drives it; dropping it ends its transfers, gives its interfaces back and never hangs.
///
/// Transfers complete in the order of their bus time and are handed out by [`Self::wait`]; after an unplug those in
/// flight come back as [`crate::TransferStatus::Unplugged`] and everything else fails with
/// [`TransportError::Unplugged`].
pub trait UsbDevice: Send {
    /// What was opened.
    fn info(&self) -> &DeviceInfo;

    /// Its serial number; empty where it has none.
    fn serial(&self) -> &str;

    /// Takes an interface (from a kernel driver where one has it) in an alternate setting.
    ///
    /// # Errors
    /// [`TransportError::Busy`] where another program has it.
    fn claim(&mut self, interface: u8, alternate: u8) -> Result<(), TransportError>;

    /// Changes the alternate setting of an interface that was claimed.
    ///
    /// # Errors
    /// As [`Self::control_in`].
    fn set_alternate(&mut self, interface: u8, alternate: u8) -> Result<(), TransportError>;

    /// A control request that brings data; returns how many bytes came. `setup.length` is set from `data`.
    ///
    /// # Errors
    /// [`TransportError::Stalled`], [`TransportError::TimedOut`], [`TransportError::Unplugged`].
    fn control_in(&mut self, setup: Setup, data: &mut [u8], limit: Duration) -> Result<usize, TransportError>;

    /// A control request that takes data; returns how many bytes went.
    ///
    /// # Errors
    /// As [`Self::control_in`].
    fn control_out(&mut self, setup: Setup, data: &[u8], limit: Duration) -> Result<usize, TransportError>;

    /// Reads once from a bulk endpoint.
    ///
    /// # Errors
    /// As [`Self::control_in`].
    fn bulk_in(&mut self, endpoint: u8, data: &mut [u8], limit: Duration) -> Result<usize, TransportError>;

    /// Writes once to a bulk endpoint.
    ///
    /// # Errors
    /// As [`Self::control_in`].
    fn bulk_out(&mut self, endpoint: u8, data: &[u8], limit: Duration) -> Result<usize, TransportError>;

    /// Bytes that one packet of an isochronous endpoint may have (transactions of a microframe, or of USB 3's service
    /// interval, together).
    fn iso_packet_size(&self, endpoint: u8) -> Option<usize>;

    /// Sends a transfer on its way; it comes back from [`Self::wait`].
    ///
    /// # Errors
    /// [`TransportError::Unplugged`], or what libusb says; the transfer is then gone.
    fn submit(&mut self, transfer: Transfer) -> Result<(), TransportError>;

    /// The next transfer that is done, however it went.
    ///
    /// # Errors
    /// [`TransportError::TimedOut`] where none is done in time; [`TransportError::Unplugged`] where none is in flight
    /// and the device is gone.
    fn wait(&mut self, limit: Duration) -> Result<Transfer, TransportError>;

    /// How many transfers are in flight.
    fn in_flight(&self) -> usize;

    /// Cancels all transfers in flight and waits for them, at most `limit`. Returns how many did not come back: their
    /// memory stays the kernel's, so that nothing else can be written over.
    fn cancel(&mut self, limit: Duration) -> usize;
}

/// Opens the first device that `is_it` accepts; `what` names it in the error.
///
/// # Errors
/// [`TransportError::NotFound`] and what [`Bus::open`] says.
pub fn open_known(
    bus: &dyn Bus,
    is_it: impl Fn(&DeviceInfo) -> bool,
    what: &str,
) -> Result<Box<dyn UsbDevice>, TransportError> {
    let found = bus.list()?.into_iter().find(|info| is_it(info));
    bus.open(&found.ok_or_else(|| TransportError::NotFound { what: what.into() })?)
}

/// The first of `cameras` (each with its serial number, empty where it cannot be told), or that with this serial number;
/// `what` names their kind in the error.
///
/// # Errors
/// [`TransportError::NotFound`]; where one may not be opened, and so does not tell its serial number, why.
pub fn choose(
    bus: &dyn Bus,
    cameras: Vec<(DeviceInfo, String)>,
    what: &str,
    serial: Option<&str>,
) -> Result<(DeviceInfo, String), TransportError> {
    let silent: Vec<DeviceInfo> =
        cameras.iter().filter(|(_, its)| its.is_empty()).map(|(info, _)| info.clone()).collect();
    let found = cameras.into_iter().find(|(_, its)| serial.is_none_or(|wanted| wanted == its));
    found.ok_or_else(|| {
        let refused = silent.iter().find_map(|info| bus.open(info).err());
        let what = || serial.map_or(what.to_string(), |serial| format!("{what} with serial number {serial}"));
        refused.unwrap_or_else(|| TransportError::NotFound { what: what() })
    })
}

/// Waits until a device that `is_it` accepts is plugged in. The bus is asked ten times a second: libusb's own
/// notices need netlink or udev, which containers do not have.
///
/// # Errors
/// [`TransportError::TimedOut`] where none comes in time.
pub fn wait_for(
    bus: &dyn Bus,
    is_it: impl Fn(&DeviceInfo) -> bool,
    limit: Duration,
) -> Result<DeviceInfo, TransportError> {
    let start = Instant::now();
    loop {
        if let Some(found) = bus.list()?.into_iter().find(|info| is_it(info)) {
            return Ok(found);
        }
        if start.elapsed() >= limit {
            return Err(TransportError::TimedOut {
                what: "waiting for a device to be plugged in".into(),
                waited: limit,
            });
        }
        std::thread::sleep(Duration::from_millis(100).min(limit));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bus on which nothing may be opened.
    struct Locked(DeviceInfo);

    impl Bus for Locked {
        fn list(&self) -> Result<Vec<DeviceInfo>, TransportError> {
            Ok(vec![self.0.clone()])
        }

        fn open(&self, info: &DeviceInfo) -> Result<Box<dyn UsbDevice>, TransportError> {
            Err(TransportError::NoPermission { device: info.clone() })
        }
    }

    #[test]
    fn a_camera_that_may_not_be_opened_is_not_called_unplugged() {
        let info = DeviceInfo {
            vendor: 0x045e,
            product: 0x02ae,
            release: 0,
            address: (1, 7),
            hub: Vec::new(),
            speed: LinkSpeed::High,
        };
        let bus = Locked(info.clone());
        let choose = |its: &str, serial| choose(&bus, vec![(info.clone(), its.into())], "a Kinect v1", serial);
        assert!(matches!(choose("", Some("A1")), Err(TransportError::NoPermission { .. })));
        assert!(matches!(choose("B2", Some("A1")), Err(TransportError::NotFound { what }) if what.contains("A1")));
        assert!(choose("", None).is_ok() && choose("A1", Some("A1")).is_ok());
    }
}
