//! A picture on its way: payloads with their headers (UVC 1.1 §2.4.3.3).

use super::{StreamFault, descriptors::MICROFRAME};

/// Bits of a payload's header: end of the picture, time stamp, clock, error, end of the header.
const END: u8 = 0x02;
const HAS_TIME: u8 = 0x04;
const HAS_CLOCK: u8 = 0x08;
const ERROR: u8 = 0x40;
const END_OF_HEADER: u8 = 0x80;

/// One picture as it is sent.
pub(super) struct Sending {
    /// The camera's number of it.
    pub(super) number: u64,
    /// Time of the camera's clock, microseconds.
    pub(super) time: u32,
    /// The part of the first payload's header behind the standard one.
    pub(super) extra: Vec<u8>,
    /// The picture; of a bulk stream the whole payload.
    pub(super) bytes: Vec<u8>,
    /// How much of the bulk payload is read.
    pub(super) read: usize,
    pub(super) is_torn: bool,
}

impl Sending {
    fn header(&self, is_first: bool, is_last: bool, fault: Option<StreamFault>) -> Vec<u8> {
        let extra = if is_first { &self.extra[..] } else { &[] };
        let time = if let Some(StreamFault::Time(time)) = fault { time } else { self.time };
        let has_time = fault != Some(StreamFault::NoTime);
        let mut flags = END_OF_HEADER | HAS_CLOCK | (self.number & 1) as u8 | if has_time { HAS_TIME } else { 0 };
        flags |= if is_last { END } else { 0 } | if fault == Some(StreamFault::ErrorBit) { ERROR } else { 0 };
        let mut header = vec![0, flags];
        if has_time {
            header.extend(time.to_le_bytes());
        }
        header.extend(time.to_le_bytes());
        header.extend(((self.number * 33 % 2048) as u16).to_le_bytes());
        header.extend(extra);
        header[0] = header.len() as u8;
        if let Some(StreamFault::HeaderLength(length)) = fault {
            header[0] = length;
        }
        header
    }

    /// Data of the first packet, and of each further one.
    fn shares(&self) -> (usize, usize) {
        (MICROFRAME - 12 - self.extra.len(), MICROFRAME - 12)
    }

    /// How many packets the picture has.
    pub(super) fn packets(&self) -> usize {
        let (first, further) = self.shares();
        1 + self.bytes.len().saturating_sub(first).div_ceil(further)
    }

    /// Packet `index` of the picture.
    pub(super) fn packet(&self, index: usize, fault: Option<StreamFault>) -> Vec<u8> {
        let (first, further) = self.shares();
        let start = if index == 0 { 0 } else { first + (index - 1) * further };
        let end = (if index == 0 { first } else { start + further }).min(self.bytes.len());
        let mut packet = self.header(index == 0, index + 1 == self.packets(), fault);
        packet.extend(self.bytes.get(start..end).unwrap_or_default());
        packet
    }

    /// The whole bulk payload.
    pub(super) fn payload(&self, fault: Option<StreamFault>) -> Vec<u8> {
        let mut payload = self.header(true, true, fault);
        payload.extend(&self.bytes);
        payload
    }
}
