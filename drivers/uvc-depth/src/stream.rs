//! Buffers of the depth node to frames.

use std::{sync::Arc, time::Duration};

use toile_capture::{
    Frame, host_now_ns,
    pixels::{Rows, depth16},
};
use toile_driver_transport::{
    TransportError,
    streaming::{Progress, Streams},
    video::{VideoBuffer, VideoNode},
};

use crate::{Health, Settings, UvcDepthError, numbering::Numbering};

/// The depth of an open camera.
pub(crate) struct DepthStream {
    node: Box<dyn VideoNode>,
    rows: Rows,
    settings: Settings,
    numbering: Numbering,
    ready: Option<VideoBuffer>,
    health: Health,
}

impl DepthStream {
    /// Starts a node whose format is set.
    pub(crate) fn start(node: Box<dyn VideoNode>, rows: Rows, settings: Settings) -> Result<Self, UvcDepthError> {
        let (numbering, health) = (Numbering::default(), Health::default());
        let mut stream = Self { node, rows, settings, numbering, ready: None, health };
        stream.node.start(settings.buffers)?;
        Ok(stream)
    }

    /// How well it went so far, restarts left out.
    pub(crate) fn health(&self) -> Health {
        self.health
    }

    fn frame(&mut self, buffer: &VideoBuffer) -> Result<Frame, UvcDepthError> {
        let (number, lost) = self.numbering.count(buffer.sequence, buffer.time_ns);
        self.health.lost += lost;
        let depth = depth16(&buffer.bytes, self.rows).inspect_err(|_| self.health.broken += 1)?;
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

impl Streams for DepthStream {
    type Frame = Frame;
    type Error = UvcDepthError;

    fn pop(&mut self) -> Option<Result<Frame, UvcDepthError>> {
        let buffer = self.ready.take()?;
        Some(self.frame(&buffer))
    }

    fn step(&mut self) -> Result<Progress, UvcDepthError> {
        match self.node.next_buffer(self.settings.frame_limit) {
            Ok(buffer) => self.ready = Some(buffer),
            Err(TransportError::TimedOut { .. }) => return Ok(Progress::TimedOut),
            Err(other) => return Err(other.into()),
        }
        Ok(Progress::Picture)
    }

    fn restart(&mut self) -> Result<(), UvcDepthError> {
        self.numbering.restart();
        self.node.stop();
        Ok(self.node.start(self.settings.buffers)?)
    }

    fn finish(&mut self) {}

    fn silent(limit: Duration) -> UvcDepthError {
        UvcDepthError::Silent(limit.as_secs_f64())
    }
}
