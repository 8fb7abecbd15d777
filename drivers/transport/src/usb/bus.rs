//! USB as a program sees it: a bus that lists and opens devices, and open devices.

use std::time::Duration;

use super::info::{DeviceInfo, Setup};
use crate::{Transfer, TransportError};

/// A bus that lists and opens devices.
pub trait Bus: Send + Sync {
    /// The devices that are plugged in now, ordered by address.
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
    /// The thing that was opened.
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
