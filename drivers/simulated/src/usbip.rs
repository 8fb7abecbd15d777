//! A model behind USB/IP: a real kernel's virtual host controller (`vhci_hcd`) is the other end.
//!
//! The protocol is Linux' `Documentation/usb/usbip_protocol.rst`: 48-byte headers in network order, the data, and 16
//! bytes for each isochronous packet; the packets' data stand without gaps. The device is paced by its URBs: each is
//! answered when it is read, packets in the order of their microframes. One loop reads and writes, so that no answer to
//! a URB can follow the answer to its unlinking; an unlinking that overtakes its URB is remembered.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::{self, Read, Write},
    sync::{Mutex, PoisonError},
    thread,
    time::Duration,
};

use toile_driver_transport::{
    Setup,
    simulated::{Answer, Packet, SimulatedDevice},
};

/// Commands and their answers.
const SUBMIT: u32 = 1;
const UNLINK: u32 = 2;
const SUBMIT_DONE: u32 = 3;
const UNLINK_DONE: u32 = 4;
/// Errors as Linux numbers them: stall, damaged packet, cancelled.
const EPIPE: i32 = -32;
const EILSEQ: i32 = -84;
const ECONNRESET: i32 = -104;
/// More than any URB asks for.
const MAX_BYTES: usize = 1 << 22;
const MAX_PACKETS: usize = 1024;
/// A URB without data takes this long, so that an idle stream does not take the whole processor.
const IDLE: Duration = Duration::from_millis(1);

/// Serves a model until the kernel closes the line, or the model is unplugged (the line is then ours to close).
///
/// # Errors
/// The errors of reading and writing; a header that no kernel sends.
pub fn serve(model: &Mutex<dyn SimulatedDevice>, line: &mut (impl Read + Write)) -> io::Result<()> {
    let mut state = State::default();
    loop {
        let mut header = [0; 48];
        match line.read_exact(&mut header) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(()),
            other => other?,
        }
        let word =
            |i: usize| u32::from_be_bytes([header[4 * i], header[4 * i + 1], header[4 * i + 2], header[4 * i + 3]]);
        let more = match word(0) {
            SUBMIT => state.submit(model, &Urb::read(&header, line)?, line)?,
            UNLINK => state.unlink(word(1), word(5), line)?,
            other => return Err(wrong(&format!("command {other} is not one of USB/IP's"))),
        };
        if !more {
            return Ok(());
        }
    }
}

/// A request of the kernel's.
struct Urb {
    number: u32,
    is_in: bool,
    endpoint: u8,
    length: usize,
    start_frame: u32,
    setup: Setup,
    data: Vec<u8>,
    /// Offset and room of each packet.
    packets: Vec<(u32, u32)>,
    is_isochronous: bool,
}

impl Urb {
    fn read(header: &[u8; 48], line: &mut impl Read) -> io::Result<Self> {
        let word =
            |i: usize| u32::from_be_bytes([header[4 * i], header[4 * i + 1], header[4 * i + 2], header[4 * i + 3]]);
        let (is_in, length) = (word(3) == 1, word(6) as usize);
        // -1 and 0 both mean that it is not isochronous.
        let count = if word(8) == u32::MAX { 0 } else { word(8) as usize };
        if length > MAX_BYTES || count > MAX_PACKETS {
            return Err(wrong(&format!("a URB of {length} bytes and {count} packets")));
        }
        let mut data = vec![0; if is_in { 0 } else { length }];
        line.read_exact(&mut data)?;
        let mut packets = Vec::with_capacity(count);
        for _ in 0..count {
            let mut bytes = [0; 16];
            line.read_exact(&mut bytes)?;
            let part = |i: usize| u32::from_be_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]);
            packets.push((part(0), part(4)));
        }
        let s = &header[40..48];
        let setup = Setup {
            request_type: s[0],
            request: s[1],
            value: u16::from_le_bytes([s[2], s[3]]),
            index: u16::from_le_bytes([s[4], s[5]]),
            length: u16::from_le_bytes([s[6], s[7]]),
        };
        let endpoint = (word(4) & 15) as u8 | if is_in { 0x80 } else { 0 };
        let (number, start_frame) = (word(1), word(7));
        Ok(Self { number, is_in, endpoint, length, start_frame, setup, data, is_isochronous: count > 0, packets })
    }
}

/// The data of a URB.
struct Done {
    status: i32,
    data: Vec<u8>,
    /// Length and status of each packet.
    packets: Vec<(u32, i32)>,
    sent: usize,
}

#[derive(Default)]
struct State {
    /// The next microframe of each endpoint.
    clocks: BTreeMap<u8, u64>,
    answered: BTreeSet<u32>,
    unlinked: BTreeSet<u32>,
}

impl State {
    /// Answers a URB; false where the device is gone.
    fn submit(&mut self, model: &Mutex<dyn SimulatedDevice>, urb: &Urb, line: &mut impl Write) -> io::Result<bool> {
        if self.unlinked.remove(&urb.number) {
            return Ok(true);
        }
        let done = {
            let mut model = model.lock().unwrap_or_else(PoisonError::into_inner);
            if urb.is_isochronous { self.isochronous(&mut *model, urb) } else { plain(&mut *model, urb) }
        };
        let Some(done) = done else { return Ok(false) };
        if urb.is_in && urb.endpoint != 0x80 && done.data.is_empty() {
            thread::sleep(IDLE);
        }
        let actual = if urb.is_in { done.data.len() } else { done.sent };
        let failed = done.packets.iter().filter(|(_, status)| *status != 0).count() as u32;
        let count = urb.packets.len() as u32;
        let words =
            [SUBMIT_DONE, urb.number, 0, 0, 0, done.status as u32, actual as u32, urb.start_frame, count, failed, 0, 0];
        let mut bytes: Vec<u8> = words.iter().flat_map(|w| w.to_be_bytes()).collect();
        if urb.is_in {
            bytes.extend(&done.data);
        }
        for ((offset, room), (length, status)) in urb.packets.iter().zip(&done.packets) {
            bytes.extend([*offset, *room, *length, *status as u32].iter().flat_map(|w| w.to_be_bytes()));
        }
        line.write_all(&bytes)?;
        self.answered.insert(urb.number);
        while self.answered.len() > 4096 {
            self.answered.pop_first();
        }
        Ok(true)
    }

    /// Answers an unlinking: what was answered before is done, what comes later will not be.
    fn unlink(&mut self, number: u32, urb: u32, line: &mut impl Write) -> io::Result<bool> {
        let status = if self.answered.contains(&urb) { 0 } else { ECONNRESET };
        if status != 0 {
            self.unlinked.insert(urb);
        }
        let words = [UNLINK_DONE, number, 0, 0, 0, status as u32, 0, 0, 0, 0, 0, 0];
        line.write_all(&words.iter().flat_map(|w| w.to_be_bytes()).collect::<Vec<u8>>())?;
        Ok(true)
    }

    fn isochronous(&mut self, model: &mut dyn SimulatedDevice, urb: &Urb) -> Option<Done> {
        // Bus time is one for all endpoints: one that starts later starts now.
        let now = self.clocks.values().copied().max().unwrap_or(0);
        let clock = self.clocks.entry(urb.endpoint).or_insert(now);
        let mut done = Done { status: 0, data: Vec::new(), packets: Vec::new(), sent: 0 };
        for (_, room) in &urb.packets {
            let answer = model.isochronous(urb.endpoint, *clock, *room as usize);
            *clock += 1;
            match answer {
                Packet::Data(mut data) => {
                    data.truncate(*room as usize);
                    done.packets.push((data.len() as u32, 0));
                    done.data.extend(data);
                }
                Packet::Damaged => done.packets.push((0, EILSEQ)),
                Packet::Gone => return None,
            }
        }
        Some(done)
    }
}

/// Control and bulk.
fn plain(model: &mut dyn SimulatedDevice, urb: &Urb) -> Option<Done> {
    let answer = match (urb.endpoint & 15, urb.is_in) {
        (0, _) => model.control(urb.setup, &urb.data),
        (_, true) => model.bulk_in(urb.endpoint, urb.length),
        (_, false) => model.bulk_out(urb.endpoint, &urb.data),
    };
    let done = |status, data| Done { status, data, packets: Vec::new(), sent: urb.data.len() };
    match answer {
        Answer::Data(mut data) => {
            data.truncate(urb.length);
            Some(done(0, data))
        }
        // The kernel cannot be kept waiting here: a silent device is refused too.
        Answer::Stall | Answer::Silence => Some(done(EPIPE, Vec::new())),
        Answer::Gone => None,
    }
}

fn wrong(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinect1::{Pattern, SimulatedCamera};

    /// A header of the kernel, and the answer to it.
    struct Line {
        says: io::Cursor<Vec<u8>>,
        stated: Vec<u8>,
    }

    impl Read for Line {
        fn read(&mut self, room: &mut [u8]) -> io::Result<usize> {
            self.says.read(room)
        }
    }

    impl Write for Line {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.stated.write(bytes)
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn submit(number: u32, endpoint: u32, length: u32, packets: u32, setup: [u8; 8]) -> Vec<u8> {
        let words = [SUBMIT, number, 0x10002, 1, endpoint, 0, length, 0, packets, 0];
        words.iter().flat_map(|w| w.to_be_bytes()).chain(setup).collect()
    }

    fn unlink(number: u32, urb: u32) -> Vec<u8> {
        let words = [UNLINK, number, 0x10002, 0, 0, urb, 0, 0, 0, 0, 0, 0];
        words.iter().flat_map(|w| w.to_be_bytes()).collect()
    }

    fn stated(says: Vec<u8>) -> Vec<u8> {
        let mut line = Line { says: io::Cursor::new(says), stated: Vec::new() };
        serve(&Mutex::new(SimulatedCamera::new(Pattern::default())), &mut line).unwrap();
        line.stated
    }

    const DEVICE: [u8; 8] = [0x80, 6, 0, 1, 0, 0, 18, 0];

    #[test]
    fn a_kernel_is_given_the_descriptors_and_empty_packets() {
        let mut says = submit(1, 0, 18, u32::MAX, DEVICE);
        says.extend(submit(2, 2, 3840, 2, [0; 8]));
        for packet in [[0u32, 1920, 0, 0], [1920, 1920, 0, 0]] {
            says.extend(packet.iter().flat_map(|w| w.to_be_bytes()));
        }
        let stated = stated(says);
        assert_eq!(stated.len(), 48 + 18 + 48 + 32);
        assert_eq!(stated[..8], [0, 0, 0, 3, 0, 0, 0, 1]);
        assert_eq!(stated[20..28], [0, 0, 0, 0, 0, 0, 0, 18]);
        assert_eq!(stated[48..50], [18, 1]);
    }

    #[test]
    fn an_unlinked_urb_is_never_answered_whichever_comes_first() {
        let late = [unlink(9, 7), submit(7, 0, 18, 0, DEVICE)].concat();
        let answered_late = stated(late);
        assert_eq!((answered_late.len(), answered_late[23]), (48, (-104i32 as u32) as u8));
        let early = [submit(7, 0, 18, 0, DEVICE), unlink(9, 7)].concat();
        let answered_early = stated(early);
        assert_eq!((answered_early.len(), answered_early[66 + 23]), (48 + 18 + 48, 0));
    }

    #[test]
    fn what_no_kernel_says_is_an_error() {
        let serve_it = |says: Vec<u8>| {
            let mut line = Line { says: io::Cursor::new(says), stated: Vec::new() };
            serve(&Mutex::new(SimulatedCamera::new(Pattern::default())), &mut line)
        };
        assert!(serve_it(vec![7; 48]).is_err());
        assert!(serve_it(submit(1, 2, u32::MAX - 9, 0, [0; 8])).is_err());
        assert!(serve_it(submit(1, 2, 100, 90_000, [0; 8])).is_err());
        assert!(serve_it(vec![0; 13]).is_ok());
    }
}
