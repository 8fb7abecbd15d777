//! The camera as a source of frames.

use std::{collections::VecDeque, sync::Arc, time::Duration};

use toile_capture::{
    CaptureError, ClockDomain, ClockFit, ColorImage, DepthImage, Frame, RgbImage, Rig, Source, host_now_ns,
    pairing::{Pair, Pairing},
};
use toile_driver_transport::{
    TransportError,
    video::{FourCc, Video},
};

use crate::{
    Calibration, Camera, Controls, Health, RealsenseError, Settings, VideoMode, decode, find, monitor,
    monitor::Details,
    rig::rig,
    stream::{Shot, Stream},
};

/// How long one stream is waited for before the other is looked at.
const TURN: Duration = Duration::from_millis(5);
/// So many pictures of a stream in a row without a time mean that there will be none.
const MOST_WITHOUT_TIME: u32 = 10;
/// Nanoseconds of a microsecond.
const MICROSECOND: i64 = 1000;

/// What came beside depth: one image, or left and right.
type Beside = (RgbImage, Option<RgbImage>);

/// A RealSense camera that streams.
///
/// After an unplug all frames that came are given, then one error, then the end.
pub struct Realsense {
    depth: Stream,
    beside: Option<Stream>,
    calibration: Calibration,
    settings: Settings,
    rig: Rig,
    /// Both streams have the camera's own time.
    has_device_time: bool,
    clocks: [Clock; 2],
    host: ClockFit,
    pairing: Pairing<DepthImage, Beside>,
    ready: VecDeque<Frame>,
    last_given: Option<(u64, i64)>,
    health: Health,
    quiet: Duration,
    frames_at_restart: Option<u64>,
    /// What ends the stream, to be told after the frames that came.
    end: Option<RealsenseError>,
    ended: bool,
}

impl Realsense {
    /// Opens the first camera, or that with this serial number (as printed on it, or its USB device's), and starts it.
    ///
    /// # Errors
    /// [`RealsenseError`] where there is none, it may not be opened, or its firmware does not answer as it should.
    pub fn open(video: &dyn Video, serial: Option<&str>, mut settings: Settings) -> Result<Self, RealsenseError> {
        let (camera, details) = choose(video, serial)?;
        if settings.video == VideoMode::Color && !camera.has_color_part() {
            tracing::info!("{} has no colour camera; it gives depth alone", camera.name);
            settings.video = VideoMode::Off;
        }
        let (width, height) = settings.size;
        let size = (width, height, settings.fps);
        let depth = camera.depth.as_ref().ok_or(RealsenseError::NoNode("depth"))?;
        let mut depth = Stream::open(video, depth, FourCc::Z16, size, settings.buffers)?;
        let color_size = (settings.color_size.0, settings.color_size.1, settings.fps);
        let (beside, what, format, size) = match settings.video {
            VideoMode::Color => (&camera.color, "colour", FourCc::YUYV, color_size),
            VideoMode::Infrared => (&camera.infrared, "infrared", FourCc::Y8I, size),
            VideoMode::Off => (&None, "", FourCc::YUYV, size),
        };
        let beside = match (beside, settings.video) {
            (_, VideoMode::Off) => None,
            (None, _) => return Err(RealsenseError::NoNode(what)),
            (Some(nodes), _) => Some(Stream::open(video, nodes, format, size, settings.buffers)?),
        };
        let calibration = Calibration::read(depth.node(), settings.video == VideoMode::Color)?;
        settings.controls.apply(depth.node())?;
        let has_device_time = depth.has_metadata() && beside.as_ref().is_none_or(Stream::has_metadata);
        let clock = if has_device_time { ClockDomain::Device } else { ClockDomain::HostMonotonic };
        let rig = rig(&camera, &details, &calibration, &settings, clock)?;
        let period = 1_000_000_000 / i64::from(settings.fps.max(1));
        let mut opened = Self {
            depth,
            beside,
            calibration,
            settings,
            rig,
            has_device_time,
            clocks: [Clock::new(period); 2],
            host: ClockFit::default(),
            pairing: Pairing::new(period / 2),
            ready: VecDeque::new(),
            last_given: None,
            health: Health::default(),
            quiet: Duration::ZERO,
            frames_at_restart: None,
            end: None,
            ended: false,
        };
        opened.start()?;
        Ok(opened)
    }

    /// What the camera told about its lenses.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// How well it went so far.
    pub fn health(&self) -> Health {
        Health { alone: self.pairing.alone(), ..self.health }
    }

    /// Laser, exposure and preset as they are now.
    ///
    /// # Errors
    /// [`RealsenseError::Transport`].
    pub fn controls(&mut self) -> Result<Controls, RealsenseError> {
        Controls::read(self.depth.node())
    }

    fn start(&mut self) -> Result<(), RealsenseError> {
        self.depth.start()?;
        if let Some(beside) = &mut self.beside {
            beside.start()?;
        }
        self.clocks.iter_mut().for_each(Clock::restart);
        self.quiet = Duration::ZERO;
        Ok(())
    }

    /// Takes what came, each stream in its turn.
    fn step(&mut self) -> Result<(), RealsenseError> {
        let mut came = false;
        if let Some(shot) = self.depth.next(TURN)? {
            came = true;
            self.push_depth(&shot);
        }
        if let Some(beside) = &mut self.beside
            && let Some(shot) = beside.next(TURN)?
        {
            came = true;
            self.push_beside(&shot);
        }
        if came {
            self.quiet = Duration::ZERO;
            return Ok(());
        }
        self.quiet += if self.beside.is_some() { 2 * TURN } else { TURN };
        if self.quiet > self.settings.frame_limit { self.wake() } else { Ok(()) }
    }

    fn push_depth(&mut self, shot: &Shot) {
        let Some(time) = self.time(0, shot) else { return };
        match decode::depth(&shot.buffer.bytes, self.depth.layout()) {
            Ok(image) => self.pairing.push_depth(time, image),
            Err(reason) => self.tell_broken("depth", &reason),
        }
        if self.beside.is_none() {
            self.pairing.finish();
        }
        self.give();
    }

    fn push_beside(&mut self, shot: &Shot) {
        let Some(time) = self.time(1, shot) else { return };
        let Some(layout) = self.beside.as_ref().map(Stream::layout) else { return };
        let decoded = match self.settings.video {
            VideoMode::Infrared => decode::infrared_pair(&shot.buffer.bytes, layout).map(|[l, r]| (l, Some(r))),
            _ => decode::color(&shot.buffer.bytes, layout).map(|image| (image, None)),
        };
        match decoded {
            Ok(images) => self.pairing.push_color(time, images),
            Err(reason) => self.tell_broken("colour", &reason),
        }
        self.give();
    }

    fn tell_broken(&mut self, what: &str, reason: &str) {
        self.health.broken += 1;
        tracing::warn!("RealSense: a {what} picture cannot be read: {reason}");
    }

    /// Time of a picture by the camera's clock, or by the kernel's where there is no metadata at all. `None` where it is
    /// not told: a guess could pair depth with the colour of another moment, so that picture is a lost one.
    fn time(&mut self, stream: usize, shot: &Shot) -> Option<i64> {
        let other = self.clocks[1 - stream].last;
        let clock = &mut self.clocks[stream];
        self.health.lost_pictures[stream] += clock.lost(shot.buffer.sequence);
        let told = if self.has_device_time { shot.metadata.time_us } else { None };
        self.health.without_time += u64::from(told.is_none());
        clock.untold = if told.is_none() { clock.untold + 1 } else { 0 };
        if self.has_device_time && told.is_none() {
            self.health.lost_pictures[stream] += 1;
            if clock.untold >= MOST_WITHOUT_TIME {
                tracing::warn!("RealSense: the camera tells no time; the kernel's is used");
                self.has_device_time = false;
                self.depth.drop_metadata();
                self.beside.iter_mut().for_each(Stream::drop_metadata);
                self.rig.sensors.iter_mut().for_each(|s| s.identity.clock = ClockDomain::HostMonotonic);
            }
            return None;
        }
        Some(clock.time_ns(told, shot.buffer.time_ns, other))
    }

    /// Makes frames of the pairs that are ready.
    fn give(&mut self) {
        while let Some(pair) = self.pairing.pop() {
            let time = pair.time_ns();
            let (number, lost) = self.number(time);
            let Pair { depth, color } = pair;
            let (beside_time, left, right) = match color {
                Some((time, (left, right))) => (time, Some(left), right),
                None => (time, None, None),
            };
            let frame = Frame {
                sensor: 0,
                index: self.health.frames,
                device_frame: number,
                lost_before: u32::try_from(lost).unwrap_or(u32::MAX),
                device_time_ns: time,
                host_time_ns: self.host.host_time_ns(time, host_now_ns()),
                depth: depth.map(|(_, image)| Arc::new(image)),
                color: left.map(|image| ColorImage::Rgb(Arc::new(image))),
            };
            self.health.frames += 1;
            let right = right.map(|image| Frame {
                sensor: 1,
                index: frame.index + 1,
                device_time_ns: beside_time,
                depth: None,
                color: Some(ColorImage::Rgb(Arc::new(image))),
                ..frame.clone()
            });
            self.health.frames += u64::from(right.is_some());
            self.ready.push_back(frame);
            self.ready.extend(right);
        }
    }

    /// Number of a frame: how many frame times it is after the one before; and how many were lost between.
    fn number(&mut self, time: i64) -> (u64, u64) {
        let period = 1e9 / f64::from(self.settings.fps.max(1));
        let (number, lost) = match self.last_given {
            None => (0, 0),
            Some((number, last)) => {
                let steps = (((time - last) as f64 / period).round() as u64).max(1);
                (number + steps, steps - 1)
            }
        };
        self.last_given = Some((number, time));
        self.health.lost_frames += lost;
        (number, lost)
    }

    /// After a silence: once more from the start; after the second in a row that is an error.
    fn wake(&mut self) -> Result<(), RealsenseError> {
        if self.frames_at_restart == Some(self.health.frames) {
            return Err(RealsenseError::Silent(self.settings.frame_limit.as_secs_f64()));
        }
        tracing::warn!("RealSense: no frame in time; its streams are switched off and on");
        self.health.restarts += 1;
        self.frames_at_restart = Some(self.health.frames);
        self.pairing.finish();
        self.give();
        self.start()
    }
}

impl Source for Realsense {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        loop {
            if let Some(frame) = self.ready.pop_front() {
                return Ok(Some(frame));
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
                self.give();
                (self.end, self.ended) = (Some(error), true);
            }
        }
    }
}

/// The first camera, or that with this serial number, and what it says it is.
fn choose(video: &dyn Video, serial: Option<&str>) -> Result<(Camera, Details), RealsenseError> {
    let mut why = None;
    for camera in find::list(video)? {
        let Some(nodes) = &camera.depth else {
            why = Some(find::refusal(video, &camera).map_or(RealsenseError::NoNode("depth"), RealsenseError::from));
            continue;
        };
        let asked = video.open(&nodes.pictures).map_err(RealsenseError::from);
        match asked.and_then(|mut node| monitor::ask_details(&mut *node)) {
            Ok(details) if serial.is_none_or(|s| s == details.serial || s == camera.serial) => {
                return Ok((camera, details));
            }
            Ok(_) => {}
            Err(error) => why = Some(error),
        }
    }
    let what =
        serial.map_or("a RealSense camera".to_string(), |s| format!("a RealSense camera with serial number {s}"));
    Err(why.unwrap_or(TransportError::NotFound { what }.into()))
}

/// The camera's 32-bit microseconds (which wrap after 71 minutes) to nanoseconds that do not.
#[derive(Debug, Clone, Copy)]
struct Clock {
    period: i64,
    last: Option<Moment>,
    sequence: Option<u32>,
    /// Pictures in a row whose time was not told.
    untold: u32,
}

/// The camera's time (microseconds), the kernel's and ours (nanoseconds) of a picture.
type Moment = (u32, i64, i64);

/// A step of the camera's clock that is so much longer than the kernel's cannot be, nanoseconds: it began anew, or says
/// nonsense.
const SLACK: i64 = 1_000_000_000;

impl Clock {
    fn new(period: i64) -> Self {
        Self { period, last: None, sequence: None, untold: 0 }
    }

    fn restart(&mut self) {
        self.sequence = None;
    }

    /// Pictures missing by the kernel's numbers.
    fn lost(&mut self, sequence: u32) -> u64 {
        let lost = self.sequence.map_or(0, |last| sequence.wrapping_sub(last).wrapping_sub(1));
        self.sequence = Some(sequence);
        u64::from(lost)
    }

    /// Time of a picture; where none was ever told, from the last one of the `other` stream on, that both are of one clock.
    fn time_ns(&mut self, told: Option<u32>, kernel_ns: i64, other: Option<Moment>) -> i64 {
        let time = match (self.last, told) {
            (None, Some(now)) => i64::from(now) * MICROSECOND,
            (None, None) => other.map_or(kernel_ns, |(_, kernel, time)| time + kernel_ns - kernel),
            (Some((last, kernel, time)), now) => {
                // Where the camera's time is missing or jumps, the kernel's clock tells how long it was.
                let by_kernel = (kernel_ns - kernel).max(self.period / 2);
                let step = now.map(|now| i64::from(now.wrapping_sub(last)) * MICROSECOND);
                time + step.filter(|s| *s > 0 && *s <= by_kernel + SLACK).unwrap_or(by_kernel)
            }
        };
        let passed = |(last, _, before): Moment| last.wrapping_add(((time - before) / MICROSECOND) as u32);
        let told = told.unwrap_or_else(|| self.last.map_or(0, passed));
        self.last = Some((told, kernel_ns, time));
        time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_goes_on_when_it_wraps_and_when_it_is_missing_or_jumps() {
        let mut clock = Clock::new(33_333_333);
        let first = clock.time_ns(Some(u32::MAX - 999), 0, None);
        assert_eq!(clock.time_ns(Some(32_333), 33_000_000, None) - first, 33_333_000);
        let before = clock.time_ns(Some(65_666), 66_000_000, None);
        assert_eq!(clock.time_ns(None, 100_000_000, None) - before, 34_000_000);
        let before = clock.time_ns(Some(132_332), 133_000_000, None);
        // A jump of five seconds, and back.
        assert_eq!(clock.time_ns(Some(5_166_000), 166_000_000, None) - before, 33_000_000);
        assert_eq!(clock.time_ns(Some(199_000), 199_000_000, None) - before, 66_000_000);
        // A long pause that the kernel saw too, and a kernel much slower than the camera.
        let before = clock.time_ns(Some(232_332), 232_000_000, None);
        assert_eq!(clock.time_ns(Some(90_232_332), 90_232_000_000, None) - before, 90_000_000_000);
        assert_eq!(clock.time_ns(Some(90_265_665), 93_000_000_000, None) - before, 90_033_333_000);
    }

    #[test]
    fn a_stream_that_never_told_its_time_starts_from_the_others_clock() {
        let (mut depth, mut color) = (Clock::new(33_333_333), Clock::new(33_333_333));
        let time = depth.time_ns(Some(7_000_000), 100_000_000, None);
        assert_eq!(color.time_ns(None, 110_000_000, depth.last), time + 10_000_000);
        // Where neither does, the kernel's stands in.
        assert_eq!(Clock::new(33_333_333).time_ns(None, 110_000_000, None), 110_000_000);
    }
}
