//! A UVC camera: requests, and pictures as payloads.

use toile_driver_transport::{
    LinkSpeed, Setup,
    simulated::{Answer, Packet, SimulatedDevice, SimulatedInfo},
};

use super::{
    Fault, Picture, Shape, StreamFault, StreamShape, Wire,
    descriptors::MICROFRAME,
    probe::{self, Agreed},
    sending::Sending,
};
use crate::{descriptors::standard, faults::Faults};

/// Microframes a second.
const MICROFRAMES: u64 = 8000;
/// A stream of bulk pictures may be this many pictures before another one.
const MAX_AHEAD: u64 = 1;

/// The scene before a camera, and the answers of its units.
pub trait Scene: Send {
    /// The bytes of a picture.
    fn picture(&mut self, picture: Picture) -> Vec<u8>;

    /// The part of the header of a picture's first payload behind the standard one.
    fn extra_header(&mut self, picture: Picture) -> Vec<u8> {
        let _ = picture;
        Vec::new()
    }

    /// A request to an extension unit: `setup.value >> 8` is the selector.
    fn extension(&mut self, unit: u8, setup: Setup, data: &[u8]) -> Answer {
        let _ = (unit, setup, data);
        Answer::Stall
    }
}

/// A camera before a scene.
pub struct SimulatedCamera<S> {
    scene: S,
    shape: Shape,
    streams: Vec<Stream>,
    faults: Faults<usize>,
}

struct Stream {
    interface: u8,
    shape: StreamShape,
    probed: Agreed,
    committed: Option<Agreed>,
    is_on: bool,
    alternate: u8,
    sending: Option<Sending>,
    next_frame: u64,
    is_silent: bool,
}

impl<S: Scene> SimulatedCamera<S> {
    /// A camera of this shape.
    pub fn new(shape: Shape, scene: S) -> Self {
        let stream = |(interface, shape): (u8, StreamShape)| Stream {
            interface,
            probed: Agreed::first(&shape),
            shape,
            committed: None,
            is_on: false,
            alternate: 0,
            sending: None,
            next_frame: 0,
            is_silent: false,
        };
        let streams = shape.streams().into_iter().map(stream).collect();
        Self { scene, shape, streams, faults: Faults::default() }
    }

    /// With these faults in its streams.
    pub fn with_faults(mut self, faults: impl IntoIterator<Item = Fault>) -> Self {
        self.faults.extend(faults);
        self
    }

    /// With this serial number of its USB device.
    pub fn with_serial(mut self, serial: &str) -> Self {
        self.shape.strings[2] = serial.into();
        self
    }

    /// The scene.
    pub fn scene(&mut self) -> &mut S {
        &mut self.scene
    }

    /// The shape.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// How many streams are on.
    pub fn streaming(&self) -> usize {
        self.streams.iter().filter(|s| s.is_on).count()
    }

    fn stream_control(&mut self, index: usize, setup: Setup, data: &[u8]) -> Answer {
        let (wire, stream) = (self.shape.wire, &mut self.streams[index]);
        match (setup.request, setup.value) {
            (0x01, 0x0100) => {
                stream.probed = Agreed::nearest(&stream.shape, data);
                Answer::Data(Vec::new())
            }
            (0x01, 0x0200) => {
                stream.committed = Some(Agreed::nearest(&stream.shape, data));
                if wire == Wire::Bulk {
                    self.switch(index, true);
                }
                Answer::Data(Vec::new())
            }
            (0x81, 0x0200) => Answer::Data(stream.committed.unwrap_or(stream.probed).bytes(&stream.shape, wire)),
            (0x81, 0x0100) => Answer::Data(stream.probed.bytes(&stream.shape, wire)),
            (0x82..=0x84 | 0x87, 0x0100) => Answer::Data(Agreed::first(&stream.shape).bytes(&stream.shape, wire)),
            (0x85, 0x0100 | 0x0200) => Answer::Data((probe::BYTES as u16).to_le_bytes().to_vec()),
            (0x86, 0x0100 | 0x0200) => Answer::Data(vec![3]),
            _ => Answer::Stall,
        }
    }

    /// Switches a stream on, from the frame that the others are at, or off.
    fn switch(&mut self, index: usize, is_on: bool) {
        let now = self.streams.iter().filter(|s| s.is_on).map(|s| s.next_frame).max().unwrap_or(0);
        let stream = &mut self.streams[index];
        if is_on {
            stream.next_frame = stream.next_frame.max(now);
        }
        (stream.is_on, stream.sending, stream.is_silent) = (is_on, None, false);
    }

    /// Switches by SET_INTERFACE; bulk streams end by clearing their endpoint (`uvc_stop_streaming` of Linux).
    fn standard(&mut self, setup: Setup) -> Option<Answer> {
        let place = match (setup.request_type, setup.request) {
            (0x01, 0x0b) => self.streams.iter().position(|s| u16::from(s.interface) == setup.index),
            (0x02, 0x01) => self.streams.iter().position(|s| u16::from(s.shape.endpoint) == setup.index),
            _ => None,
        };
        if let Some(index) = place {
            let alternate = if setup.request == 0x0b { setup.value as u8 } else { 0 };
            self.streams[index].alternate = alternate;
            self.switch(index, alternate > 0 && self.streams[index].committed.is_some());
        }
        standard(setup, self.shape.device(), self.shape.configuration(), &self.shape.strings)
    }

    /// Loads a picture.
    fn load(&mut self, index: usize, frame: u64) {
        let stream = &self.streams[index];
        let Some(agreed) = stream.committed else { return };
        let Some(format) = stream.shape.formats.get(agreed.format) else { return };
        let size = format.sizes.get(agreed.size).copied().unwrap_or_default();
        let picture = Picture { stream: index, format: agreed.format, size, fps: agreed.fps, frame };
        let time = (frame * 1_000_000 / u64::from(agreed.fps.max(1))) as u32;
        let (bytes, extra) = (self.scene.picture(picture), self.scene.extra_header(picture));
        let mut sending = Sending { number: frame, time, extra, bytes, read: 0, is_torn: false };
        if self.shape.wire == Wire::Bulk {
            sending.bytes = sending.payload(self.faults.at(index, frame, 0));
        }
        (self.streams[index].sending, self.streams[index].next_frame) = (Some(sending), frame + 1);
    }

    fn next_packet(&mut self, index: usize, microframe: u64) -> Packet {
        let nothing = Packet::Data(Vec::new());
        let stream = &self.streams[index];
        let Some(agreed) = stream.committed.filter(|_| stream.is_on) else { return nothing };
        let fps = u64::from(agreed.fps.max(1));
        let frame = microframe * fps / MICROFRAMES;
        let packet = (microframe - (frame * MICROFRAMES).div_ceil(fps)) as usize;
        if packet == 0 {
            self.load(index, frame);
        }
        let Some(packet) = self.faults.late_packet(index, frame, packet) else { return nothing };
        let fault = self.faults.at(index, frame, packet);
        let stream = &mut self.streams[index];
        let is_silent = stream.is_silent;
        let Some(sending) = stream.sending.as_mut().filter(|s| s.number == frame && packet < s.packets()) else {
            return nothing;
        };
        match fault {
            Some(StreamFault::Torn) => sending.is_torn = true,
            Some(StreamFault::Silent | StreamFault::Stall) => stream.is_silent = true,
            Some(StreamFault::Unplug) => return Packet::Gone,
            Some(StreamFault::Damaged(_)) => return Packet::Damaged,
            Some(StreamFault::Lost(_)) => return nothing,
            _ => {}
        }
        if is_silent || stream.is_silent || sending.is_torn {
            return nothing;
        }
        Packet::Data(spoiled(sending.packet(packet, fault), fault))
    }

    /// True where another stream's pictures must be read first: one clock drives all sensors.
    fn is_ahead(&self, index: usize) -> bool {
        let others = self.streams.iter().enumerate().filter(|(i, s)| *i != index && s.is_on && !s.is_silent);
        let slowest = others.map(|(_, s)| s.next_frame).min();
        slowest.is_some_and(|slowest| self.streams[index].next_frame > slowest + MAX_AHEAD)
    }

    fn next_read(&mut self, index: usize, room: usize) -> Answer {
        let nothing = Answer::Data(Vec::new());
        let stream = &self.streams[index];
        if !stream.is_on || stream.is_silent {
            return nothing;
        }
        if stream.sending.is_none() {
            if self.is_ahead(index) {
                return nothing;
            }
            self.load(index, self.streams[index].next_frame);
        }
        let Some(sending) = &self.streams[index].sending else { return nothing };
        let (frame, packet) = (sending.number, sending.read / room.max(1));
        let fault = self.faults.at(index, frame, packet);
        let stream = &mut self.streams[index];
        let Some(sending) = &mut stream.sending else { return nothing };
        let end = (sending.read + room).min(sending.bytes.len());
        let chunk = sending.bytes[sending.read..end].to_vec();
        sending.read = end;
        // A read that is not full ends the payload; where the last one is full the agreed size does not.
        if chunk.len() < room {
            stream.sending = None;
        }
        match fault {
            Some(StreamFault::Unplug) => return Answer::Gone,
            Some(StreamFault::Stall) => {
                (stream.is_silent, stream.sending) = (true, None);
                return Answer::Stall;
            }
            Some(StreamFault::Silent) => stream.is_silent = true,
            Some(StreamFault::Torn | StreamFault::Short(_)) => stream.sending = None,
            _ => {}
        }
        match fault {
            Some(StreamFault::Lost(_) | StreamFault::Silent | StreamFault::Torn) => nothing,
            fault => Answer::Data(spoiled(chunk, fault)),
        }
    }
}

/// Bytes with what a fault does to them.
fn spoiled(mut packet: Vec<u8>, fault: Option<StreamFault>) -> Vec<u8> {
    if let Some(fault) = fault {
        fault.cut(&mut packet);
    }
    packet
}

impl<S: Scene> SimulatedDevice for SimulatedCamera<S> {
    fn info(&self) -> SimulatedInfo {
        let [vendor, product, release] = self.shape.ids;
        let serial = self.shape.strings[2].clone();
        let iso_endpoints = match self.shape.wire {
            Wire::Bulk => Vec::new(),
            Wire::Isochronous => self.streams.iter().map(|s| (s.shape.endpoint, MICROFRAME)).collect(),
        };
        SimulatedInfo { vendor, product, release, speed: LinkSpeed::High, serial, iso_endpoints }
    }

    fn control(&mut self, setup: Setup, data: &[u8]) -> Answer {
        if let Some(answer) = self.standard(setup) {
            return answer;
        }
        if setup.request_type & 0x7f != 0x21 {
            return Answer::Stall;
        }
        let [interface, unit] = setup.index.to_le_bytes();
        if let Some(index) = self.streams.iter().position(|s| s.interface == interface) {
            return self.stream_control(index, setup, data);
        }
        let places = self.shape.interfaces();
        let function = places.iter().position(|(control, _)| *control == interface);
        let extension = function.and_then(|i| self.shape.functions[i].extension.as_ref());
        match extension {
            Some(extension) if extension.unit == unit => self.scene.extension(unit, setup, data),
            _ => Answer::Stall,
        }
    }

    fn isochronous(&mut self, endpoint: u8, microframe: u64, _room: usize) -> Packet {
        match self.streams.iter().position(|s| s.shape.endpoint == endpoint) {
            Some(index) => self.next_packet(index, microframe),
            None => Packet::Data(Vec::new()),
        }
    }

    fn bulk_in(&mut self, endpoint: u8, room: usize) -> Answer {
        match self.streams.iter().position(|s| s.shape.endpoint == endpoint) {
            Some(index) => self.next_read(index, room),
            None => Answer::Stall,
        }
    }
}
