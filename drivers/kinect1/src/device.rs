//! The camera as a source of frames.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use toile_capture::{
    CaptureError, ClockDomain, ClockFit, ColorImage, DepthImage, DeviceIdentity, Frame, RgbImage, Rig, Sensor, Source,
    TickClock, host_now_ns,
    pairing::{Pair, Pairing},
};
use toile_driver_transport::{Bus, DeviceInfo, Transfer, TransferStatus, TransportError, UsbDevice, choose};
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{
    Calibration, DepthMode, Health, Kinect1Error, Settings, VideoMode,
    assembler::Assembler,
    commands::Commands,
    decode::{self, HEIGHT, INFRARED_HEIGHT, WIDTH, packed_size},
    protocol::{PACKET_ROOM, Stream},
    registration::Registration,
};

/// Microsoft's vendor id and the cameras' product ids (libfreenect `src/freenect_internal.h`).
pub(crate) const MICROSOFT: u16 = 0x045e;
const CAMERAS: [u16; 2] = [0x02ae, 0x02bf];
const KINECT_FOR_WINDOWS: u16 = 0x02bf;
/// Product ids of the microphones, whose serial number stands for the camera's in models after 1414.
const MICROPHONES: [u16; 4] = [0x02ad, 0x02be, 0x02c3, 0x02bb];
/// What those cameras tell instead of a serial number (libfreenect `src/usb_libusb10.c`).
const NO_SERIAL: &str = "0000000000000000";

/// Frames a second.
const FPS: f64 = 30.0;
/// The camera's clock runs at 60 MHz: frames of 30 Hz are two million ticks apart.
const TICKS_PER_SECOND: u32 = 60_000_000;
const FRAME_NS: f64 = 1e9 / FPS;
/// Microframes a second: what an isochronous packet takes.
const MICROFRAMES: f64 = 8000.0;

/// The Kinects on a bus, each with its serial number (empty where it cannot be told).
///
/// # Errors
/// [`Kinect1Error::Transport`] where the bus cannot be read.
pub fn list(bus: &dyn Bus) -> Result<Vec<(DeviceInfo, String)>, Kinect1Error> {
    let cameras = bus.list()?.into_iter().filter(is_camera);
    Ok(cameras.map(|info| (serial_of(bus, &info).unwrap_or_default(), info)).map(|(s, i)| (i, s)).collect())
}

fn is_camera(info: &DeviceInfo) -> bool {
    info.vendor == MICROSOFT && CAMERAS.contains(&info.product)
}

fn serial_of(bus: &dyn Bus, camera: &DeviceInfo) -> Result<String, TransportError> {
    let told = bus.open(camera)?.serial().to_string();
    if !told.is_empty() && told != NO_SERIAL {
        return Ok(told);
    }
    let beside =
        |info: &DeviceInfo| info.vendor == MICROSOFT && MICROPHONES.contains(&info.product) && info.hub == camera.hub;
    let found = bus.list()?.into_iter().find(|info| beside(info) && info.address.0 == camera.address.0);
    found.map_or(Ok(String::new()), |info| Ok(bus.open(&info)?.serial().to_string()))
}

/// A Kinect that streams.
///
/// After an unplug all frames that came are given, then one error, then the end.
pub struct Kinect1 {
    device: Box<dyn UsbDevice>,
    commands: Commands,
    settings: Settings,
    calibration: Calibration,
    mm_from_raw: Vec<u16>,
    registration: Registration,
    rig: Rig,
    depth: Assembler,
    video: Assembler,
    clock: TickClock,
    host: ClockFit,
    pairing: Pairing<DepthImage, RgbImage>,
    last_given: Option<(u64, i64)>,
    health: Health,
    /// Microframes since the last frame was whole.
    quiet: u64,
    /// Frames given when the streams were last switched off and on.
    frames_at_restart: Option<u64>,
    /// What ends the stream, to be told after the frames that came.
    end: Option<Kinect1Error>,
    ended: bool,
}

impl Kinect1 {
    /// Opens the first Kinect, or that with this serial number, and starts it.
    ///
    /// # Errors
    /// [`Kinect1Error`] where there is none, it may not be opened, or its firmware does not answer as it should.
    pub fn open(bus: &dyn Bus, serial: Option<&str>, settings: Settings) -> Result<Self, Kinect1Error> {
        let (info, serial) = choose(bus, list(bus)?, "a Kinect v1", serial)?;
        let mut device = bus.open(&info)?;
        // The Kinect for Windows streams in its first alternate setting only (libfreenect `fnusb_claim_camera`).
        device.claim(0, u8::from(info.product == KINECT_FOR_WINDOWS))?;
        let mut commands = Commands::new(settings.command_limit);
        let calibration = commands.calibration(&mut *device)?;
        let registration = Registration::new(&calibration);
        let rig = rig(&info, serial, &registration, &settings);
        let (bits, video_bytes) =
            (if settings.depth == DepthMode::Eleven { 11 } else { 10 }, video_bytes(settings.video));
        let mut kinect = Self {
            device,
            commands,
            mm_from_raw: calibration.mm_from_raw(),
            calibration,
            registration,
            rig,
            depth: Assembler::new(Stream::Depth, packed_size(WIDTH * HEIGHT, bits)),
            video: Assembler::new(Stream::Video, video_bytes),
            settings,
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
        kinect.fill_queues()?;
        kinect.switch_on()?;
        Ok(kinect)
    }

    /// What the camera told about itself.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Where depth goes in the colour image.
    pub fn registration(&self) -> &Registration {
        &self.registration
    }

    /// How well it went so far.
    pub fn health(&self) -> Health {
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
        self.quiet = 0;
        Ok(())
    }

    /// Takes what a transfer brought and sends it on its way again.
    fn take(&mut self, transfer: Transfer) -> Result<(), Kinect1Error> {
        match transfer.status() {
            TransferStatus::Unplugged => return Err(TransportError::Unplugged.into()),
            TransferStatus::Cancelled => return Ok(()),
            _ => {}
        }
        let is_depth = transfer.endpoint() == Stream::Depth.endpoint();
        let mut frames = Vec::new();
        let assembler = if is_depth { &mut self.depth } else { &mut self.video };
        for (status, packet) in transfer.packets() {
            if let Some((ticks, bytes)) = assembler.push(status, packet) {
                frames.push((ticks, bytes.to_vec()));
            }
        }
        self.quiet += if is_depth { transfer.packets().len() as u64 } else { 0 };
        for (ticks, bytes) in frames {
            self.quiet = 0;
            match self.clock.time_ns(ticks, Instant::now()) {
                Some(time_ns) if is_depth => self.push_depth(time_ns, &bytes),
                Some(time_ns) => self.push_video(time_ns, &bytes),
                None => tracing::warn!("Kinect v1: a frame says a time that cannot be and is dropped"),
            }
        }
        self.device.submit(transfer)?;
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

    /// Gives a pair as a frame with its number: how many frame times it is after the one before.
    fn frame(&mut self, pair: Pair<DepthImage, RgbImage>) -> Frame {
        let time = pair.time_ns();
        let (number, lost) = match self.last_given {
            None => (0, 0),
            Some((number, last)) => {
                let steps = (((time - last) as f64 / FRAME_NS).round() as u64).max(1);
                (number + steps, steps - 1)
            }
        };
        self.last_given = Some((number, time));
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

    /// After a silence: once more from the start; after the second in a row that is an error.
    fn wake(&mut self) -> Result<(), Kinect1Error> {
        if self.frames_at_restart == Some(self.health.frames) {
            return Err(Kinect1Error::Silent(self.settings.frame_limit.as_secs_f64()));
        }
        tracing::warn!("Kinect v1: no frame in time; its streams are switched off and on");
        self.health.restarts += 1;
        self.frames_at_restart = Some(self.health.frames);
        self.depth.restart();
        self.video.restart();
        self.switch_on()
    }

    fn step(&mut self) -> Result<(), Kinect1Error> {
        // Bus time decides; the clock only where transfers themselves no longer come back.
        match self.device.wait(3 * self.settings.frame_limit) {
            Ok(transfer) => self.take(transfer)?,
            Err(TransportError::TimedOut { .. }) => self.quiet = u64::MAX,
            Err(other) => return Err(other.into()),
        }
        let limit = (self.settings.frame_limit.as_secs_f64() * MICROFRAMES) as u64;
        if self.quiet > limit { self.wake() } else { Ok(()) }
    }
}

impl Source for Kinect1 {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        loop {
            if let Some(pair) = self.pairing.pop() {
                return Ok(Some(self.frame(pair)));
            }
            if let Some(error) = self.end.take() {
                let device = self.rig.sensors[0].name.clone();
                return Err(CaptureError::Device { device, reason: error.to_string() });
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

impl Drop for Kinect1 {
    fn drop(&mut self) {
        if !self.ended {
            // A camera that is left on keeps the bus busy; whether it hears this cannot be helped.
            for register in [0x06, 0x05] {
                let _ = self.commands.write(&mut *self.device, register, 0);
            }
        }
        self.device.cancel(Duration::from_secs(2));
    }
}

fn video_bytes(mode: VideoMode) -> usize {
    match mode {
        VideoMode::Infrared => packed_size(WIDTH * INFRARED_HEIGHT, 10),
        _ => WIDTH * HEIGHT,
    }
}

fn rig(info: &DeviceInfo, serial: String, registration: &Registration, settings: &Settings) -> Rig {
    let (color, color_from_depth) = registration.color_camera();
    let measured = registration.depth_camera();
    // Where the eight more rows of infrared stand is told nowhere: half above, half below.
    let margin = (INFRARED_HEIGHT - HEIGHT) as f64 / 2.0;
    let infrared = PinholeCamera { height: INFRARED_HEIGHT as u32, cy: measured.cy + margin, ..measured };
    let (color, color_from_depth) = match (settings.video, settings.registered) {
        (VideoMode::Off, _) => (None, Rigid::identity()),
        (VideoMode::Color, true) => (Some(color), Rigid::identity()),
        (VideoMode::Color, false) => (Some(color), color_from_depth),
        (VideoMode::Infrared, true) => (Some(infrared), color_from_depth.inverse()),
        (VideoMode::Infrared, false) => (Some(infrared), Rigid::identity()),
    };
    let sensor = Sensor {
        name: if serial.is_empty() { "kinect1".into() } else { format!("kinect1-{serial}") },
        identity: DeviceIdentity {
            model: "Kinect v1".into(),
            serial,
            firmware: format!("{:x}.{:02x}", info.release >> 8, info.release & 0xff),
            clock: ClockDomain::Device,
        },
        depth: if settings.registered { registration.color_camera().0 } else { measured },
        depth_scale: 0.001,
        color,
        color_from_depth,
        rig_from_depth: Rigid::identity(),
        fps: FPS,
    };
    Rig { sensors: vec![sensor] }
}
