//! Errors between a program and a USB device.

use std::{io, path::Path, time::Duration};

use crate::{DeviceInfo, udev::advice};

/// The error of Linux for a node whose device was unplugged.
const ENODEV: i32 = 19;

/// Errors of the transport crate.
#[derive(Debug, thiserror::Error)]
pub enum TransportError {
    /// libusb cannot start or list.
    #[error("USB cannot be read: {0}; is /dev/bus/usb there and readable?")]
    Usb(#[from] rusb::Error),
    /// The udev rule could not be written.
    #[error("{path}: {source}; run the command as root (sudo)")]
    Rule {
        /// Where the rule should go.
        path: std::path::PathBuf,
        /// The system's message.
        source: std::io::Error,
    },
    /// Nothing of the kind is plugged in.
    #[error("{what} is not plugged in; check the cable and its power supply, and see `toile devices`")]
    NotFound {
        /// The thing that was looked for.
        what: String,
    },
    /// The device went away.
    #[error("the device was unplugged; plug it in and open it again")]
    Unplugged,
    /// This user may not open the device.
    #[error("{device}: no permission to open it. {}", advice(.device.vendor))]
    NoPermission {
        /// Which device.
        device: DeviceInfo,
    },
    /// Another program or a kernel driver holds the device.
    #[error("{device}: another program holds it; close that program")]
    Busy {
        /// Which device.
        device: DeviceInfo,
    },
    /// An answer did not come in time.
    #[error("{what}: no answer in {} ms", .waited.as_millis())]
    TimedOut {
        /// The request.
        what: String,
        /// For how long.
        waited: Duration,
    },
    /// The device refused a request.
    #[error("{what}: the device refused it (stall)")]
    Stalled {
        /// The request.
        what: String,
    },
    /// This user may not open the video node.
    #[error("{node}: no permission to open it. {advice}")]
    NodePermission {
        /// Device node.
        node: std::path::PathBuf,
        /// The command.
        advice: String,
    },
    /// A video node could not be opened or driven.
    #[error("{node}: cannot {action}: {source}")]
    Video {
        /// Device node.
        node: std::path::PathBuf,
        /// The attempt.
        action: &'static str,
        /// The system's message.
        source: std::io::Error,
    },
    /// The kernel's memory for USB transfers is used up, perhaps by another program.
    #[error(
        "{what}: the kernel has no memory left for USB transfers; allow more with \
         `echo 64 | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb`, or close other programs that use cameras"
    )]
    NoMemory {
        /// The request.
        what: String,
    },
    /// Anything else that libusb reports.
    #[error("{what}: {source}")]
    Failed {
        /// The request.
        what: String,
        /// libusb's message.
        source: rusb::Error,
    },
}

impl TransportError {
    /// Sorts an error of libusb into what a caller can act on.
    pub fn from_libusb(error: rusb::Error, what: &str, waited: Duration) -> Self {
        let what = what.to_string();
        match error {
            rusb::Error::NoDevice => Self::Unplugged,
            rusb::Error::Timeout => Self::TimedOut { what, waited },
            rusb::Error::Pipe => Self::Stalled { what },
            rusb::Error::NoMem => Self::NoMemory { what },
            source => Self::Failed { what, source },
        }
    }

    /// Sorts an error of a video node into what a caller can act on.
    pub(crate) fn from_video(node: &Path, action: &'static str, source: io::Error) -> Self {
        match source.raw_os_error() {
            Some(ENODEV) => Self::Unplugged,
            _ => Self::Video { node: node.into(), action, source },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_error_of_libusb_that_a_caller_can_act_on_has_a_variant_of_its_own() {
        let sorted = |error| TransportError::from_libusb(error, "starting a transfer", Duration::ZERO);
        assert!(matches!(sorted(rusb::Error::NoDevice), TransportError::Unplugged));
        assert!(matches!(sorted(rusb::Error::Timeout), TransportError::TimedOut { .. }));
        assert!(matches!(sorted(rusb::Error::Pipe), TransportError::Stalled { .. }));
        let memory = sorted(rusb::Error::NoMem);
        assert!(matches!(&memory, TransportError::NoMemory { what } if what == "starting a transfer"));
        assert!(memory.to_string().contains("usbfs_memory_mb"), "{memory}");
        assert!(matches!(sorted(rusb::Error::Io), TransportError::Failed { .. }));
    }
}
