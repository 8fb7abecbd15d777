//! USB: what is plugged in, at which speed, and the permission to use it.
//!
//! - [`usb::list`]: the depth cameras on the bus (through rusb), with what is wrong with each;
//! - [`known`]: the devices that Toile knows by vendor and product id;
//! - [`udev`]: the rule that gives a user access to them.

pub mod known;
pub mod udev;
pub mod usb;

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
        /// What the system said.
        source: std::io::Error,
    },
}
