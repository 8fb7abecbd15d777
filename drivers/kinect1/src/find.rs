//! Kinects on a bus, and their serial numbers.

use toile_driver_transport::{Bus, DeviceInfo, TransportError};

use crate::Kinect1Error;

/// Microsoft's vendor id and the cameras' product ids (libfreenect `src/freenect_internal.h`).
pub(crate) const MICROSOFT: u16 = 0x045e;
const CAMERAS: [u16; 2] = [0x02ae, 0x02bf];
pub(crate) const KINECT_FOR_WINDOWS: u16 = 0x02bf;
/// Product ids of the microphones, whose serial number stands for the camera's in models after 1414.
const MICROPHONES: [u16; 4] = [0x02ad, 0x02be, 0x02c3, 0x02bb];
/// The text that those cameras report instead of a serial number (libfreenect `src/usb_libusb10.c`).
const NO_SERIAL: &str = "0000000000000000";

/// The Kinects on a bus, each with its serial number (empty where it cannot be read).
///
/// # Errors
/// [`Kinect1Error::Transport`] where the bus cannot be read.
pub fn list(bus: &dyn Bus) -> Result<Vec<(DeviceInfo, String)>, Kinect1Error> {
    let cameras = bus.list()?.into_iter().filter(is_camera);
    Ok(cameras.map(|info| (serial_of(bus, &info).unwrap_or_default(), info)).map(|(s, i)| (i, s)).collect())
}

fn is_camera(info: &DeviceInfo) -> bool {
    info.vendor == MICROSOFT && CAMERAS.contains(&info.product)
}

fn serial_of(bus: &dyn Bus, camera: &DeviceInfo) -> Result<String, TransportError> {
    let stated = bus.open(camera)?.serial().to_string();
    if !stated.is_empty() && stated != NO_SERIAL {
        return Ok(stated);
    }
    let beside =
        |info: &DeviceInfo| info.vendor == MICROSOFT && MICROPHONES.contains(&info.product) && info.hub == camera.hub;
    let found = bus.list()?.into_iter().find(|info| beside(info) && info.address.0 == camera.address.0);
    found.map_or(Ok(String::new()), |info| Ok(bus.open(&info)?.serial().to_string()))
}
