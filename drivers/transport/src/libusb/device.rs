//! An open device through libusb.

use std::{
    sync::{
        Arc,
        mpsc::{self, Receiver, RecvTimeoutError, Sender},
    },
    time::{Duration, Instant},
};

use rusb::{Context, DeviceHandle};

use super::{
    event_loop::EventLoop,
    transfer::{Shared, submit},
};
use crate::{DeviceInfo, Setup, Transfer, TransferKind, TransferStatus, TransportError, UsbDevice};

/// How long dropping a device waits for its transfers.
const PATIENCE: Duration = Duration::from_secs(2);

/// An open device; see [`UsbDevice`].
pub struct LibusbDevice {
    shared: Arc<Shared>,
    info: DeviceInfo,
    serial: String,
    done: Receiver<Transfer>,
    to_done: Sender<Transfer>,
    gone: bool,
}

impl LibusbDevice {
    pub(super) fn new(handle: DeviceHandle<Context>, info: DeviceInfo, events: Arc<EventLoop>) -> Self {
        let descriptor = handle.device().device_descriptor();
        let serial = descriptor.and_then(|d| handle.read_serial_number_string_ascii(&d)).unwrap_or_default();
        let (to_done, done) = mpsc::channel();
        let shared = Arc::new(Shared::new(handle, events));
        Self { shared, info, serial, done, to_done, gone: false }
    }

    fn failed<T>(&mut self, error: rusb::Error, what: &str, limit: Duration) -> Result<T, TransportError> {
        self.gone |= error == rusb::Error::NoDevice;
        Err(TransportError::from_libusb(error, what, limit))
    }
}

impl UsbDevice for LibusbDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn serial(&self) -> &str {
        &self.serial
    }

    fn claim(&mut self, interface: u8, alternate: u8) -> Result<(), TransportError> {
        let handle = &self.shared.handle;
        // Where the system cannot detach kernel drivers, claiming says what is wrong.
        let _ = handle.set_auto_detach_kernel_driver(true);
        let claimed = handle.claim_interface(interface).and_then(|()| match alternate {
            0 => Ok(()),
            _ => handle.set_alternate_setting(interface, alternate),
        });
        match claimed {
            Ok(()) => Ok(()),
            Err(rusb::Error::Busy) => Err(TransportError::Busy { device: self.info.clone() }),
            Err(error) => self.failed(error, "claiming the interface", Duration::ZERO),
        }
    }

    fn set_alternate(&mut self, interface: u8, alternate: u8) -> Result<(), TransportError> {
        let set = self.shared.handle.set_alternate_setting(interface, alternate);
        set.or_else(|error| self.failed(error, "changing the alternate setting", Duration::ZERO))
    }

    fn control_in(&mut self, setup: Setup, data: &mut [u8], limit: Duration) -> Result<usize, TransportError> {
        let Setup { request_type, request, value, index, .. } = setup;
        let came = self.shared.handle.read_control(request_type, request, value, index, data, limit);
        came.or_else(|error| self.failed(error, &format!("control request {request:#04x}"), limit))
    }

    fn control_out(&mut self, setup: Setup, data: &[u8], limit: Duration) -> Result<usize, TransportError> {
        let Setup { request_type, request, value, index, .. } = setup;
        let went = self.shared.handle.write_control(request_type, request, value, index, data, limit);
        went.or_else(|error| self.failed(error, &format!("control request {request:#04x}"), limit))
    }

    fn bulk_in(&mut self, endpoint: u8, data: &mut [u8], limit: Duration) -> Result<usize, TransportError> {
        let came = self.shared.handle.read_bulk(endpoint, data, limit);
        came.or_else(|error| self.failed(error, &format!("reading endpoint {endpoint:#04x}"), limit))
    }

    fn bulk_out(&mut self, endpoint: u8, data: &[u8], limit: Duration) -> Result<usize, TransportError> {
        let went = self.shared.handle.write_bulk(endpoint, data, limit);
        went.or_else(|error| self.failed(error, &format!("writing endpoint {endpoint:#04x}"), limit))
    }

    fn iso_packet_size(&self, endpoint: u8) -> Option<usize> {
        let config = self.shared.handle.device().active_config_descriptor().ok()?;
        let endpoints = config.interfaces().flat_map(|i| i.descriptors().collect::<Vec<_>>());
        let sizes = endpoints.flat_map(|d| {
            let of_it = d.endpoint_descriptors().filter(|e| e.address() == endpoint);
            of_it.map(|e| packet_room(e.max_packet_size(), e.extra().unwrap_or_default())).collect::<Vec<_>>()
        });
        sizes.max().filter(|&size| size > 0)
    }

    fn submit(&mut self, mut transfer: Transfer) -> Result<(), TransportError> {
        if self.gone {
            return Err(TransportError::Unplugged);
        }
        transfer.clear();
        let what = match transfer.kind {
            TransferKind::Bulk => "starting a bulk transfer",
            TransferKind::Isochronous => "starting an isochronous transfer",
        };
        submit(&self.shared, transfer, self.to_done.clone()).or_else(|error| self.failed(error, what, Duration::ZERO))
    }

    fn wait(&mut self, limit: Duration) -> Result<Transfer, TransportError> {
        if self.gone && self.in_flight() == 0 {
            return self.done.try_recv().map_err(|_| TransportError::Unplugged);
        }
        match self.done.recv_timeout(limit) {
            Ok(transfer) => {
                self.gone |= transfer.status == TransferStatus::Unplugged;
                Ok(transfer)
            }
            Err(_) if self.gone && self.in_flight() == 0 => Err(TransportError::Unplugged),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                Err(TransportError::TimedOut { what: "waiting for a transfer".into(), waited: limit })
            }
        }
    }

    fn in_flight(&self) -> usize {
        self.shared.flights.count()
    }

    fn cancel(&mut self, limit: Duration) -> usize {
        self.shared.flights.cancel();
        let start = Instant::now();
        while self.in_flight() > 0 && start.elapsed() < limit {
            // Whatever comes back is dropped here; the short wait looks at the count again.
            drop(self.done.recv_timeout(Duration::from_millis(10)));
        }
        while self.done.try_recv().is_ok() {}
        self.in_flight()
    }
}

impl Drop for LibusbDevice {
    fn drop(&mut self) {
        let left = self.cancel(PATIENCE);
        if left > 0 {
            tracing::warn!(device = %self.info, left, "transfers did not come back; their memory is left to the system");
        }
    }
}

/// Bytes of one packet by an endpoint's `wMaxPacketSize` and the descriptors behind it.
fn packet_room(max_packet_size: u16, mut behind: &[u8]) -> usize {
    // The companion of a USB 3 endpoint says it itself: wBytesPerInterval (USB 3.2 table 9-31).
    while let [length, kind, rest @ ..] = behind {
        if let (6, 0x30, [_, _, low, high, ..]) = (length, kind, rest) {
            return usize::from(u16::from_le_bytes([*low, *high]));
        }
        behind = behind.get(usize::from(*length).max(2)..).unwrap_or_default();
    }
    // Bits 12:11 say how many more transactions a microframe has (USB 2.0 table 9-13).
    usize::from(max_packet_size & 0x7ff) * (1 + usize::from(max_packet_size >> 11 & 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_of_packets_by_the_descriptors() {
        assert_eq!(packet_room(0x0bc0, &[]), 1920);
        // Eleven bursts of three times 1024 bytes, as the Kinect v2 states.
        assert_eq!(packet_room(1024, &[6, 0x30, 10, 2, 0x00, 0x84]), 33_792);
        assert_eq!(packet_room(1024, &[3, 0x24, 9, 6, 0x30, 0, 0, 0, 4]), 1024);
        for broken in [&[6, 0x30, 10][..], &[0, 0, 0], &[0]] {
            assert_eq!(packet_room(0x0bc0, broken), 1920);
        }
    }
}
