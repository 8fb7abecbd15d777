//! The camera as a source of frames.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use toile_capture::{
    CaptureError, ClockDomain, ClockFit, ColorImage, DepthImage, DeviceIdentity, Frame, Rig, Sensor, Source, TickClock,
    host_now_ns,
    pairing::{Pair, Pairing},
};
use toile_driver_transport::{Bus, DeviceInfo, LinkSpeed, Transfer, TransferStatus, TransportError, UsbDevice, choose};
use toile_geometry::Rigid;

use crate::{
    Calibration, ColorMode, Health, Kinect2Error, Settings,
    color::{self, unmirrored},
    color_stream::{ColorImageBytes, ColorStream},
    commands::{Commands, Identity},
    decode::{COLUMNS, Decoder, ROWS},
    depth_stream::{DepthPacket, DepthStream},
    protocol::{COLOR_ENDPOINT, DEPTH_ENDPOINT, DEPTH_PACKET_ROOM},
    registration::Registration,
};

/// Microsoft's vendor id and the cameras' product ids (libfreenect2 `libfreenect2.hpp`).
const MICROSOFT: u16 = 0x045e;
const CAMERAS: [u16; 2] = [0x02d8, 0x02c4];

/// Frames a second.
const FPS: f64 = 30.0;
const FRAME_NS: f64 = 1e9 / FPS;
/// The camera's clock (libfreenect2 `frame_listener.hpp`: a tick is 0.125 ms).
const TICKS_PER_SECOND: u32 = 8000;
/// Microframes a second: what an isochronous packet takes.
const MICROFRAMES: f64 = 8000.0;
/// Bytes of a colour transfer (libfreenect2 `Freenect2DeviceImpl::open`).
const COLOR_TRANSFER: usize = 0x4000;

/// Colour transfers in flight (libfreenect2 `Freenect2DeviceImpl::open`), and packets of a depth transfer.
const COLOR_TRANSFERS: usize = 20;
const DEPTH_PACKETS: usize = 8;

/// The Kinects on a bus, each with its serial number (empty where it cannot be told).
///
/// # Errors
/// [`Kinect2Error::Transport`] where the bus cannot be read.
pub fn list(bus: &dyn Bus) -> Result<Vec<(DeviceInfo, String)>, Kinect2Error> {
    let cameras = bus.list()?.into_iter().filter(|info| info.vendor == MICROSOFT && CAMERAS.contains(&info.product));
    let serial =
        |info: &DeviceInfo| bus.open(info).map_or_else(|_| String::new(), |device| device.serial().to_string());
    Ok(cameras.map(|info| (serial(&info), info)).map(|(serial, info)| (info, serial)).collect())
}

/// A Kinect that streams.
///
/// After an unplug all frames that came are given, then one error, then the end.
pub struct Kinect2 {
    device: Box<dyn UsbDevice>,
    commands: Commands,
    settings: Settings,
    calibration: Calibration,
    decoder: Decoder,
    registration: Registration,
    rig: Rig,
    depth: DepthStream,
    color: ColorStream,
    clock: TickClock,
    host: ClockFit,
    pairing: Pairing<DepthPacket, ColorImageBytes>,
    last_given: Option<Given>,
    health: Health,
    /// Microframes since the last frame was whole.
    quiet: u64,
    /// Frames given when the streams were last switched off and on.
    frames_at_restart: Option<u64>,
    /// What ends the stream, to be told after the frames that came.
    end: Option<Kinect2Error>,
    ended: bool,
}

/// The frame that was given last.
#[derive(Debug, Clone, Copy)]
struct Given {
    number: u64,
    time_ns: i64,
    /// The camera's number of its depth.
    depth: Option<u32>,
}

impl Kinect2 {
    /// Opens the first Kinect, or that with this serial number, and starts it.
    ///
    /// # Errors
    /// [`Kinect2Error`] where there is none, it may not be opened, or its firmware does not answer as it should.
    pub fn open(bus: &dyn Bus, serial: Option<&str>, settings: Settings) -> Result<Self, Kinect2Error> {
        let (info, _) = choose(bus, list(bus)?, "a Kinect v2", serial)?;
        if matches!(info.speed, LinkSpeed::Full | LinkSpeed::High) {
            return Err(Kinect2Error::SlowLink);
        }
        let mut device = bus.open(&info)?;
        let mut commands = Commands::new(settings.command_limit);
        commands.open(&mut *device)?;
        let identity = commands.identity(&mut *device)?;
        let calibration = commands.calibration(&mut *device)?;
        let registration = Registration::new(&calibration);
        let mut kinect = Self {
            device,
            commands,
            decoder: Decoder::new(&calibration, settings.decode),
            rig: rig(identity, &calibration, &registration, settings.color),
            calibration,
            registration,
            settings,
            depth: DepthStream::default(),
            color: ColorStream::default(),
            clock: TickClock::new(TICKS_PER_SECOND),
            host: ClockFit::default(),
            pairing: Pairing::new((FRAME_NS / 2.0) as i64),
            last_given: None,
            health: Health::default(),
            quiet: 0,
            frames_at_restart: None,
            end: None,
            ended: false,
        };
        kinect.commands.start(&mut *kinect.device, kinect.settings.ready_limit)?;
        kinect.fill_queues()?;
        Ok(kinect)
    }

    /// What the camera told about itself.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Where depth is in the colour image.
    pub fn registration(&self) -> &Registration {
        &self.registration
    }

    /// How well it went so far.
    pub fn health(&self) -> Health {
        Health { depth: self.depth.losses(), color: self.color.losses(), alone: self.pairing.alone(), ..self.health }
    }

    fn fill_queues(&mut self) -> Result<(), Kinect2Error> {
        let room = self.device.iso_packet_size(DEPTH_ENDPOINT).unwrap_or(DEPTH_PACKET_ROOM);
        if room < DEPTH_PACKET_ROOM {
            return Err(Kinect2Error::SlowLink);
        }
        for _ in 0..self.settings.transfers.max(1) {
            self.device.submit(Transfer::isochronous(DEPTH_ENDPOINT, room, DEPTH_PACKETS)).map_err(advised)?;
        }
        let colors = if self.settings.color == ColorMode::Off { 0 } else { COLOR_TRANSFERS };
        for _ in 0..colors {
            self.device.submit(Transfer::bulk(COLOR_ENDPOINT, COLOR_TRANSFER)).map_err(advised)?;
        }
        Ok(())
    }

    /// Takes what a transfer brought and sends it on its way again.
    fn take(&mut self, transfer: Transfer) -> Result<(), Kinect2Error> {
        match transfer.status() {
            TransferStatus::Unplugged => return Err(TransportError::Unplugged.into()),
            TransferStatus::Cancelled => return Ok(()),
            _ => {}
        }
        if transfer.endpoint() == DEPTH_ENDPOINT {
            self.take_depth(&transfer);
        } else {
            self.take_color(&transfer)?;
        }
        self.device.submit(transfer).map_err(advised)
    }

    fn take_depth(&mut self, transfer: &Transfer) {
        let room = transfer.packet_room();
        for (status, packet) in transfer.packets() {
            self.quiet += 1;
            if let Some(packet) = self.depth.push(status, packet, room) {
                self.quiet = 0;
                match self.clock.time_ns(packet.ticks, Instant::now()) {
                    Some(time_ns) => self.pairing.push_depth(time_ns, packet),
                    None => tell_dropped("depth"),
                }
                if self.settings.color == ColorMode::Off {
                    self.pairing.finish();
                }
            }
        }
    }

    fn take_color(&mut self, transfer: &Transfer) -> Result<(), Kinect2Error> {
        match transfer.status() {
            TransferStatus::Completed => {
                if let Some(image) = self.color.push(transfer.data()) {
                    match self.clock.time_ns(image.ticks, Instant::now()) {
                        Some(time_ns) => self.pairing.push_color(time_ns, image),
                        None => tell_dropped("a colour image"),
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

    /// Gives a pair as a frame: decoded, with its number and what was lost before it.
    fn frame(&mut self, pair: Pair<DepthPacket, ColorImageBytes>) -> Result<Frame, Kinect2Error> {
        let time = pair.time_ns();
        let given = self.number(time, pair.depth.as_ref().map(|(_, packet)| packet.sequence));
        let lost = self.last_given.map_or(0, |last| given.number - last.number - 1);
        self.last_given = Some(given);
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
            device_frame: given.number,
            lost_before: u32::try_from(lost).unwrap_or(u32::MAX),
            device_time_ns: time,
            host_time_ns: self.host.host_time_ns(time, host_now_ns()),
            depth: depth_mm.map(|depth_mm| Arc::new(whole_mm(&depth_mm))),
            color,
        })
    }

    /// The number of a frame: by the camera's own numbers of depth where both have some, else by time.
    fn number(&self, time_ns: i64, depth: Option<u32>) -> Given {
        let number = match self.last_given {
            None => u64::from(depth.unwrap_or(0)),
            Some(last) => {
                let by_time = (time_ns.saturating_sub(last.time_ns) as f64 / FRAME_NS).round().max(1.0) as u64;
                let by_sequence = depth.zip(last.depth).map(|(now, before)| u64::from(now.wrapping_sub(before)));
                // A camera that counts anew (or nonsense) is no loss of thousands of frames.
                let steps = by_sequence.filter(|steps| (1..=by_time + 2).contains(steps)).unwrap_or(by_time);
                last.number + steps
            }
        };
        Given { number, time_ns, depth }
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
        let nothing = [0.0; COLUMNS * ROWS];
        let image = match self.settings.color {
            ColorMode::Full => unmirrored(pixels),
            _ => self.registration.register(depth_mm.unwrap_or(&nothing), &pixels),
        };
        Some(ColorImage::Rgb(Arc::new(image)))
    }

    /// After a silence: once more from the start; after the second in a row that is an error.
    fn wake(&mut self) -> Result<(), Kinect2Error> {
        if self.frames_at_restart == Some(self.health.frames) {
            return Err(Kinect2Error::Silent(self.settings.frame_limit.as_secs_f64()));
        }
        tracing::warn!("Kinect v2: no frame in time; its streams are switched off and on");
        self.health.restarts += 1;
        self.frames_at_restart = Some(self.health.frames);
        self.quiet = 0;
        self.depth.restart();
        self.color.restart();
        self.commands.restart(&mut *self.device)
    }

    fn step(&mut self) -> Result<(), Kinect2Error> {
        // Bus time decides; the clock only where transfers themselves no longer come back.
        match self.device.wait(3 * self.settings.frame_limit) {
            Ok(transfer) => self.take(transfer)?,
            Err(TransportError::TimedOut { .. }) => self.quiet = u64::MAX,
            Err(other) => return Err(other.into()),
        }
        let limit = (self.settings.frame_limit.as_secs_f64() * MICROFRAMES) as u64;
        if self.quiet > limit { self.wake() } else { Ok(()) }
    }

    fn device_error(&self, error: &Kinect2Error) -> CaptureError {
        CaptureError::Device { device: self.rig.sensors[0].name.clone(), reason: error.to_string() }
    }
}

impl Source for Kinect2 {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        loop {
            if let Some(pair) = self.pairing.pop() {
                return self.frame(pair).map(Some).map_err(|error| self.device_error(&error));
            }
            if let Some(error) = self.end.take() {
                return Err(self.device_error(&error));
            }
            if self.ended {
                return Ok(None);
            }
            if let Err(error) = self.step() {
                self.pairing.finish();
                (self.end, self.ended) = (Some(error), true);
            }
        }
    }
}

impl Drop for Kinect2 {
    fn drop(&mut self) {
        self.device.cancel(Duration::from_secs(2));
        if !self.ended {
            // A camera that is left on keeps the bus busy; whether it hears this cannot be helped.
            let _ = self.commands.stop(&mut *self.device);
        }
    }
}

fn tell_dropped(what: &str) {
    tracing::warn!("Kinect v2: {what} says a time that cannot be and is dropped");
}

/// Depth in whole millimetres: a fifth of the sensor's noise.
fn whole_mm(depth_mm: &[f32]) -> DepthImage {
    let values = depth_mm.iter().map(|mm| (mm + 0.5) as u16).collect();
    DepthImage { width: COLUMNS as u32, height: ROWS as u32, values }
}

fn rig(identity: Identity, calibration: &Calibration, registration: &Registration, mode: ColorMode) -> Rig {
    let (color, color_from_depth) = match mode {
        ColorMode::Registered => (Some(calibration.depth), Rigid::identity()),
        ColorMode::Full => {
            let (camera, color_from_depth) = registration.color_camera();
            (Some(camera), color_from_depth)
        }
        ColorMode::Off => (None, Rigid::identity()),
    };
    let sensor = Sensor {
        name: format!("kinect2-{}", identity.serial),
        identity: DeviceIdentity {
            model: "Kinect v2".into(),
            serial: identity.serial,
            firmware: identity.firmware,
            clock: ClockDomain::Device,
        },
        depth: calibration.depth,
        depth_scale: 0.001,
        color,
        color_from_depth,
        rig_from_depth: Rigid::identity(),
        fps: FPS,
    };
    Rig { sensors: vec![sensor] }
}

/// Where memory for transfers is used up, also by another program's, the error says how to allow more.
fn advised(error: TransportError) -> Kinect2Error {
    match error {
        TransportError::Failed { ref source, .. } if source.to_string().contains("memory") => {
            Kinect2Error::Memory(error)
        }
        other => other.into(),
    }
}
