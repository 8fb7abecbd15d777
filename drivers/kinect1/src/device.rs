//! The camera as a source of frames.

use toile_capture::{CaptureError, Frame, Rig, Source};
use toile_driver_transport::{Bus, choose, streaming::Streaming};

use crate::{
    Calibration, Health, Kinect1Error, Settings,
    commands::Commands,
    find::{KINECT_FOR_WINDOWS, list},
    registration::Registration,
    rig::rig,
    streams::Kinect1Streams,
};

/// A Kinect that streams.
///
/// After an unplug all frames that came are given, then one error, then the end.
pub struct Kinect1 {
    streaming: Streaming<Kinect1Streams>,
    calibration: Calibration,
    rig: Rig,
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
        let streaming = Kinect1Streams::start(device, commands, &calibration, settings)?;
        let rig = rig(&info, serial, &streaming.streams().registration, &streaming.streams().settings);
        Ok(Self { streaming, calibration, rig })
    }

    /// The camera's own calibration.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Where depth goes in the colour image.
    pub fn registration(&self) -> &Registration {
        &self.streaming.streams().registration
    }

    /// How well it went so far.
    pub fn health(&self) -> Health {
        Health { restarts: self.streaming.restarts(), ..self.streaming.streams().health() }
    }
}

impl Source for Kinect1 {
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
