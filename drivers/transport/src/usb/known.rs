//! Devices known by vendor and product id.

use serde::Serialize;

/// A family of depth cameras.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Kinect for Xbox 360 and Kinect for Windows v1.
    Kinect1,
    /// Kinect for Xbox One and Kinect for Windows v2.
    Kinect2,
    /// Intel RealSense D400.
    Realsense,
    /// Orbbec cameras (UVC or OpenNI).
    Orbbec,
}

/// One vendor and product id.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Known {
    /// USB vendor id.
    pub vendor: u16,
    /// USB product id.
    pub product: u16,
    /// The name that people use.
    pub name: &'static str,
    /// Its family.
    pub family: Family,
    /// True where it streams only over USB 3.
    pub needs_usb3: bool,
}

const fn known(vendor: u16, product: u16, name: &'static str, family: Family, needs_usb3: bool) -> Known {
    Known { vendor, product, name, family, needs_usb3 }
}

/// Ids as libfreenect (`src/usb_libusb10.h`), libfreenect2 (`libfreenect2.cpp`) and librealsense
/// (`src/ds/d400/d400-private.h`) list them.
pub const KNOWN: &[Known] = &[
    known(0x045e, 0x02ae, "Kinect v1 camera", Family::Kinect1, false),
    known(0x045e, 0x02bf, "Kinect for Windows v1 camera", Family::Kinect1, false),
    known(0x045e, 0x02c4, "Kinect v2", Family::Kinect2, true),
    known(0x045e, 0x02d8, "Kinect v2", Family::Kinect2, true),
    known(0x8086, 0x0ad1, "RealSense D400", Family::Realsense, false),
    known(0x8086, 0x0ad2, "RealSense D410", Family::Realsense, false),
    known(0x8086, 0x0ad3, "RealSense D415", Family::Realsense, false),
    known(0x8086, 0x0b07, "RealSense D435", Family::Realsense, false),
    known(0x8086, 0x0b3a, "RealSense D435i", Family::Realsense, false),
    known(0x8086, 0x0b5b, "RealSense D405", Family::Realsense, false),
    known(0x8086, 0x0b5c, "RealSense D455", Family::Realsense, false),
];

/// Orbbec's vendor id: all its products are listed.
const ORBBEC: u16 = 0x2bc5;

/// The known device with these ids.
pub fn find(vendor: u16, product: u16) -> Option<Known> {
    if vendor == ORBBEC {
        return Some(known(vendor, product, "Orbbec camera", Family::Orbbec, false));
    }
    KNOWN.iter().find(|k| k.vendor == vendor && k.product == product).copied()
}

/// All vendor ids that [`find`] may answer for, ascending.
pub fn vendors() -> Vec<u16> {
    let mut ids: Vec<u16> = KNOWN.iter().map(|k| k.vendor).chain([ORBBEC]).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_unique_and_found() {
        for (i, k) in KNOWN.iter().enumerate() {
            assert_eq!(find(k.vendor, k.product), Some(*k));
            assert!(KNOWN[..i].iter().all(|o| (o.vendor, o.product) != (k.vendor, k.product)));
        }
        assert_eq!(find(0x2bc5, 0x0636).map(|k| k.family), Some(Family::Orbbec));
        assert_eq!(find(0x1234, 0x5678), None);
    }
}
