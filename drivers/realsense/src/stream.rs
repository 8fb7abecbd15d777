//! Pictures of one node together with their metadata.

use std::{collections::VecDeque, path::PathBuf, time::Duration};

use toile_capture::pixels::Rows;
use toile_driver_transport::{
    TransportError,
    video::{FourCc, PictureLayout, Video, VideoBuffer, VideoNode},
};

use crate::{
    RealsenseError,
    find::Nodes,
    metadata::{self, Metadata},
};

/// How long the metadata of a picture that is here is waited for: it is written before the picture is done.
const METADATA_LIMIT: Duration = Duration::from_millis(50);
/// Buffers of metadata: more than pictures have, because the kernel fills some for pictures that it drops, and one that
/// finds none free is lost (VIDEO_MAX_FRAME of `linux/videodev2.h`).
const METADATA_BUFFERS: u32 = 32;
/// Metadata that may wait for its picture.
const MAX_WAITING: usize = 64;

/// A picture with what the camera says about it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shot {
    /// The picture.
    pub(crate) buffer: VideoBuffer,
    /// The camera's metadata; empty where the kernel gives no metadata.
    pub(crate) metadata: Metadata,
}

/// A stream of pictures.
pub(crate) struct Stream {
    pictures: Box<dyn VideoNode>,
    /// The node, and whether it has whole headers.
    metadata: Option<(Box<dyn VideoNode>, bool)>,
    waiting: VecDeque<(u32, Metadata)>,
    layout: PictureLayout,
    buffers: u32,
}

impl Stream {
    /// Opens the nodes of a stream and asks for pictures; it is not started yet.
    ///
    /// # Errors
    /// [`RealsenseError::Format`] where it has no such pictures, [`RealsenseError::Transport`].
    pub(crate) fn open(
        video: &dyn Video,
        nodes: &Nodes,
        format: FourCc,
        (width, height, fps): (u32, u32, u32),
        buffers: u32,
    ) -> Result<Self, RealsenseError> {
        let mut pictures = video.open(&nodes.pictures)?;
        let wrong = |given: String| RealsenseError::Format {
            node: PathBuf::from(&nodes.pictures),
            given,
            asked: format!("{format} {width}x{height} at {fps} Hz"),
        };
        let layout = pictures.set_format(format, width, height)?;
        if (layout.format, layout.width, layout.height) != (format, width, height) {
            return Err(wrong(format!("{} {}x{}", layout.format, layout.width, layout.height)));
        }
        let rate = pictures.set_rate(fps)?;
        if (rate - f64::from(fps)).abs() > 0.5 {
            return Err(wrong(format!("{rate:.1} Hz")));
        }
        // Without metadata a camera still works: the kernel's clock stands in for its own.
        let metadata = nodes.metadata.as_ref().and_then(|node| video.open(node).ok()).and_then(|mut node| {
            let is_whole = node.set_format(FourCc::D4XX, 0, 0).ok()?.format == FourCc::D4XX;
            Some((node, is_whole))
        });
        Ok(Self { pictures, metadata, waiting: VecDeque::new(), layout, buffers })
    }

    /// How the rows of its pictures lie in their buffers.
    pub(crate) fn rows(&self) -> Rows {
        let PictureLayout { width, height, stride, .. } = self.layout;
        Rows { width, height, stride }
    }

    /// True where the kernel gives metadata.
    pub(crate) fn has_metadata(&self) -> bool {
        self.metadata.is_some()
    }

    /// Waits for no more metadata.
    pub(crate) fn drop_metadata(&mut self) {
        self.metadata.iter_mut().for_each(|(node, _)| node.stop());
        self.metadata = None;
        self.waiting.clear();
    }

    /// The node of the pictures, which also has the controls.
    pub(crate) fn node(&mut self) -> &mut dyn VideoNode {
        &mut *self.pictures
    }

    /// Starts it, or starts it again.
    ///
    /// # Errors
    /// [`RealsenseError::Transport`].
    pub(crate) fn start(&mut self) -> Result<(), RealsenseError> {
        self.stop();
        self.waiting.clear();
        // Metadata first, so that it has the first picture's too.
        if let Some((metadata, _)) = &mut self.metadata {
            metadata.start(self.buffers.max(METADATA_BUFFERS))?;
        }
        self.pictures.start(self.buffers)?;
        Ok(())
    }

    /// Stops it.
    pub(crate) fn stop(&mut self) {
        self.pictures.stop();
        self.metadata.iter_mut().for_each(|(node, _)| node.stop());
    }

    /// The next picture, or `None` where there is none in time.
    ///
    /// # Errors
    /// [`RealsenseError::Transport`].
    pub(crate) fn next(&mut self, limit: Duration) -> Result<Option<Shot>, RealsenseError> {
        match self.pictures.next_buffer(limit) {
            Ok(buffer) => {
                let metadata = self.metadata_of(buffer.sequence)?;
                Ok(Some(Shot { buffer, metadata }))
            }
            Err(TransportError::TimedOut { .. }) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// The metadata with this number; older ones belong to pictures that were lost.
    fn metadata_of(&mut self, sequence: u32) -> Result<Metadata, RealsenseError> {
        loop {
            while let Some((number, metadata)) = self.waiting.front().copied() {
                // Numbers wrap.
                if number.wrapping_sub(sequence) as i32 > 0 {
                    return Ok(Metadata::default());
                }
                self.waiting.pop_front();
                if number == sequence {
                    return Ok(metadata);
                }
            }
            let Some((node, is_whole)) = &mut self.metadata else { return Ok(Metadata::default()) };
            match node.next_buffer(METADATA_LIMIT) {
                Ok(buffer) => self.waiting.push_back((buffer.sequence, metadata::parse(&buffer.bytes, *is_whole))),
                Err(TransportError::TimedOut { .. }) => return Ok(Metadata::default()),
                Err(error) => return Err(error.into()),
            }
            while self.waiting.len() > MAX_WAITING {
                self.waiting.pop_front();
            }
        }
    }
}
