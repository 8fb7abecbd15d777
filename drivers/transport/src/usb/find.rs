//! Looks for a device on a bus: the first of a kind, one by its serial number, or one that is still to be plugged in.

use std::time::{Duration, Instant};

use super::{
    bus::{Bus, UsbDevice},
    info::DeviceInfo,
};
use crate::TransportError;

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

/// The first of `cameras` (each with its serial number, empty where it cannot be read), or that with this serial number;
/// `what` names their kind in the error.
///
/// # Errors
/// [`TransportError::NotFound`]; where one may not be opened, and so does not give its serial number, why.
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
    use crate::LinkSpeed;

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
