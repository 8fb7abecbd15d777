//! The camera: two streams whose frames are sent as registers say.

use toile_driver_transport::{
    LinkSpeed, Setup,
    simulated::{Answer, Packet, SimulatedDevice, SimulatedInfo},
};

use super::{
    CommandFault, Content, DEPTH_ENDPOINT, Fault, Stream, StreamFault, VIDEO_ENDPOINT,
    commands::Commands,
    packets::{pack, packet},
};
use crate::{
    descriptors::{Descriptors, Endpoint},
    faults::Faults,
};

/// Microframes a second.
const MICROFRAMES: u64 = 8000;
/// Frames a second of every modelled mode.
const FRAMES: u64 = 30;
/// Ticks of the camera's clock a frame (60 MHz).
const TICKS_PER_FRAME: u64 = 2_000_000;
/// Video is exposed this many microframes (3 ms) after depth.
const VIDEO_DELAY: u64 = 24;

/// A camera before some content.
pub struct SimulatedCamera {
    content: Box<dyn Content>,
    commands: Commands,
    faults: Faults<Stream>,
    depth: Sending,
    video: Sending,
    serial: String,
}

/// Where a stream is.
#[derive(Default)]
struct Sending {
    sequence: u8,
    /// The frame that is being sent, and its bytes.
    frame: Option<(u64, Vec<u8>)>,
    /// Broken off until the next frame.
    torn: bool,
    silent: bool,
}

impl SimulatedCamera {
    /// A camera before `content`.
    pub fn new(content: impl Content + 'static) -> Self {
        Self {
            content: Box::new(content),
            commands: Commands::default(),
            faults: Faults::default(),
            depth: Sending::default(),
            video: Sending::default(),
            serial: "A00365A00955047A".into(),
        }
    }

    /// With these faults in its streams.
    pub fn with_faults(mut self, faults: impl IntoIterator<Item = Fault>) -> Self {
        self.faults.extend(faults);
        self
    }

    /// Answers its commands with a fault from now on; `None`: well again.
    pub fn set_command_fault(&mut self, fault: Option<CommandFault>) {
        self.commands.fault = fault;
    }

    /// With this serial number; cameras after model 1414 report sixteen zeros.
    pub fn with_serial(mut self, serial: &str) -> Self {
        self.serial = serial.into();
        self
    }

    /// A register's value, as a driver left it.
    pub fn register(&self, number: u16) -> u16 {
        self.commands.register(number)
    }

    /// The content.
    pub fn content(&mut self) -> &mut dyn Content {
        &mut *self.content
    }

    /// The content of its descriptors (`lsusb -v` of a model 1414).
    pub fn descriptors(&self) -> Descriptors {
        let endpoint = |address| Endpoint { address, attributes: 1, packet_size: 0x0bc0, interval: 1 };
        Descriptors {
            ids: [0x045e, 0x02ae, 0x010b],
            strings: ["Microsoft".into(), "Xbox NUI Camera".into(), self.serial.clone()],
            endpoints: vec![endpoint(VIDEO_ENDPOINT), endpoint(DEPTH_ENDPOINT)],
        }
    }

    /// Bytes of frame `frame` as the registers ask for it; `None` where the stream is off.
    fn frame_bytes(&mut self, stream: Stream, frame: u64) -> Option<Vec<u8>> {
        let register = |n| self.commands.register(n);
        match (stream, register(0x06), register(0x12), register(0x05)) {
            (Stream::Depth, 2, 3, _) => Some(pack(&self.content.depth(frame), 11)),
            (Stream::Depth, 2, 2, _) => {
                let tenth: Vec<u16> = self.content.depth(frame).iter().map(|raw| raw >> 1).collect();
                Some(pack(&tenth, 10))
            }
            (Stream::Video, _, _, 1) => Some(self.content.bayer(frame)),
            (Stream::Video, _, _, 3) => Some(pack(&self.content.infrared(frame), 10)),
            _ => None,
        }
    }

    fn next_packet(&mut self, stream: Stream, microframe: u64) -> Packet {
        let delay = if stream == Stream::Video { VIDEO_DELAY } else { 0 };
        let Some(now) = microframe.checked_sub(delay) else { return Packet::Data(Vec::new()) };
        let frame = now * FRAMES / MICROFRAMES;
        let index = (now - (frame * MICROFRAMES).div_ceil(FRAMES)) as usize;
        if self.begin(stream, frame, index) {
            return Packet::Data(Vec::new());
        }
        match self.faults.late_packet(stream, frame, index) {
            Some(index) => self.send(stream, frame, index, delay),
            None => Packet::Data(Vec::new()),
        }
    }

    /// Loads a frame at its first packet; true where nothing is sent now.
    fn begin(&mut self, stream: Stream, frame: u64, index: usize) -> bool {
        if index == 0 {
            let bytes = self.frame_bytes(stream, frame);
            let sending = self.sending(stream);
            sending.frame = bytes.map(|bytes| (frame, bytes));
            sending.torn = false;
        }
        let sending = self.sending(stream);
        sending.silent || sending.torn || sending.frame.as_ref().is_none_or(|(number, _)| *number != frame)
    }

    fn send(&mut self, stream: Stream, frame: u64, index: usize, delay: u64) -> Packet {
        let fault = self.faults.at(stream, frame, index);
        let sending = self.sending(stream);
        let bytes = sending.frame.as_ref().map_or(&[][..], |(_, bytes)| bytes);
        if index * stream.payload() >= bytes.len() {
            return Packet::Data(Vec::new());
        }
        match fault {
            Some(StreamFault::Torn) => {
                sending.torn = true;
                return Packet::Data(Vec::new());
            }
            Some(StreamFault::Silent) => {
                sending.silent = true;
                return Packet::Data(Vec::new());
            }
            Some(StreamFault::Unplug) => return Packet::Gone,
            _ => {}
        }
        let ticks = match fault {
            Some(StreamFault::Time(ticks)) => ticks,
            _ => (frame * TICKS_PER_FRAME + delay * TICKS_PER_FRAME * FRAMES / MICROFRAMES) as u32,
        };
        let mut packet = packet(stream, bytes, index, sending.sequence, ticks);
        sending.sequence = sending.sequence.wrapping_add(1);
        match fault {
            Some(StreamFault::Lost(_)) => packet.clear(),
            Some(StreamFault::Damaged(_)) => return Packet::Damaged,
            Some(StreamFault::BadBegin) => packet[..2].copy_from_slice(b"zz"),
            Some(StreamFault::BadFlag) => packet[3] ^= 0x07,
            Some(fault) => fault.cut(&mut packet),
            None => {}
        }
        Packet::Data(packet)
    }

    fn sending(&mut self, stream: Stream) -> &mut Sending {
        match stream {
            Stream::Depth => &mut self.depth,
            Stream::Video => &mut self.video,
        }
    }
}

impl SimulatedDevice for SimulatedCamera {
    fn info(&self) -> SimulatedInfo {
        let [vendor, product, release] = self.descriptors().ids;
        // 0x0bc0: 960 bytes, twice a microframe.
        let iso_endpoints = vec![(VIDEO_ENDPOINT, 1920), (DEPTH_ENDPOINT, 1920)];
        SimulatedInfo { vendor, product, release, speed: LinkSpeed::High, serial: self.serial.clone(), iso_endpoints }
    }

    fn control(&mut self, setup: Setup, data: &[u8]) -> Answer {
        if let Some(answer) = self.descriptors().answer(setup) {
            return answer;
        }
        match (setup.request_type, setup.request) {
            (0x40, 0) => {
                let optics = self.content.optics();
                let was_on = [0x05, 0x06].map(|n| self.commands.register(n));
                let answer = self.commands.take(data, &optics);
                // Switching a stream on or off mends a silent one.
                if was_on != [0x05, 0x06].map(|n| self.commands.register(n)) {
                    (self.depth.silent, self.video.silent) = (false, false);
                }
                answer
            }
            (0xc0, 0) => self.commands.give(usize::from(setup.length)),
            _ => Answer::Stall,
        }
    }

    fn isochronous(&mut self, endpoint: u8, microframe: u64, _room: usize) -> Packet {
        match endpoint {
            DEPTH_ENDPOINT => self.next_packet(Stream::Depth, microframe),
            VIDEO_ENDPOINT => self.next_packet(Stream::Video, microframe),
            _ => Packet::Data(Vec::new()),
        }
    }
}
