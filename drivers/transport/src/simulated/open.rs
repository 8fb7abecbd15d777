//! A simulated device that is open.

use std::{
    collections::{BTreeMap, VecDeque},
    time::Duration,
};

use super::{
    device::{Answer, Packet, SimulatedInfo},
    plugged::Plugged,
};
use crate::{
    DeviceInfo, PacketStatus, Setup, Transfer, TransferKind, TransferStatus, TransportError, UsbDevice,
    usb::PacketResult,
};

/// Microframes that a bulk transfer takes in bus time.
const BULK_MICROFRAMES: u64 = 8;

/// A simulated device that is open; see [`UsbDevice`].
pub struct OpenDevice {
    plugged: Plugged,
    about: SimulatedInfo,
    queues: BTreeMap<u8, Queue>,
}

/// Transfers of one endpoint, and the microframe at which its next one begins.
#[derive(Default)]
struct Queue {
    clock: u64,
    transfers: VecDeque<Transfer>,
}

impl Queue {
    /// When its first transfer ends.
    fn end(&self) -> Option<u64> {
        let first = self.transfers.front()?;
        Some(self.clock + if first.packets.is_empty() { BULK_MICROFRAMES } else { first.packets.len() as u64 })
    }
}

impl OpenDevice {
    pub(super) fn new(plugged: Plugged) -> Self {
        let about = plugged.device().info();
        Self { plugged, about, queues: BTreeMap::new() }
    }

    /// Fills the packets of a transfer from microframe `start`.
    fn fill_packets(&mut self, transfer: &mut Transfer, start: u64) {
        transfer.status = TransferStatus::Completed;
        let room = transfer.packet_size;
        for i in 0..transfer.packets.len() {
            let answer = self.plugged.device().isochronous(transfer.endpoint, start + i as u64, room);
            transfer.packets[i] = match answer {
                Packet::Data(data) => {
                    let length = data.len().min(room);
                    transfer.bytes[i * room..i * room + length].copy_from_slice(&data[..length]);
                    PacketResult { status: PacketStatus::Completed, length }
                }
                Packet::Damaged => PacketResult { status: PacketStatus::Failed, length: 0 },
                Packet::Gone => {
                    self.plugged.leave();
                    transfer.status = TransferStatus::Unplugged;
                    return;
                }
            };
        }
    }

    fn fill_bulk(&mut self, transfer: &mut Transfer) {
        let answer = self.plugged.device().bulk_in(transfer.endpoint, transfer.bytes.len());
        transfer.status = match answer {
            Answer::Data(data) if data.len() > transfer.bytes.len() => TransferStatus::Overflow,
            Answer::Data(data) => {
                transfer.length = data.len();
                transfer.bytes[..data.len()].copy_from_slice(&data);
                TransferStatus::Completed
            }
            Answer::Stall => TransferStatus::Stalled,
            Answer::Silence => TransferStatus::Failed,
            Answer::Gone => {
                self.plugged.leave();
                TransferStatus::Unplugged
            }
        };
    }
}

impl UsbDevice for OpenDevice {
    fn info(&self) -> &DeviceInfo {
        &self.plugged.info
    }

    fn serial(&self) -> &str {
        &self.about.serial
    }

    fn claim(&mut self, _interface: u8, _alternate: u8) -> Result<(), TransportError> {
        self.plugged.check_here()
    }

    fn set_alternate(&mut self, interface: u8, alternate: u8) -> Result<(), TransportError> {
        // SET_INTERFACE, USB 2.0 §9.4.10: what a kernel sends.
        let (value, index) = (u16::from(alternate), u16::from(interface));
        let setup = Setup { request_type: 0x01, request: 0x0b, value, index, length: 0 };
        self.plugged
            .ask("changing the alternate setting", Duration::ZERO, |device| device.control(setup, &[]))
            .map(drop)
    }

    fn control_in(&mut self, setup: Setup, data: &mut [u8], limit: Duration) -> Result<usize, TransportError> {
        let setup = Setup { length: u16::try_from(data.len()).unwrap_or(u16::MAX), ..setup };
        let what = format!("control request {:#04x}", setup.request);
        let came = self.plugged.ask(&what, limit, |device| device.control(setup, &[]))?;
        let length = came.len().min(data.len());
        data[..length].copy_from_slice(&came[..length]);
        Ok(length)
    }

    fn control_out(&mut self, setup: Setup, data: &[u8], limit: Duration) -> Result<usize, TransportError> {
        let setup = Setup { length: u16::try_from(data.len()).unwrap_or(u16::MAX), ..setup };
        let what = format!("control request {:#04x}", setup.request);
        self.plugged.ask(&what, limit, |device| device.control(setup, data))?;
        Ok(data.len())
    }

    fn bulk_in(&mut self, endpoint: u8, data: &mut [u8], limit: Duration) -> Result<usize, TransportError> {
        let (what, room) = (format!("reading endpoint {endpoint:#04x}"), data.len());
        let came = self.plugged.ask(&what, limit, |device| device.bulk_in(endpoint, room))?;
        let length = came.len().min(room);
        data[..length].copy_from_slice(&came[..length]);
        Ok(length)
    }

    fn bulk_out(&mut self, endpoint: u8, data: &[u8], limit: Duration) -> Result<usize, TransportError> {
        let what = format!("writing endpoint {endpoint:#04x}");
        self.plugged.ask(&what, limit, |device| device.bulk_out(endpoint, data))?;
        Ok(data.len())
    }

    fn iso_packet_size(&self, endpoint: u8) -> Option<usize> {
        self.about.iso_endpoints.iter().find(|(e, _)| *e == endpoint).map(|(_, size)| *size)
    }

    fn submit(&mut self, mut transfer: Transfer) -> Result<(), TransportError> {
        self.plugged.check_here()?;
        transfer.clear();
        let now = self.queues.values().map(|q| q.clock).max().unwrap_or(0);
        let queue = self.queues.entry(transfer.endpoint).or_insert_with(|| Queue { clock: now, ..Queue::default() });
        queue.transfers.push_back(transfer);
        Ok(())
    }

    fn wait(&mut self, limit: Duration) -> Result<Transfer, TransportError> {
        let first = self.queues.iter().filter_map(|(e, q)| Some((q.end()?, *e))).min();
        let waiting = first.and_then(|(end, endpoint)| {
            let queue = self.queues.get_mut(&endpoint)?;
            let start = std::mem::replace(&mut queue.clock, end);
            Some((start, queue.transfers.pop_front()?))
        });
        let Some((start, mut transfer)) = waiting else {
            let timed_out = TransportError::TimedOut { what: "waiting for a transfer".into(), waited: limit };
            return Err(if self.plugged.is_here() { timed_out } else { TransportError::Unplugged });
        };
        match transfer.kind {
            _ if !self.plugged.is_here() => transfer.status = TransferStatus::Unplugged,
            TransferKind::Isochronous => self.fill_packets(&mut transfer, start),
            TransferKind::Bulk => self.fill_bulk(&mut transfer),
        }
        Ok(transfer)
    }

    fn in_flight(&self) -> usize {
        self.queues.values().map(|q| q.transfers.len()).sum()
    }

    fn cancel(&mut self, _limit: Duration) -> usize {
        self.queues.values_mut().for_each(|q| q.transfers.clear());
        0
    }
}

impl Drop for OpenDevice {
    fn drop(&mut self) {
        self.plugged.close();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::{
        Bus, LinkSpeed,
        simulated::{SimulatedBus, SimulatedDevice},
    };

    /// Counts up on two endpoints; gone at microframe 40 of endpoint 0x82.
    struct Counter;

    impl SimulatedDevice for Counter {
        fn info(&self) -> SimulatedInfo {
            SimulatedInfo {
                vendor: 1,
                product: 2,
                release: 3,
                speed: LinkSpeed::High,
                serial: "C-1".into(),
                iso_endpoints: vec![(0x81, 4), (0x82, 4)],
            }
        }

        fn control(&mut self, setup: Setup, data: &[u8]) -> Answer {
            match setup.request {
                1 => Answer::Data(vec![setup.length as u8; 300]),
                2 => Answer::Stall,
                3 => Answer::Silence,
                0x0b if setup.request_type == 1 && setup.value > 1 => Answer::Stall,
                _ => Answer::Data(data.to_vec()),
            }
        }

        fn isochronous(&mut self, endpoint: u8, microframe: u64, _room: usize) -> Packet {
            match (endpoint, microframe) {
                (0x82, 40..) => Packet::Gone,
                (0x81, 3) => Packet::Damaged,
                (0x81, 4) => Packet::Data(vec![9; 100]),
                _ => Packet::Data(vec![microframe as u8]),
            }
        }
    }

    const LIMIT: Duration = Duration::from_millis(1);

    fn open() -> (SimulatedBus, Box<dyn UsbDevice>) {
        let bus = SimulatedBus::default();
        let info = bus.plug(Arc::new(Mutex::new(Counter)));
        let device = bus.open(&info).unwrap();
        (bus, device)
    }

    #[test]
    fn transfers_come_in_the_order_of_their_bus_time() {
        let (_bus, mut device) = open();
        for _ in 0..2 {
            device.submit(Transfer::isochronous(0x81, 4, 8)).unwrap();
            device.submit(Transfer::isochronous(0x82, 4, 5)).unwrap();
        }
        let order: Vec<u8> = std::iter::from_fn(|| device.wait(LIMIT).ok()).map(|t| t.endpoint()).collect();
        assert_eq!(order, [0x82, 0x81, 0x82, 0x81]); // ends: 5, 8, 10, 16
        assert!(matches!(device.wait(LIMIT), Err(TransportError::TimedOut { .. })));
    }

    #[test]
    fn damaged_and_overlong_packets_touch_no_other_packet() {
        let (_bus, mut device) = open();
        device.submit(Transfer::isochronous(0x81, 4, 6)).unwrap();
        let transfer = device.wait(LIMIT).unwrap();
        let packets: Vec<(PacketStatus, Vec<u8>)> = transfer.packets().map(|(s, b)| (s, b.to_vec())).collect();
        assert_eq!(packets[3], (PacketStatus::Failed, vec![]));
        assert_eq!(packets[4], (PacketStatus::Completed, vec![9; 4]));
        assert_eq!(packets[5], (PacketStatus::Completed, vec![5]));
    }

    #[test]
    fn requests_that_fail_say_how_and_answers_are_cut_to_the_room() {
        let (_bus, mut device) = open();
        let mut room = [0; 8];
        assert_eq!(device.control_in(Setup::vendor_in(1, 0), &mut room, LIMIT).unwrap(), 8);
        let stalled = device.control_in(Setup::vendor_in(2, 0), &mut room, LIMIT);
        assert!(matches!(stalled, Err(TransportError::Stalled { .. })));
        let silent = device.control_in(Setup::vendor_in(3, 0), &mut room, LIMIT);
        assert!(matches!(silent, Err(TransportError::TimedOut { .. })));
        assert!(matches!(device.bulk_in(0x81, &mut room, LIMIT), Err(TransportError::Stalled { .. })));
        assert!(device.set_alternate(0, 1).is_ok());
        assert!(matches!(device.set_alternate(0, 2), Err(TransportError::Stalled { .. })));
    }

    #[test]
    fn an_unplug_ends_what_is_in_flight_and_everything_after() {
        let (bus, mut device) = open();
        for _ in 0..6 {
            device.submit(Transfer::isochronous(0x82, 4, 16)).unwrap();
        }
        let statuses: Vec<TransferStatus> =
            std::iter::from_fn(|| device.wait(LIMIT).ok()).map(|t| t.status()).collect();
        assert_eq!(statuses[..2], [TransferStatus::Completed; 2]);
        assert_eq!(statuses[2..], [TransferStatus::Unplugged; 4]);
        assert!(matches!(device.wait(LIMIT), Err(TransportError::Unplugged)));
        assert!(matches!(device.submit(Transfer::bulk(0x81, 4)), Err(TransportError::Unplugged)));
        assert!(matches!(device.claim(0, 0), Err(TransportError::Unplugged)));
        assert!(bus.list().unwrap().is_empty());
    }

    #[test]
    fn one_opener_at_a_time_and_a_pulled_plug_is_noticed() {
        let (bus, device) = open();
        let info = device.info().clone();
        assert!(matches!(bus.open(&info), Err(TransportError::Busy { .. })));
        drop(device);
        let mut device = bus.open(&info).unwrap();
        bus.unplug(&info);
        assert!(matches!(device.claim(0, 0), Err(TransportError::Unplugged)));
        assert!(matches!(bus.open(&info), Err(TransportError::NotFound { .. })));
        let waited = crate::wait_for(&bus, |_| true, LIMIT);
        assert!(matches!(waited, Err(TransportError::TimedOut { .. })));
    }
}
