//! Transfers to frames: what the bus brings to depth and colour, paired by time and decoded.

use std::{
    ops::ControlFlow,
    sync::Arc,
    time::{Duration, Instant},
};

use toile_capture::{
    ClockFit, ColorImage, DepthImage, Frame, TickClock, host_now_ns,
    pairing::{Pair, Pairing},
};
use toile_driver_transport::{
    Transfer, TransferStatus, TransportError, UsbDevice,
    streaming::{Numbering, Progress, Streaming, Streams, next_transfer},
    usb::MICROFRAME,
};

use crate::{
    Calibration, ColorMode, Health, Kinect2Error, Settings,
    color::{self, unmirrored},
    color_stream::{ColorImageBytes, ColorStream},
    commands::Commands,
    decode::Decoder,
    depth_stream::{DepthPacket, DepthStream},
    protocol::{COLOR_ENDPOINT, DEPTH_ENDPOINT, DEPTH_PACKET_ROOM},
    registration::Registration,
    size::{COLUMNS, ROWS},
};

/// Frames a second.
pub(crate) const FPS: f64 = 30.0;
const FRAME_NS: f64 = 1e9 / FPS;
/// The camera's clock (libfreenect2 `frame_listener.hpp`: a tick is 0.125 ms).
const TICKS_PER_SECOND: u32 = 8000;
/// Bytes of a colour transfer (libfreenect2 `Freenect2DeviceImpl::open`).
const COLOR_TRANSFER: usize = 0x4000;
/// Colour transfers in flight (libfreenect2 `Freenect2DeviceImpl::open`), and packets of a depth transfer.
const COLOR_TRANSFERS: usize = 20;
const DEPTH_PACKETS: usize = 8;

/// Depth and colour of an open Kinect.
pub(crate) struct Kinect2Streams {
    device: Box<dyn UsbDevice>,
    commands: Commands,
    settings: Settings,
    decoder: Decoder,
    pub(crate) registration: Registration,
    depth: DepthStream,
    color: ColorStream,
    clock: TickClock,
    host: ClockFit,
    pairing: Pairing<DepthPacket, ColorImageBytes>,
    numbering: Numbering,
    health: Health,
}

impl Kinect2Streams {
    /// Switches the streams of an open device on and submits the transfers.
    pub(crate) fn start(
        device: Box<dyn UsbDevice>,
        commands: Commands,
        calibration: &Calibration,
        settings: Settings,
    ) -> Result<Streaming<Self>, Kinect2Error> {
        let limit = settings.frame_limit;
        let streams = Self {
            device,
            commands,
            decoder: Decoder::new(calibration, settings.decode),
            registration: Registration::new(calibration),
            settings,
            depth: DepthStream::default(),
            color: ColorStream::default(),
            clock: TickClock::new(TICKS_PER_SECOND),
            host: ClockFit::default(),
            pairing: Pairing::new((FRAME_NS / 2.0) as i64),
            numbering: Numbering::new(FRAME_NS),
            health: Health::default(),
        };
        Streaming::start(streams, limit, |streams| {
            streams.switch_on()?;
            streams.fill_queues()
        })
    }

    /// How well it went so far, restarts left out.
    pub(crate) fn health(&self) -> Health {
        Health { depth: self.depth.losses(), color: self.color.losses(), alone: self.pairing.alone(), ..self.health }
    }

    fn switch_on(&mut self) -> Result<(), Kinect2Error> {
        self.commands.start(&mut *self.device, self.settings.ready_limit)
    }

    fn fill_queues(&mut self) -> Result<(), Kinect2Error> {
        let room = self.device.iso_packet_size(DEPTH_ENDPOINT).unwrap_or(DEPTH_PACKET_ROOM);
        if room < DEPTH_PACKET_ROOM {
            return Err(Kinect2Error::SlowLink);
        }
        for _ in 0..self.settings.transfers.max(1) {
            self.device.submit(Transfer::isochronous(DEPTH_ENDPOINT, room, DEPTH_PACKETS))?;
        }
        let colors = if self.settings.color == ColorMode::Off { 0 } else { COLOR_TRANSFERS };
        for _ in 0..colors {
            self.device.submit(Transfer::bulk(COLOR_ENDPOINT, COLOR_TRANSFER))?;
        }
        Ok(())
    }

    /// Takes the packets of a depth transfer.
    fn take_depth(&mut self, transfer: &Transfer) -> Progress {
        let room = transfer.packet_room();
        let mut progress = Progress::Silence(transfer.packets().len() as u32 * MICROFRAME);
        for (status, packet) in transfer.packets() {
            if let Some(packet) = self.depth.push(status, packet, room) {
                progress = Progress::Picture;
                match self.clock.time_ns(packet.ticks, Instant::now()) {
                    Some(time_ns) => self.pairing.push_depth(time_ns, packet),
                    None => warn_dropped("depth"),
                }
                if self.settings.color == ColorMode::Off {
                    self.pairing.finish();
                }
            }
        }
        progress
    }

    /// Takes what a colour transfer brought.
    fn take_color(&mut self, transfer: &Transfer) -> Result<(), Kinect2Error> {
        match transfer.status() {
            TransferStatus::Completed => {
                if let Some(image) = self.color.push(transfer.data()) {
                    match self.clock.time_ns(image.ticks, Instant::now()) {
                        Some(time_ns) => self.pairing.push_color(time_ns, image),
                        None => warn_dropped("a colour image"),
                    }
                }
            }
            TransferStatus::Stalled => {
                let what = "the colour stream".into();
                return Err(TransportError::Stalled { what }.into());
            }
            _ => self.color.lose(),
        }
        Ok(())
    }

    /// Makes a frame of a pair: decoded, with its number and what was lost before it.
    fn frame(&mut self, pair: Pair<DepthPacket, ColorImageBytes>) -> Result<Frame, Kinect2Error> {
        let time = pair.time_ns();
        let (number, lost) = self.numbering.count(time, pair.depth.as_ref().map(|(_, packet)| packet.sequence));
        self.health.lost_frames += lost;
        self.health.frames += 1;
        let decoded = pair.depth.map(|(_, packet)| self.decoder.decode(&packet.bytes)).transpose()?;
        let depth_mm = decoded.map(|decoded| decoded.depth_mm);
        let color = match pair.color {
            Some((_, image)) => self.color(&image.jpeg, depth_mm.as_deref()),
            None => None,
        };
        Ok(Frame {
            sensor: 0,
            index: self.health.frames - 1,
            device_frame: number,
            lost_before: u32::try_from(lost).unwrap_or(u32::MAX),
            device_time_ns: time,
            host_time_ns: self.host.host_time_ns(time, host_now_ns()),
            depth: depth_mm.map(|depth_mm| Arc::new(whole_mm(&depth_mm))),
            color,
        })
    }

    /// The colour image as the settings want it; one that cannot be decoded is counted.
    fn color(&mut self, jpeg: &[u8], depth_mm: Option<&[f32]>) -> Option<ColorImage> {
        let pixels = match color::decode(jpeg) {
            Ok(pixels) => pixels,
            Err(error) => {
                tracing::debug!(%error, "a colour image is dropped");
                self.color.count_bad();
                return None;
            }
        };
        let nothing = if depth_mm.is_none() { vec![0.0; COLUMNS * ROWS] } else { Vec::new() };
        let image = match self.settings.color {
            ColorMode::Full => unmirrored(pixels),
            _ => self.registration.register(depth_mm.unwrap_or(&nothing), &pixels),
        };
        Some(ColorImage::Rgb(Arc::new(image)))
    }
}

impl Streams for Kinect2Streams {
    type Frame = Frame;
    type Error = Kinect2Error;

    fn pop(&mut self) -> Option<Result<Frame, Kinect2Error>> {
        let pair = self.pairing.pop()?;
        Some(self.frame(pair))
    }

    fn step(&mut self) -> Result<Progress, Kinect2Error> {
        let transfer = match next_transfer(&mut *self.device, self.settings.frame_limit)? {
            ControlFlow::Continue(transfer) => transfer,
            ControlFlow::Break(nothing) => return Ok(nothing),
        };
        let progress = if transfer.endpoint() == DEPTH_ENDPOINT {
            self.take_depth(&transfer)
        } else {
            self.take_color(&transfer)?;
            Progress::Silence(Duration::ZERO)
        };
        self.device.submit(transfer)?;
        Ok(progress)
    }

    fn restart(&mut self) -> Result<(), Kinect2Error> {
        self.depth.restart();
        self.color.restart();
        self.commands.restart(&mut *self.device)
    }

    fn finish(&mut self) {
        self.pairing.finish();
    }

    /// Gives the transfers back, and switches the camera off where it still answers.
    fn stop(&mut self, answers: bool) {
        self.device.cancel(Duration::from_secs(2));
        if answers {
            // A camera that is left on keeps the bus busy; whether it hears this cannot be helped.
            let _ = self.commands.stop(&mut *self.device);
        }
    }

    fn silent(limit: Duration) -> Kinect2Error {
        Kinect2Error::Silent(limit.as_secs_f64())
    }
}

fn warn_dropped(what: &str) {
    tracing::warn!("Kinect v2: {what} with an impossible time is dropped");
}

/// Depth in whole millimetres: a fifth of the sensor's noise.
fn whole_mm(depth_mm: &[f32]) -> DepthImage {
    let values = depth_mm.iter().map(|mm| (mm + 0.5) as u16).collect();
    DepthImage { width: COLUMNS as u32, height: ROWS as u32, values }
}
