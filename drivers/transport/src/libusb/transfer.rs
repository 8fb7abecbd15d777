//! Transfers in flight; with `video/` the only unsafe code of the project.
//!
//! Invariants that the SAFETY lines name:
//!
//! - *flight*: from submitting to its callback a transfer's memory belongs to one leaked `Box<Flight>` whose address
//!   is the transfer's `user_data`; the callback runs exactly once and takes the box back;
//! - *alive*: the flight holds the open handle (and with it the event thread), so libusb never loses either while a
//!   transfer is out, however long the kernel keeps it;
//! - *listed*: a transfer's pointer is in [`Flights`] from before submitting until its callback takes it out, under the
//!   same lock that cancelling holds; a listed pointer is therefore never freed.

use std::{
    collections::BTreeMap,
    ffi::c_void,
    io,
    ptr::NonNull,
    sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc::Sender},
};

use rusb::{
    Context, DeviceHandle,
    constants::{
        LIBUSB_TRANSFER_CANCELLED, LIBUSB_TRANSFER_COMPLETED, LIBUSB_TRANSFER_NO_DEVICE, LIBUSB_TRANSFER_OVERFLOW,
        LIBUSB_TRANSFER_STALL, LIBUSB_TRANSFER_TYPE_BULK, LIBUSB_TRANSFER_TYPE_ISOCHRONOUS,
    },
    ffi::{
        libusb_alloc_transfer, libusb_cancel_transfer, libusb_free_transfer, libusb_submit_transfer, libusb_transfer,
    },
};

use super::event_loop::EventLoop;
use crate::{PacketStatus, Transfer, TransferKind, TransferStatus, usb::PacketResult};

/// The error of Linux where `usbcore.usbfs_memory_mb` is used up.
const ENOMEM: i32 = 12;

/// Kept alive by transfers in flight: the handle first, then the thread that finishes them.
pub(super) struct Shared {
    pub(super) handle: DeviceHandle<Context>,
    pub(super) flights: Flights,
    _events: Arc<EventLoop>,
}

impl Shared {
    pub(super) fn new(handle: DeviceHandle<Context>, events: Arc<EventLoop>) -> Self {
        Self { handle, flights: Flights::default(), _events: events }
    }
}

/// The transfers of a device that are in flight.
#[derive(Default)]
pub(super) struct Flights(Mutex<Listed>);

#[derive(Default)]
struct Listed {
    next: u64,
    out: BTreeMap<u64, Pointer>,
}

/// A listed transfer.
struct Pointer(NonNull<libusb_transfer>);

// SAFETY: *listed*: the pointer is only used under the lock of `Flights`, and libusb's calls are thread-safe.
unsafe impl Send for Pointer {}

/// Owned by one transfer in flight.
struct Flight {
    transfer: Transfer,
    shared: Arc<Shared>,
    done: Sender<Transfer>,
    number: u64,
}

impl Flights {
    pub(super) fn count(&self) -> usize {
        self.lock().out.len()
    }

    /// Asks the kernel to give all transfers back; each still comes through its callback.
    pub(super) fn cancel(&self) {
        for Pointer(pointer) in self.lock().out.values() {
            // SAFETY: *listed*: the transfer is not freed while we hold the lock. One that is done already answers
            // "not found", which is fine.
            unsafe { libusb_cancel_transfer(pointer.as_ptr()) };
        }
    }

    fn lock(&self) -> MutexGuard<'_, Listed> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn add(&self, pointer: NonNull<libusb_transfer>) -> u64 {
        let mut listed = self.lock();
        listed.next += 1;
        let number = listed.next;
        listed.out.insert(number, Pointer(pointer));
        number
    }

    fn remove(&self, number: u64) {
        self.lock().out.remove(&number);
    }
}

/// Sends a transfer on its way; it comes back through `done`.
pub(super) fn submit(shared: &Arc<Shared>, transfer: Transfer, done: Sender<Transfer>) -> Result<(), rusb::Error> {
    let packets = i32::try_from(transfer.packets.len()).map_err(|_| rusb::Error::InvalidParam)?;
    let length = i32::try_from(transfer.bytes.len()).map_err(|_| rusb::Error::InvalidParam)?;
    let packet_size = u32::try_from(transfer.packet_size).map_err(|_| rusb::Error::InvalidParam)?;
    // SAFETY: `packets` is not negative; a null result is handled.
    let pointer = NonNull::new(unsafe { libusb_alloc_transfer(packets) }).ok_or(rusb::Error::NoMem)?;
    let number = shared.flights.add(pointer);
    let flight = Box::into_raw(Box::new(Flight { transfer, shared: shared.clone(), done, number }));
    // SAFETY: `flight` and `pointer` are fresh and ours alone until the transfer is submitted. The bytes are on the
    // heap and stay where they are while the box is leaked (*flight*). libusb allocated `packets` descriptors behind
    // the transfer, so writing that many is in bounds.
    unsafe {
        let (out, flight) = (pointer.as_ptr(), &mut *flight);
        (*out).dev_handle = shared.handle.as_raw();
        (*out).endpoint = flight.transfer.endpoint;
        (*out).transfer_type = match flight.transfer.kind {
            TransferKind::Bulk => LIBUSB_TRANSFER_TYPE_BULK,
            TransferKind::Isochronous => LIBUSB_TRANSFER_TYPE_ISOCHRONOUS,
        };
        (*out).timeout = 0;
        (*out).buffer = flight.transfer.bytes.as_mut_ptr();
        (*out).length = length;
        (*out).num_iso_packets = packets;
        (*out).callback = finished;
        (*out).user_data = std::ptr::from_mut(flight).cast::<c_void>();
        let descriptors = (&raw mut (*out).iso_packet_desc).cast::<rusb::ffi::libusb_iso_packet_descriptor>();
        for i in 0..packets as usize {
            (*descriptors.add(i)).length = packet_size;
        }
    }
    // SAFETY: the transfer is filled in; from here it is libusb's until the callback (*flight*, *alive*).
    match unsafe { libusb_submit_transfer(pointer.as_ptr()) } {
        0 => Ok(()),
        code => {
            // libusb reports one error for everything that the kernel says.
            let says_no_memory = io::Error::last_os_error().raw_os_error() == Some(ENOMEM);
            shared.flights.remove(number);
            // SAFETY: the submission failed, so no callback will run and both are ours again.
            unsafe {
                libusb_free_transfer(pointer.as_ptr());
                drop(Box::from_raw(flight));
            }
            Err(if says_no_memory { rusb::Error::NoMem } else { error_of(code) })
        }
    }
}

/// libusb's callback, on the event thread.
extern "system" fn finished(pointer: *mut libusb_transfer) {
    // SAFETY: libusb calls this once a submitted transfer; `user_data` is its leaked box (*flight*).
    let mut flight = unsafe { Box::from_raw((*pointer).user_data.cast::<Flight>()) };
    // SAFETY: the transfer is done: libusb does not write to it any more, and it is freed only below.
    unsafe { take_results(pointer, &mut flight.transfer) };
    let Flight { transfer, shared, done, number } = *flight;
    // Sent before it is off the list: where none is in flight, all have come. Nobody waits any more when the device was
    // dropped.
    drop(done.send(transfer));
    shared.flights.remove(number);
    // SAFETY: the pointer was taken off the list under its lock, so nobody cancels it (*listed*).
    unsafe { libusb_free_transfer(pointer) };
    drop(shared);
}

/// Copies what libusb reports into the transfer.
///
/// # Safety
/// `pointer` is a finished transfer with as many packet descriptors as `transfer` has packets.
unsafe fn take_results(pointer: *mut libusb_transfer, transfer: &mut Transfer) {
    // SAFETY: by this function's contract.
    let (status, length) = unsafe { ((*pointer).status, (*pointer).actual_length) };
    transfer.status = status_of(status);
    transfer.length = usize::try_from(length).unwrap_or(0);
    // SAFETY: as above; the descriptors stand behind the transfer.
    let descriptors =
        unsafe { (&raw const (*pointer).iso_packet_desc) }.cast::<rusb::ffi::libusb_iso_packet_descriptor>();
    for (i, packet) in transfer.packets.iter_mut().enumerate() {
        // SAFETY: `i` is below the number of descriptors that were allocated.
        let descriptor = unsafe { &*descriptors.add(i) };
        let came = descriptor.status == LIBUSB_TRANSFER_COMPLETED && status == LIBUSB_TRANSFER_COMPLETED;
        *packet = PacketResult {
            status: if came { PacketStatus::Completed } else { PacketStatus::Failed },
            length: if came { descriptor.actual_length as usize } else { 0 },
        };
    }
}

fn status_of(code: i32) -> TransferStatus {
    match code {
        LIBUSB_TRANSFER_COMPLETED => TransferStatus::Completed,
        LIBUSB_TRANSFER_CANCELLED => TransferStatus::Cancelled,
        LIBUSB_TRANSFER_STALL => TransferStatus::Stalled,
        LIBUSB_TRANSFER_NO_DEVICE => TransferStatus::Unplugged,
        LIBUSB_TRANSFER_OVERFLOW => TransferStatus::Overflow,
        _ => TransferStatus::Failed,
    }
}

fn error_of(code: i32) -> rusb::Error {
    use rusb::constants::{
        LIBUSB_ERROR_BUSY, LIBUSB_ERROR_INVALID_PARAM, LIBUSB_ERROR_IO, LIBUSB_ERROR_NO_DEVICE, LIBUSB_ERROR_NO_MEM,
        LIBUSB_ERROR_NOT_FOUND, LIBUSB_ERROR_NOT_SUPPORTED,
    };
    match code {
        LIBUSB_ERROR_NO_DEVICE => rusb::Error::NoDevice,
        LIBUSB_ERROR_NOT_FOUND => rusb::Error::NotFound,
        LIBUSB_ERROR_BUSY => rusb::Error::Busy,
        LIBUSB_ERROR_INVALID_PARAM => rusb::Error::InvalidParam,
        LIBUSB_ERROR_NOT_SUPPORTED => rusb::Error::NotSupported,
        LIBUSB_ERROR_NO_MEM => rusb::Error::NoMem,
        LIBUSB_ERROR_IO => rusb::Error::Io,
        _ => rusb::Error::Other,
    }
}
