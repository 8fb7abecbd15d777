//! Pictures of both streams to frames: decoded, with the camera's time, paired.

use std::{collections::VecDeque, sync::Arc, time::Duration};

use toile_capture::{
    ClockFit, ColorImage, DepthImage, Frame, RgbImage, host_now_ns,
    pairing::{Pair, Pairing},
    pixels::{self, PixelError},
};
use toile_driver_transport::streaming::{Numbering, Progress, Streams};

use crate::{
    Health, RealsenseError, Settings, VideoMode,
    clock::Clock,
    decode::infrared_pair,
    stream::{Shot, Stream},
};

/// How long one stream is waited for before the other is looked at.
const TURN: Duration = Duration::from_millis(5);
/// This many pictures of a stream in a row without a time mean that there will be none.
const MAX_WITHOUT_TIME: u32 = 10;

/// The images beside depth: one image, or left and right.
type Beside = (RgbImage, Option<RgbImage>);

/// Depth, and colour or infrared beside it, of an open camera.
pub(crate) struct PairedStreams {
    pub(crate) depth: Stream,
    beside: Option<Stream>,
    settings: Settings,
    /// Both streams have the camera's own time.
    has_device_time: bool,
    clocks: [Clock; 2],
    host: ClockFit,
    pairing: Pairing<DepthImage, Beside>,
    ready: VecDeque<Frame>,
    numbering: Numbering,
    health: Health,
}

impl PairedStreams {
    /// Starts both streams.
    pub(crate) fn start(depth: Stream, beside: Option<Stream>, settings: Settings) -> Result<Self, RealsenseError> {
        let period = 1_000_000_000 / i64::from(settings.fps.max(1));
        let has_device_time = depth.has_metadata() && beside.as_ref().is_none_or(Stream::has_metadata);
        let mut streams = Self {
            depth,
            beside,
            has_device_time,
            clocks: [Clock::new(period); 2],
            host: ClockFit::default(),
            pairing: Pairing::new(period / 2),
            ready: VecDeque::new(),
            numbering: Numbering::new(1e9 / f64::from(settings.fps.max(1))),
            settings,
            health: Health::default(),
        };
        streams.switch_on()?;
        Ok(streams)
    }

    /// How well it went so far, restarts left out.
    pub(crate) fn health(&self) -> Health {
        Health { alone: self.pairing.alone(), ..self.health }
    }

    /// False where times are the kernel's.
    pub(crate) fn has_device_time(&self) -> bool {
        self.has_device_time
    }

    fn switch_on(&mut self) -> Result<(), RealsenseError> {
        self.depth.start()?;
        if let Some(beside) = &mut self.beside {
            beside.start()?;
        }
        self.clocks.iter_mut().for_each(Clock::restart);
        Ok(())
    }

    fn push_depth(&mut self, shot: &Shot) {
        let Some(time) = self.time(0, shot) else { return };
        match pixels::depth16(&shot.buffer.bytes, self.depth.rows()) {
            Ok(image) => self.pairing.push_depth(time, image),
            Err(reason) => self.count_broken("depth", &reason),
        }
        if self.beside.is_none() {
            self.pairing.finish();
        }
        self.make_frames();
    }

    fn push_beside(&mut self, shot: &Shot) {
        let Some(time) = self.time(1, shot) else { return };
        let Some(rows) = self.beside.as_ref().map(Stream::rows) else { return };
        let decoded = match self.settings.video {
            VideoMode::Infrared => infrared_pair(&shot.buffer.bytes, rows).map(|[l, r]| (l, Some(r))),
            _ => pixels::yuyv(&shot.buffer.bytes, rows).map(|image| (image, None)),
        };
        match decoded {
            Ok(images) => self.pairing.push_color(time, images),
            Err(reason) => self.count_broken("colour", &reason),
        }
        self.make_frames();
    }

    fn count_broken(&mut self, what: &str, reason: &PixelError) {
        self.health.broken += 1;
        tracing::warn!("RealSense: a {what} picture cannot be read: {reason}");
    }

    /// Time of a picture by the camera's clock, or by the kernel's where there is no metadata at all. `None` where it is
    /// not stated: a guess could pair depth with the colour of another moment, so that picture is a lost one.
    fn time(&mut self, stream: usize, shot: &Shot) -> Option<i64> {
        let other = self.clocks[1 - stream].last;
        let clock = &mut self.clocks[stream];
        self.health.lost_pictures[stream] += clock.lost(shot.buffer.sequence);
        let stated = if self.has_device_time { shot.metadata.time_us } else { None };
        self.health.without_time += u64::from(stated.is_none());
        clock.without_time = if stated.is_none() { clock.without_time + 1 } else { 0 };
        if self.has_device_time && stated.is_none() {
            self.health.lost_pictures[stream] += 1;
            if clock.without_time >= MAX_WITHOUT_TIME {
                tracing::warn!("RealSense: the camera states no time; the kernel's is used");
                self.has_device_time = false;
                self.depth.drop_metadata();
                self.beside.iter_mut().for_each(Stream::drop_metadata);
            }
            return None;
        }
        Some(clock.time_ns(stated, shot.buffer.time_ns, other))
    }

    /// Makes frames of the pairs that are ready.
    fn make_frames(&mut self) {
        while let Some(pair) = self.pairing.pop() {
            let time = pair.time_ns();
            let (number, lost) = self.numbering.count(time, None);
            self.health.lost_frames += lost;
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
            let right = right.map(|image| right_frame(&frame, beside_time, image));
            self.health.frames += 1 + u64::from(right.is_some());
            self.ready.push_back(frame);
            self.ready.extend(right);
        }
    }
}

impl Streams for PairedStreams {
    type Frame = Frame;
    type Error = RealsenseError;

    fn pop(&mut self) -> Option<Result<Frame, RealsenseError>> {
        self.ready.pop_front().map(Ok)
    }

    /// Takes what came, each stream in its turn.
    fn step(&mut self) -> Result<Progress, RealsenseError> {
        let mut progress = Progress::Silence(if self.beside.is_some() { 2 * TURN } else { TURN });
        if let Some(shot) = self.depth.next(TURN)? {
            progress = Progress::Picture;
            self.push_depth(&shot);
        }
        if let Some(beside) = &mut self.beside
            && let Some(shot) = beside.next(TURN)?
        {
            progress = Progress::Picture;
            self.push_beside(&shot);
        }
        Ok(progress)
    }

    fn restart(&mut self) -> Result<(), RealsenseError> {
        self.finish();
        self.switch_on()
    }

    fn finish(&mut self) {
        self.pairing.finish();
        self.make_frames();
    }

    fn silent(limit: Duration) -> RealsenseError {
        RealsenseError::Silent(limit.as_secs_f64())
    }
}

/// The right infrared image, which is a sensor of its own beside the left one's frame.
fn right_frame(left: &Frame, time_ns: i64, image: RgbImage) -> Frame {
    Frame {
        sensor: 1,
        index: left.index + 1,
        device_time_ns: time_ns,
        depth: None,
        color: Some(ColorImage::Rgb(Arc::new(image))),
        ..left.clone()
    }
}
