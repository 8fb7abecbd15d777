//! Transfers to frames: what the bus brings to depth and colour, paired by time.

use std::{
    ops::ControlFlow,
    sync::Arc,
    time::{Duration, Instant},
};

use toile_capture::{
    ClockFit, ColorImage, DepthImage, Frame, RgbImage, TickClock, host_now_ns,
    pairing::{Pair, Pairing},
};
use toile_driver_transport::{
    Transfer, UsbDevice,
    streaming::{Numbering, Progress, Streaming, Streams, next_transfer},
    usb::MICROFRAME,
};

use crate::{
    Calibration, DepthMode, Health, Kinect1Error, Settings, VideoMode,
    assembler::Assembler,
    commands::Commands,
    decode::{self, HEIGHT, INFRARED_HEIGHT, WIDTH, packed_size},
    protocol::{PACKET_ROOM, Stream},
    registration::Registration,
};

/// Frames a second.
pub(crate) const FPS: f64 = 30.0;
const FRAME_NS: f64 = 1e9 / FPS;
/// The camera's clock runs at 60 MHz: frames of 30 Hz are two million ticks apart.
const TICKS_PER_SECOND: u32 = 60_000_000;

/// Depth and video of an open Kinect.
pub(crate) struct Kinect1Streams {
    device: Box<dyn UsbDevice>,
    commands: Commands,
    pub(crate) settings: Settings,
    mm_from_raw: Vec<u16>,
    pub(crate) registration: Registration,
    depth: Assembler,
    video: Assembler,
    clock: TickClock,
    host: ClockFit,
    pairing: Pairing<DepthImage, RgbImage>,
    numbering: Numbering,
    health: Health,
}

impl Kinect1Streams {
    /// Submits the transfers of a device whose interface is claimed, and switches its streams on.
    pub(crate) fn start(
        device: Box<dyn UsbDevice>,
        commands: Commands,
        calibration: &Calibration,
        settings: Settings,
    ) -> Result<Streaming<Self>, Kinect1Error> {
        let bits = if settings.depth == DepthMode::Eleven { 11 } else { 10 };
        let limit = settings.frame_limit;
        let streams = Self {
            device,
            commands,
            mm_from_raw: calibration.mm_from_raw(),
            registration: Registration::new(calibration),
            depth: Assembler::new(Stream::Depth, packed_size(WIDTH * HEIGHT, bits)),
            video: Assembler::new(Stream::Video, video_bytes(settings.video)),
            settings,
            clock: TickClock::new(TICKS_PER_SECOND),
            host: ClockFit::default(),
            pairing: Pairing::new((FRAME_NS / 2.0) as i64),
            numbering: Numbering::new(FRAME_NS),
            health: Health::default(),
        };
        Streaming::start(streams, limit, |streams| {
            streams.fill_queues()?;
            streams.switch_on()
        })
    }

    /// How well it went so far, restarts left out.
    pub(crate) fn health(&self) -> Health {
        Health { depth: self.depth.losses(), video: self.video.losses(), alone: self.pairing.alone(), ..self.health }
    }

    fn fill_queues(&mut self) -> Result<(), Kinect1Error> {
        for stream in self.streams() {
            let room = self.device.iso_packet_size(stream.endpoint()).unwrap_or(PACKET_ROOM);
            for _ in 0..self.settings.transfers.max(1) {
                let packets = self.settings.packets.max(1);
                self.device.submit(Transfer::isochronous(stream.endpoint(), room, packets))?;
            }
        }
        Ok(())
    }

    fn streams(&self) -> Vec<Stream> {
        if self.settings.video == VideoMode::Off { vec![Stream::Depth] } else { vec![Stream::Video, Stream::Depth] }
    }

    /// Registers and values from libfreenect `src/cameras.c`, `freenect_start_depth` and `freenect_start_video`.
    fn switch_on(&mut self) -> Result<(), Kinect1Error> {
        let depth_bits = if self.settings.depth == DepthMode::Eleven { 3 } else { 2 };
        // Projector always on; depth off; bits; 640×480; 30 Hz; on; not mirrored.
        let depth = [(0x105, 0), (0x06, 0), (0x12, depth_bits), (0x13, 1), (0x14, 30), (0x06, 2), (0x17, 0)];
        let video: &[(u16, u16)] = match self.settings.video {
            // Bayer; 640×480; 30 Hz; on; not mirrored.
            VideoMode::Color => &[(0x05, 0), (0x0c, 0), (0x0d, 1), (0x0e, 30), (0x05, 1), (0x47, 0)],
            // Ten bits; 640×488; 30 Hz; on as infrared; not mirrored.
            VideoMode::Infrared => &[(0x05, 0), (0x19, 0), (0x1a, 1), (0x1b, 30), (0x05, 3), (0x48, 0)],
            VideoMode::Off => &[(0x05, 0)],
        };
        for &(register, value) in depth.iter().chain(video) {
            self.commands.write(&mut *self.device, register, value)?;
        }
        Ok(())
    }

    fn push_depth(&mut self, time_ns: i64, bytes: &[u8]) {
        let mut values = match self.settings.depth {
            DepthMode::Eleven => decode::unpack(bytes, 11),
            DepthMode::Ten => {
                let mut raw = decode::unpack(bytes, 10);
                decode::eleven_from_ten(&mut raw);
                raw
            }
        };
        values.iter_mut().for_each(|v| *v = self.mm_from_raw.get(usize::from(*v)).copied().unwrap_or(0));
        if self.settings.registered {
            values = self.registration.register(&values);
        }
        self.pairing.push_depth(time_ns, DepthImage { width: WIDTH as u32, height: HEIGHT as u32, values });
        if self.settings.video == VideoMode::Off {
            self.pairing.finish();
        }
    }

    fn push_video(&mut self, time_ns: i64, bytes: &[u8]) {
        let image = match self.settings.video {
            VideoMode::Infrared => Some(decode::grey(&decode::unpack(bytes, 10))),
            _ => decode::demosaic(bytes),
        };
        if let Some(image) = image {
            self.pairing.push_color(time_ns, image);
        }
    }

    /// Takes what a transfer brought; how many whole pictures that made.
    fn take(&mut self, transfer: &Transfer) -> usize {
        let is_depth = transfer.endpoint() == Stream::Depth.endpoint();
        let assembler = if is_depth { &mut self.depth } else { &mut self.video };
        let mut pictures = Vec::new();
        for (status, packet) in transfer.packets() {
            if let Some((ticks, bytes)) = assembler.push(status, packet) {
                pictures.push((ticks, bytes.to_vec()));
            }
        }
        for (ticks, bytes) in &pictures {
            match self.clock.time_ns(*ticks, Instant::now()) {
                Some(time_ns) if is_depth => self.push_depth(time_ns, bytes),
                Some(time_ns) => self.push_video(time_ns, bytes),
                None => tracing::warn!("Kinect v1: a picture with an impossible time is dropped"),
            }
        }
        pictures.len()
    }

    /// Makes a frame of a pair.
    fn frame(&mut self, pair: Pair<DepthImage, RgbImage>) -> Frame {
        let time = pair.time_ns();
        let (number, lost) = self.numbering.count(time, None);
        self.health.lost_frames += lost;
        self.health.frames += 1;
        Frame {
            sensor: 0,
            index: self.health.frames - 1,
            device_frame: number,
            lost_before: u32::try_from(lost).unwrap_or(u32::MAX),
            device_time_ns: time,
            host_time_ns: self.host.host_time_ns(time, host_now_ns()),
            depth: pair.depth.map(|(_, image)| Arc::new(image)),
            color: pair.color.map(|(_, image)| ColorImage::Rgb(Arc::new(image))),
        }
    }
}

impl Streams for Kinect1Streams {
    type Frame = Frame;
    type Error = Kinect1Error;

    fn pop(&mut self) -> Option<Result<Frame, Kinect1Error>> {
        let pair = self.pairing.pop()?;
        Some(Ok(self.frame(pair)))
    }

    fn step(&mut self) -> Result<Progress, Kinect1Error> {
        let transfer = match next_transfer(&mut *self.device, self.settings.frame_limit)? {
            ControlFlow::Continue(transfer) => transfer,
            ControlFlow::Break(nothing) => return Ok(nothing),
        };
        let pictures = self.take(&transfer);
        let is_depth = transfer.endpoint() == Stream::Depth.endpoint();
        let packets = if is_depth { transfer.packets().len() as u32 } else { 0 };
        self.device.submit(transfer)?;
        Ok(if pictures > 0 { Progress::Picture } else { Progress::Silence(packets * MICROFRAME) })
    }

    fn restart(&mut self) -> Result<(), Kinect1Error> {
        self.depth.restart();
        self.video.restart();
        self.switch_on()
    }

    fn finish(&mut self) {
        self.pairing.finish();
    }

    /// Switches the camera off where it still answers, and gives the transfers back.
    fn stop(&mut self, answers: bool) {
        if answers {
            // A camera that is left on keeps the bus busy; whether it hears this cannot be helped.
            for register in [0x06, 0x05] {
                let _ = self.commands.write(&mut *self.device, register, 0);
            }
        }
        self.device.cancel(Duration::from_secs(2));
    }

    fn silent(limit: Duration) -> Kinect1Error {
        Kinect1Error::Silent(limit.as_secs_f64())
    }
}

fn video_bytes(mode: VideoMode) -> usize {
    match mode {
        VideoMode::Infrared => packed_size(WIDTH * INFRARED_HEIGHT, 10),
        _ => WIDTH * HEIGHT,
    }
}
