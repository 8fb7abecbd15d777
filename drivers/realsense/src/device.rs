//! The camera as a source of frames.

use toile_capture::{CaptureError, ClockDomain, Frame, Rig, Source};
use toile_driver_transport::{
    streaming::Streaming,
    video::{FourCc, Video},
};

use crate::{
    Calibration, Camera, Controls, Health, RealsenseError, Settings, VideoMode, choose::choose, rig::rig,
    stream::Stream, streams::PairedStreams,
};

/// A RealSense camera that streams.
///
/// After an unplug all frames that came are given, then one error, then the end.
pub struct Realsense {
    streaming: Streaming<PairedStreams>,
    calibration: Calibration,
    rig: Rig,
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
        let nodes = camera.depth.as_ref().ok_or(RealsenseError::NoNode("depth"))?;
        let size = (settings.size.0, settings.size.1, settings.fps);
        let mut depth = Stream::open(video, nodes, FourCc::Z16, size, settings.buffers)?;
        let beside = open_beside(video, &camera, &settings)?;
        let calibration = Calibration::read(depth.node(), settings.video == VideoMode::Color)?;
        settings.controls.apply(depth.node())?;
        let limit = settings.frame_limit;
        let streams = PairedStreams::start(depth, beside, settings.clone())?;
        let rig = rig(&camera, &details, &calibration, &settings, clock_of(&streams))?;
        Ok(Self { streaming: Streaming::new(streams, limit), calibration, rig })
    }

    /// The camera's own calibration of its lenses.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// How well it went so far.
    pub fn health(&self) -> Health {
        Health { restarts: self.streaming.restarts(), ..self.streaming.streams().health() }
    }

    /// Laser, exposure and preset as they are now.
    ///
    /// # Errors
    /// [`RealsenseError::Transport`].
    pub fn controls(&mut self) -> Result<Controls, RealsenseError> {
        Controls::read(self.streaming.streams_mut().depth.node())
    }
}

impl Source for Realsense {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        let frame = self.streaming.next_frame();
        // A camera that turns out to give no times goes on with the kernel's.
        let clock = clock_of(self.streaming.streams());
        self.rig.sensors.iter_mut().for_each(|sensor| sensor.identity.clock = clock);
        frame.map_err(|error| {
            let device = self.rig.sensors[0].name.clone();
            CaptureError::Device { device, reason: error.to_string() }
        })
    }
}

fn clock_of(streams: &PairedStreams) -> ClockDomain {
    if streams.has_device_time() { ClockDomain::Device } else { ClockDomain::HostMonotonic }
}

/// The stream of colour or infrared; `None` where depth alone is wanted.
fn open_beside(video: &dyn Video, camera: &Camera, settings: &Settings) -> Result<Option<Stream>, RealsenseError> {
    let (nodes, what, format, (width, height)) = match settings.video {
        VideoMode::Color => (&camera.color, "colour", FourCc::YUYV, settings.color_size),
        VideoMode::Infrared => (&camera.infrared, "infrared", FourCc::Y8I, settings.size),
        VideoMode::Off => return Ok(None),
    };
    let nodes = nodes.as_ref().ok_or(RealsenseError::NoNode(what))?;
    Stream::open(video, nodes, format, (width, height, settings.fps), settings.buffers).map(Some)
}
