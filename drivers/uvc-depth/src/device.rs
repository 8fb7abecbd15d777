//! The camera as a source of frames.

use std::path::Path;

use toile_capture::{CaptureError, Frame, Rig, Source, pixels::Rows};
use toile_driver_transport::{streaming::Streaming, video::Video};

use crate::{Health, Settings, UvcDepthError, calibration, nodes::depth_format, stream::DepthStream};

/// A UVC depth camera: depth only, intrinsics from a file.
///
/// After an unplug or a silence there is one error, then the end.
pub struct UvcDepthCamera {
    streaming: Streaming<DepthStream>,
    rig: Rig,
}

impl UvcDepthCamera {
    /// Opens the camera at `node` (such as `/dev/video2`) with the intrinsics of `calibration_file`, and starts it.
    ///
    /// # Errors
    /// [`UvcDepthError`] where the file or the node cannot be used.
    pub fn open(
        video: &dyn Video,
        node: &Path,
        calibration_file: &Path,
        settings: Settings,
    ) -> Result<Self, UvcDepthError> {
        let sensor = calibration::read(calibration_file)?;
        let (width, height) = (sensor.depth.width, sensor.depth.height);
        let mut opened = video.open(node)?;
        let offered = opened.formats()?;
        let format = depth_format(&offered).ok_or_else(|| UvcDepthError::Format {
            node: node.to_path_buf(),
            offered: offered.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        })?;
        let given = opened.set_format(format, width, height)?;
        if (given.format, given.width, given.height) != (format, width, height) {
            let what = format!(
                "it describes {width}x{height} but the camera streams {} {}x{}",
                given.format, given.width, given.height
            );
            return Err(UvcDepthError::Calibration { path: calibration_file.to_path_buf(), reason: what });
        }
        let stream = DepthStream::start(opened, Rows { width, height, stride: given.stride }, settings)?;
        Ok(Self { streaming: Streaming::new(stream, settings.frame_limit), rig: Rig { sensors: vec![sensor] } })
    }

    /// How well it went so far.
    pub fn health(&self) -> Health {
        Health { restarts: self.streaming.restarts(), ..self.streaming.streams().health() }
    }
}

impl Source for UvcDepthCamera {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        self.streaming.next_frame().map_err(|error| {
            let reason = error.to_string();
            match error {
                // The frames after it may be whole.
                UvcDepthError::Pixels(_) => CaptureError::Frame { index: self.health().frames, reason },
                _ => CaptureError::Device { device: self.rig.sensors[0].name.clone(), reason },
            }
        })
    }
}
