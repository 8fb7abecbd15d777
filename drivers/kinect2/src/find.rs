//! Kinects on a bus, and their serial numbers.

use toile_driver_transport::{Bus, DeviceInfo};

use crate::Kinect2Error;

/// Microsoft's vendor id and the cameras' product ids (libfreenect2 `libfreenect2.hpp`).
const MICROSOFT: u16 = 0x045e;
const CAMERAS: [u16; 2] = [0x02d8, 0x02c4];

/// The Kinects on a bus, each with its serial number (empty where it cannot be read).
///
/// # Errors
/// [`Kinect2Error::Transport`] where the bus cannot be read.
pub fn list(bus: &dyn Bus) -> Result<Vec<(DeviceInfo, String)>, Kinect2Error> {
    let cameras = bus.list()?.into_iter().filter(|info| info.vendor == MICROSOFT && CAMERAS.contains(&info.product));
    let serial =
        |info: &DeviceInfo| bus.open(info).map_or_else(|_| String::new(), |device| device.serial().to_string());
    Ok(cameras.map(|info| (serial(&info), info)).map(|(serial, info)| (info, serial)).collect())
}
