//! The camera: two streams on one clock.

use std::sync::Arc;

use toile_driver_transport::{
    LinkSpeed, Setup,
    simulated::{Answer, Packet, SimulatedDevice, SimulatedInfo},
};

use super::{
    CommandFault, Content, Fault, IMAGE_BYTES, Stream, StreamFault,
    commands::Commands,
    descriptors::{self, DEPTH_ROOM},
};
use crate::faults::Faults;

/// Endpoints (libfreenect2 `protocol/usb_control.h`).
const COMMAND_OUT: u8 = 0x02;
const COMMAND_IN: u8 = 0x81;
const COLOR_ENDPOINT: u8 = 0x83;
const DEPTH_ENDPOINT: u8 = 0x84;
/// Microframes a second, which are also the ticks of the camera's clock; frames a second.
const MICROFRAMES: u64 = 8000;
const FRAMES: u64 = 30;
/// Microframes until the first frame begins.
const START: u64 = 16;
/// Microframes from one image of a depth packet to the next.
const IMAGE_STEP: usize = 26;
/// Packets of an image.
const IMAGE_PACKETS: usize = (IMAGE_BYTES + FOOTER).div_ceil(DEPTH_ROOM as usize);
/// Bytes of the footer of an image (libfreenect2 `depth_packet_stream_parser.h`).
const FOOTER: usize = 152;
/// Colour is exposed this many microframes (3 ms) after depth.
const COLOR_DELAY: u64 = 24;
/// Microframes that pass while the host asks for colour.
const COLOR_STEP: u64 = 8;

/// A camera before some content.
pub struct SimulatedCamera {
    content: Box<dyn Content>,
    commands: Commands,
    faults: Faults<Stream>,
    serial: String,
    speed: LinkSpeed,
    is_depth_on: bool,
    /// The depth packet that is being sent.
    depth: Option<(u64, Arc<Vec<u8>>)>,
    /// The frame that is broken off, and the switching-on after which a stream went silent.
    torn: Option<u64>,
    silent: [Option<u32>; 2],
    /// The colour image that is being sent: its frame, its bytes, how many are gone, in how many transfers.
    color: Option<(u64, Vec<u8>, usize, usize)>,
    next_color: u64,
    /// Microframe of depth, and of colour where depth does not run.
    now: u64,
    color_now: u64,
}

impl SimulatedCamera {
    /// A camera before `content`.
    pub fn new(content: impl Content + 'static) -> Self {
        Self {
            content: Box::new(content),
            commands: Commands::default(),
            faults: Faults::default(),
            serial: "012345670147".into(),
            speed: LinkSpeed::Super,
            is_depth_on: false,
            depth: None,
            torn: None,
            silent: [None; 2],
            color: None,
            next_color: 0,
            now: 0,
            color_now: 0,
        }
    }

    /// With these faults in its streams.
    pub fn with_faults(mut self, faults: impl IntoIterator<Item = Fault>) -> Self {
        self.faults.extend(faults);
        self
    }

    /// With this serial number.
    pub fn with_serial(mut self, serial: &str) -> Self {
        self.serial = serial.into();
        self
    }

    /// On a link of this speed.
    pub fn at_speed(mut self, speed: LinkSpeed) -> Self {
        self.speed = speed;
        self
    }

    /// Answers its commands with a fault from now on; `None`: well again.
    pub fn set_command_fault(&mut self, fault: Option<CommandFault>) {
        self.commands.fault = fault;
    }

    /// True while its streams are switched on.
    pub fn is_streaming(&self) -> bool {
        self.commands.streaming && self.is_depth_on
    }

    /// How often its streams were switched on.
    pub fn starts(&self) -> u32 {
        self.commands.starts
    }

    /// The packet of depth in microframe `now`.
    fn depth_packet(&mut self, now: u64) -> Packet {
        let nothing = Packet::Data(Vec::new());
        let Some(now) = now.checked_sub(START) else { return nothing };
        let frame = now * FRAMES / MICROFRAMES;
        let due = (now - (frame * MICROFRAMES).div_ceil(FRAMES)) as usize;
        let Some(due) = self.late(frame, due) else { return nothing };
        let (image, within) = (due / IMAGE_STEP, due % IMAGE_STEP);
        if image >= 10 || within >= IMAGE_PACKETS || !self.is_streaming() || self.is_silent(Stream::Depth) {
            return nothing;
        }
        if self.depth.as_ref().is_none_or(|(number, _)| *number != frame) {
            self.depth = Some((frame, self.content.depth(frame)));
        }
        let index = image * IMAGE_PACKETS + within;
        let fault = self.faults.at(Stream::Depth, frame, index);
        if fault == Some(StreamFault::Torn) {
            self.torn = Some(frame);
        }
        if self.torn == Some(frame) || self.goes_silent(Stream::Depth, fault) {
            return nothing;
        }
        let packet = self.depth_bytes(frame, image, within);
        match (fault, spoiled(packet, fault)) {
            (Some(StreamFault::Unplug), _) => Packet::Gone,
            (Some(StreamFault::Damaged(_)), _) => Packet::Damaged,
            (Some(StreamFault::Lost(_)), _) => nothing,
            (_, packet) => Packet::Data(packet),
        }
    }

    /// Bytes of packet `within` of an image with its footer.
    fn depth_bytes(&self, frame: u64, image: usize, within: usize) -> Vec<u8> {
        let all = self.depth.as_ref().map_or(&[][..], |(_, bytes)| &bytes[..]);
        let image_bytes = all.get(image * IMAGE_BYTES..(image + 1) * IMAGE_BYTES).unwrap_or_default();
        let (start, room) = (within * usize::from(DEPTH_ROOM), usize::from(DEPTH_ROOM));
        let mut packet = image_bytes[start.min(image_bytes.len())..(start + room).min(image_bytes.len())].to_vec();
        if within == IMAGE_PACKETS - 1 {
            let (mut ticks, mut sequence) = ((frame * MICROFRAMES / FRAMES) as u32, frame as u32);
            for fault in self.faults.of_frame(Stream::Depth, frame) {
                match fault.what {
                    StreamFault::Time(stated) => ticks = stated,
                    StreamFault::Sequence(stated) => sequence = stated,
                    _ => {}
                }
            }
            let words = [0x3a3a_3a3a, 0x5c5c_5c5c, ticks, sequence, image as u32, IMAGE_BYTES as u32];
            packet.extend(words.iter().flat_map(|word| word.to_le_bytes()));
            packet.extend([0; FOOTER - 24]);
        }
        packet
    }

    /// Which microframe of the frame's sending it is, where packets come late; none while they wait.
    fn late(&self, frame: u64, due: usize) -> Option<usize> {
        let from = |fault: &Fault| fault.packet / IMAGE_PACKETS * IMAGE_STEP + fault.packet % IMAGE_PACKETS;
        let late = self.faults.of_frame(Stream::Depth, frame).filter(|fault| due >= from(fault));
        let mut late = late.filter_map(|fault| match fault.what {
            StreamFault::Late(late) => Some((from(fault), late as usize)),
            _ => None,
        });
        late.next_back().map_or(Some(due), |(from, late)| Some(from + due.checked_sub(from + late)?))
    }

    /// The next transfer of colour.
    fn color_transfer(&mut self, room: usize) -> Answer {
        let nothing = Answer::Data(Vec::new());
        self.color_now += COLOR_STEP;
        if !self.commands.streaming || self.is_silent(Stream::Color) {
            return nothing;
        }
        if self.color.is_none() && !self.begin_color() {
            return nothing;
        }
        let Some((frame, bytes, gone, index)) = &mut self.color else { return nothing };
        let (frame, index, end) = (*frame, *index, (*gone + room).min(bytes.len()));
        let part = bytes[*gone..end].to_vec();
        let is_last = end == bytes.len();
        self.color = if is_last { None } else { Some((frame, std::mem::take(bytes), end, index + 1)) };
        let fault = self.faults.at(Stream::Color, frame, index);
        if self.goes_silent(Stream::Color, fault) {
            return nothing;
        }
        match (fault, spoiled(part, fault)) {
            (Some(StreamFault::Unplug), _) => Answer::Gone,
            (Some(StreamFault::Stall), _) => Answer::Stall,
            (Some(StreamFault::Damaged(_)), _) => Answer::Silence,
            (Some(StreamFault::Lost(_)), _) => nothing,
            (Some(StreamFault::Torn), _) => {
                self.color = None;
                nothing
            }
            (_, part) => Answer::Data(part),
        }
    }

    /// Loads the colour image that is due, skipping what the host was too slow for; false where none is due yet.
    fn begin_color(&mut self) -> bool {
        let now = if self.now > 0 { self.now } else { self.color_now };
        let Some(now) = now.checked_sub(START) else { return false };
        let due = |frame: u64| {
            let late = self.faults.of_frame(Stream::Color, frame);
            let late = late.map(|f| if let StreamFault::Late(late) = f.what { late } else { 0 }).sum::<u64>();
            (frame * MICROFRAMES).div_ceil(FRAMES) + COLOR_DELAY + late
        };
        let newest = now.saturating_sub(COLOR_DELAY) * FRAMES / MICROFRAMES;
        let frame = self.next_color.max(newest.saturating_sub(2));
        if now < due(frame) {
            return false;
        }
        self.next_color = frame + 1;
        let ticks = (frame * MICROFRAMES / FRAMES + COLOR_DELAY) as u32;
        self.color = Some((frame, color_bytes(frame as u32, ticks, &self.content.jpeg(frame)), 0, 0));
        true
    }

    /// True from now on until the streams are switched on again.
    fn goes_silent(&mut self, stream: Stream, fault: Option<StreamFault>) -> bool {
        if fault == Some(StreamFault::Silent) {
            self.silent[stream as usize] = Some(self.commands.starts);
        }
        fault == Some(StreamFault::Silent)
    }

    fn is_silent(&self, stream: Stream) -> bool {
        self.silent[stream as usize] == Some(self.commands.starts)
    }
}

/// Bytes with what a fault does to them.
fn spoiled(mut bytes: Vec<u8>, fault: Option<StreamFault>) -> Vec<u8> {
    let length = bytes.len();
    match fault {
        Some(StreamFault::BadBegin) => bytes.iter_mut().take(8).for_each(|b| *b ^= 0xff),
        Some(StreamFault::BadEnd) => bytes.iter_mut().skip(length.saturating_sub(152)).for_each(|b| *b ^= 0xff),
        Some(fault) => fault.cut(&mut bytes),
        None => {}
    }
    bytes
}

/// A colour image with what stands before and after it (libfreenect2 `src/rgb_packet_stream_parser.cpp`).
fn color_bytes(sequence: u32, ticks: u32, jpeg: &[u8]) -> Vec<u8> {
    let word = |bytes: &mut Vec<u8>, word: u32| bytes.extend(word.to_le_bytes());
    let mut bytes = Vec::with_capacity(jpeg.len() + 100);
    word(&mut bytes, sequence);
    bytes.extend(b"BBBB");
    bytes.extend(jpeg);
    bytes.resize(bytes.len().next_multiple_of(4), 0xa5);
    let filler = 12 + sequence % 3 * 4;
    bytes.resize(bytes.len() + filler as usize, b'Z');
    let length = bytes.len() as u32 + 56;
    bytes.extend(b"9999");
    [sequence, filler, 0, 0, ticks, 1.0_f32.to_bits(), 1.0_f32.to_bits()].into_iter().for_each(|w| word(&mut bytes, w));
    bytes.extend(b"BBBB");
    [length, 1.0_f32.to_bits(), 0, 0, 0].into_iter().for_each(|w| word(&mut bytes, w));
    bytes
}

impl SimulatedDevice for SimulatedCamera {
    fn info(&self) -> SimulatedInfo {
        SimulatedInfo {
            vendor: 0x045e,
            product: 0x02c4,
            release: 0x0100,
            speed: self.speed,
            serial: self.serial.clone(),
            iso_endpoints: vec![(DEPTH_ENDPOINT, usize::from(DEPTH_ROOM))],
        }
    }

    fn control(&mut self, setup: Setup, _data: &[u8]) -> Answer {
        // SET_INTERFACE of the depth interface.
        if (setup.request_type, setup.request, setup.index) == (1, 0x0b, 1) {
            self.is_depth_on = setup.value == 1;
        }
        descriptors::answer(setup, &self.serial).unwrap_or(Answer::Stall)
    }

    fn isochronous(&mut self, endpoint: u8, microframe: u64, _room: usize) -> Packet {
        if endpoint != DEPTH_ENDPOINT {
            return Packet::Data(Vec::new());
        }
        self.now = microframe;
        self.depth_packet(microframe)
    }

    fn bulk_in(&mut self, endpoint: u8, room: usize) -> Answer {
        match endpoint {
            COMMAND_IN => self.commands.give(room),
            COLOR_ENDPOINT => self.color_transfer(room),
            _ => Answer::Stall,
        }
    }

    fn bulk_out(&mut self, endpoint: u8, data: &[u8]) -> Answer {
        match endpoint {
            COMMAND_OUT => self.commands.take(data, &self.content.optics(), &self.serial),
            _ => Answer::Stall,
        }
    }
}
