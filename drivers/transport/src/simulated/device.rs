//! The answers of a device made of code. The same device sits behind the in-process bus and behind USB/IP.

use crate::{LinkSpeed, Setup};

/// Facts that a simulated device gives without being opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SimulatedInfo {
    /// USB vendor id.
    pub vendor: u16,
    /// USB product id.
    pub product: u16,
    /// `bcdDevice`.
    pub release: u16,
    /// Its link.
    pub speed: LinkSpeed,
    /// Its serial number.
    pub serial: String,
    /// Packet room of its isochronous endpoints: endpoint with direction bit, bytes a microframe.
    pub iso_endpoints: Vec<(u8, usize)>,
}

/// The answer to a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// Done; the data that goes to the host (empty for requests that only take).
    Data(Vec<u8>),
    /// Refused.
    Stall,
    /// Nothing comes: the host gives up.
    Silence,
    /// The device is gone.
    Gone,
}

/// The answer to one isochronous packet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Packet {
    /// It came, perhaps empty. More than the endpoint's room is cut off, as a host controller does.
    Data(Vec<u8>),
    /// The bus damaged it.
    Damaged,
    /// The device is gone.
    Gone,
}

/// A device made of code.
pub trait SimulatedDevice: Send {
    /// Its identity.
    fn info(&self) -> SimulatedInfo;

    /// A control request (class or vendor; standard ones too where it serves a kernel); `data` is what the
    /// host sends along.
    fn control(&mut self, setup: Setup, data: &[u8]) -> Answer;

    /// The packet of `endpoint` in microframe `microframe` since the device was opened, at most `room` bytes.
    fn isochronous(&mut self, endpoint: u8, microframe: u64, room: usize) -> Packet {
        let _ = (endpoint, microframe, room);
        Packet::Data(Vec::new())
    }

    /// A read from a bulk endpoint of at most `room` bytes.
    fn bulk_in(&mut self, endpoint: u8, room: usize) -> Answer {
        let _ = (endpoint, room);
        Answer::Stall
    }

    /// A write to a bulk endpoint.
    fn bulk_out(&mut self, endpoint: u8, data: &[u8]) -> Answer {
        let _ = (endpoint, data);
        Answer::Stall
    }
}
