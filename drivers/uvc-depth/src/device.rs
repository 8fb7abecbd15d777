//! The camera as a source of frames.

use std::{path::Path, sync::Arc, time::Duration};

use toile_capture::{CaptureError, Frame, Rig, Source, host_now_ns};
use toile_driver_transport::{
    TransportError,
    video::{Video, VideoBuffer, VideoNode},
};

use crate::{UvcDepthError, calibration, decode, decode::Layout, nodes::depth_format, numbering::Numbering};

/// How to stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Buffers that the kernel may fill ahead of us. Default 8: a quarter of a second.
    pub buffers: u32,
    /// After so long without a frame the stream is switched off and on once; after as long again that is an error.
    /// Default 2 s.
    pub frame_limit: Duration,
}

impl Default for Settings {
    fn default() -> Self {
        Self { buffers: 8, frame_limit: Duration::from_secs(2) }
    }
}

/// How well it went so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Health {
    /// Frames given.
    pub frames: u64,
    /// Frames that the driver lost or kept to itself because they were damaged.
    pub lost: u64,
    /// Frames that came and could not be read.
    pub broken: u64,
    /// How often the stream was switched off and on.
    pub restarts: u32,
}

/// A UVC depth camera: depth only, intrinsics from a file.
///
/// After an unplug or a silence there is one error, then the end.
pub struct UvcDepthCamera {
    node: Box<dyn VideoNode>,
    layout: Layout,
    settings: Settings,
    rig: Rig,
    health: Health,
    numbering: Numbering,
    /// No frame came since the stream was switched off and on.
    is_last_try: bool,
    ended: bool,
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
        opened.start(settings.buffers)?;
        Ok(Self {
            node: opened,
            layout: Layout { width, height, stride: given.stride },
            settings,
            rig: Rig { sensors: vec![sensor] },
            health: Health::default(),
            numbering: Numbering::default(),
            is_last_try: false,
            ended: false,
        })
    }

    /// How well it went so far.
    pub fn health(&self) -> Health {
        self.health
    }

    /// The next buffer; after a silence once more from the start.
    fn next_buffer(&mut self) -> Result<VideoBuffer, UvcDepthError> {
        loop {
            match self.node.next_buffer(self.settings.frame_limit) {
                Err(TransportError::TimedOut { .. }) if self.is_last_try => {
                    return Err(UvcDepthError::Silent(self.settings.frame_limit.as_secs_f64()));
                }
                Err(TransportError::TimedOut { .. }) => {
                    self.is_last_try = true;
                    self.numbering.restart();
                    self.health.restarts += 1;
                    self.node.stop();
                    self.node.start(self.settings.buffers)?;
                }
                other => return Ok(other?),
            }
        }
    }

    fn frame(&mut self, buffer: &VideoBuffer) -> Result<Frame, UvcDepthError> {
        let (number, lost) = self.numbering.count(buffer.sequence, buffer.time_ns);
        self.health.lost += lost;
        self.is_last_try = false;
        let depth = decode::depth16(&buffer.bytes, self.layout)?;
        self.health.frames += 1;
        Ok(Frame {
            sensor: 0,
            index: self.health.frames - 1,
            device_frame: number,
            lost_before: u32::try_from(lost).unwrap_or(u32::MAX),
            device_time_ns: buffer.time_ns,
            host_time_ns: host_now_ns(),
            depth: Some(Arc::new(depth)),
            color: None,
        })
    }
}

impl Source for UvcDepthCamera {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        if self.ended {
            return Ok(None);
        }
        let buffer = self.next_buffer().map_err(|error| {
            self.ended = true;
            CaptureError::Device { device: self.rig.sensors[0].name.clone(), reason: error.to_string() }
        })?;
        let frame = self.frame(&buffer).map_err(|error| {
            self.health.broken += 1;
            CaptureError::Frame { index: self.health.frames, reason: error.to_string() }
        })?;
        Ok(Some(frame))
    }
}
