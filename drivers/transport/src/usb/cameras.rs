//! Depth cameras on the bus.

use rusb::UsbContext;
use serde::Serialize;

use super::{
    info::LinkSpeed,
    known::{self, Known},
};
use crate::{TransportError, libusb::info_of, udev};

/// A known camera that is plugged in.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UsbCamera {
    /// The name that people use.
    pub name: &'static str,
    /// Its family.
    pub family: known::Family,
    /// Vendor and product id.
    pub id: (u16, u16),
    /// Bus and address.
    pub address: (u8, u8),
    /// Speed of its link.
    pub speed: LinkSpeed,
    /// The problems that keep it from working, each with its remedy; empty where all is well.
    pub problems: Vec<String>,
}

/// Lists the known cameras, ordered by bus and address.
///
/// # Errors
/// [`TransportError::Usb`] where USB cannot be read at all.
pub fn list() -> Result<Vec<UsbCamera>, TransportError> {
    // `rusb::devices()` panics where there is no USB file system; a context of our own reports it.
    let context = rusb::Context::new()?;
    let mut cameras = Vec::new();
    for device in context.devices()?.iter() {
        let Some(info) = info_of(&device) else { continue };
        let Some(known) = known::find(info.vendor, info.product) else { continue };
        let opened = device.open().map(|_| ());
        cameras.push(UsbCamera {
            name: known.name,
            family: known.family,
            id: (known.vendor, known.product),
            address: info.address,
            speed: info.speed,
            problems: problems(&known, info.speed, opened),
        });
    }
    cameras.sort_by_key(|c| c.address);
    Ok(cameras)
}

fn problems(known: &Known, speed: LinkSpeed, opened: Result<(), rusb::Error>) -> Vec<String> {
    let mut found = Vec::new();
    if known.needs_usb3 && speed != LinkSpeed::Super && speed != LinkSpeed::Unknown {
        found.push("it is on a USB 2 link but streams only over USB 3: use a blue port and a USB 3 cable".to_string());
    } else if known.family == known::Family::Realsense && speed == LinkSpeed::High {
        found.push("it is on a USB 2 link, which halves its frame rate: use a blue port and a USB 3 cable".to_string());
    }
    match opened {
        // Their video nodes are opened instead.
        Err(_) if matches!(known.family, known::Family::Realsense | known::Family::Orbbec) => {}
        Err(rusb::Error::Access) => found.push(format!("no permission to open it. {}", udev::advice(known.vendor))),
        Err(rusb::Error::Busy) => found.push("another program holds it: close that program".to_string()),
        Err(rusb::Error::NoDevice) => found.push("it was unplugged just now: plug it in again".to_string()),
        Err(other) => found.push(format!("it cannot be opened: {other}")),
        Ok(()) => {}
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_link_and_a_missing_permission_are_reported_with_a_remedy() {
        let kinect2 = known::find(0x045e, 0x02c4).unwrap();
        let both = problems(&kinect2, LinkSpeed::High, Err(rusb::Error::Access));
        assert_eq!(both.len(), 2);
        assert!(both[0].contains("USB 3"));
        assert!(both[1].contains("--install-udev-rules") && both[1].contains("ATTRS{idVendor}==\"045e\""));
        assert!(problems(&kinect2, LinkSpeed::Super, Ok(())).is_empty());
        let kinect1 = known::find(0x045e, 0x02ae).unwrap();
        assert!(problems(&kinect1, LinkSpeed::High, Ok(())).is_empty());
        let realsense = known::find(0x8086, 0x0b07).unwrap();
        assert_eq!(problems(&realsense, LinkSpeed::High, Ok(())).len(), 1);
        assert!(problems(&realsense, LinkSpeed::Super, Ok(())).is_empty());
    }

    #[test]
    fn listing_never_panics_with_or_without_usb() {
        match list() {
            Ok(cameras) => assert!(cameras.is_sorted_by_key(|c| c.address)),
            Err(error) => assert!(error.to_string().contains("/dev/bus/usb")),
        }
    }
}
