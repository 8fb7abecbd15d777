//! The camera as a source of frames.

use toile_capture::{CaptureError, Frame, Rig, Source};
use toile_driver_transport::{Bus, LinkSpeed, choose, streaming::Streaming};

use crate::{
    Calibration, Health, Kinect2Error, Settings, commands::Commands, find::list, registration::Registration, rig::rig,
    streams::Kinect2Streams,
};

/// A Kinect that streams.
///
/// After an unplug all frames that came are given, then one error, then the end.
pub struct Kinect2 {
    streaming: Streaming<Kinect2Streams>,
    calibration: Calibration,
    rig: Rig,
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
        let mode = settings.color;
        let streaming = Kinect2Streams::start(device, commands, &calibration, settings)?;
        let rig = rig(identity, &calibration, &streaming.streams().registration, mode);
        Ok(Self { streaming, calibration, rig })
    }

    /// The camera's own calibration.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Where depth is in the colour image.
    pub fn registration(&self) -> &Registration {
        &self.streaming.streams().registration
    }

    /// How well it went so far.
    pub fn health(&self) -> Health {
        Health { restarts: self.streaming.restarts(), ..self.streaming.streams().health() }
    }
}

impl Source for Kinect2 {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        self.streaming.next_frame().map_err(|error| {
            let device = self.rig.sensors[0].name.clone();
            CaptureError::Device { device, reason: error.to_string() }
        })
    }
}
