//! The real bus, through libusb.
//!
//! A thread of its own (`event_loop`) takes finished transfers from the kernel; `LibusbDevice` is an open
//! device; `transfer` is the crate's only unsafe code.

mod device;
mod event_loop;
#[allow(unsafe_code)]
mod transfer;

use std::{sync::Arc, time::Duration};

use rusb::UsbContext;

use crate::{Bus, DeviceInfo, LinkSpeed, TransportError, UsbDevice};
use device::LibusbDevice;
use event_loop::EventLoop;

/// The machine's USB.
pub struct LibusbBus {
    events: Arc<EventLoop>,
}

impl LibusbBus {
    /// Starts libusb with an event thread of its own, which ends with the last device that was opened.
    ///
    /// # Errors
    /// [`TransportError::Usb`] where there is no USB here.
    pub fn new() -> Result<Self, TransportError> {
        // `rusb::devices()` panics where there is no USB file system; a context of our own reports it.
        Ok(Self { events: Arc::new(EventLoop::start(rusb::Context::new()?)?) })
    }
}

impl Bus for LibusbBus {
    fn list(&self) -> Result<Vec<DeviceInfo>, TransportError> {
        let devices = self.events.context().devices()?;
        let mut infos: Vec<DeviceInfo> = devices.iter().filter_map(|device| info_of(&device)).collect();
        infos.sort_by_key(|info| info.address);
        Ok(infos)
    }

    fn open(&self, info: &DeviceInfo) -> Result<Box<dyn UsbDevice>, TransportError> {
        let devices = self.events.context().devices()?;
        let found = devices.iter().find(|device| info_of(device).as_ref() == Some(info));
        let device = found.ok_or_else(|| TransportError::NotFound { what: info.to_string() })?;
        let handle = device.open().map_err(|error| match error {
            rusb::Error::Access => TransportError::NoPermission { device: info.clone() },
            rusb::Error::Busy => TransportError::Busy { device: info.clone() },
            other => TransportError::from_libusb(other, "opening the device", Duration::ZERO),
        })?;
        Ok(Box::new(LibusbDevice::new(handle, info.clone(), self.events.clone())))
    }
}

/// The content of the descriptors; `None` where they cannot be read.
pub(crate) fn info_of(device: &rusb::Device<rusb::Context>) -> Option<DeviceInfo> {
    let descriptor = device.device_descriptor().ok()?;
    let rusb::Version(major, minor, sub) = descriptor.device_version();
    let mut hub = device.port_numbers().unwrap_or_default();
    hub.pop();
    Some(DeviceInfo {
        vendor: descriptor.vendor_id(),
        product: descriptor.product_id(),
        release: u16::from(major / 10) << 12
            | u16::from(major % 10) << 8
            | u16::from(minor & 15) << 4
            | u16::from(sub & 15),
        address: (device.bus_number(), device.address()),
        hub,
        speed: link_speed(device.speed()),
    })
}

fn link_speed(speed: rusb::Speed) -> LinkSpeed {
    match speed {
        rusb::Speed::Low | rusb::Speed::Full => LinkSpeed::Full,
        rusb::Speed::High => LinkSpeed::High,
        rusb::Speed::Super | rusb::Speed::SuperPlus => LinkSpeed::Super,
        _ => LinkSpeed::Unknown,
    }
}
