//! Replay: a recording as a source of frames, by index, the same bytes every time.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use super::{
    container::{Chunk, Container, Outline},
    foreign,
    images::{decode_color, decode_depth},
    index::{Entry, Frames, Location, find_frames},
    loss::Loss,
    metadata,
};
use crate::{CaptureError, Frame, Rig, Source};

/// Numbers and times of one frame of a recording, known without reading its images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameInfo {
    /// Which sensor of the rig, by index.
    pub sensor: usize,
    /// The device's own frame number.
    pub device_frame: u64,
    /// Frames of this sensor lost since the one before.
    pub lost_before: u32,
    /// Device clock, nanoseconds.
    pub device_time_ns: i64,
    /// Host clock, nanoseconds.
    pub host_time_ns: i64,
    /// True when there is depth.
    pub has_depth: bool,
    /// True when there is colour.
    pub has_color: bool,
}

/// A recording, opened for reading.
///
/// Opening reads the file once, chunk by chunk, and checks each chunk's CRC; then each frame is read when it is asked
/// for. A file that ends in the middle (also a `.part`) is read up to its last whole chunk: see [`Self::lost`].
/// Recordings that other programs made are read too, where they hold depth with its calibration in Foxglove's messages.
#[derive(Debug)]
pub struct Replay {
    rig: Rig,
    entries: Vec<Entry>,
    chunks: Vec<Chunk>,
    container: Mutex<Container>,
    path: PathBuf,
    lost: Option<Loss>,
    next: usize,
}

impl Replay {
    /// Opens a recording (also a `.part` that was never finished).
    ///
    /// # Errors
    /// [`CaptureError`] where the file cannot be read, is not MCAP, or holds no frame that can be read.
    pub fn open(path: &Path) -> Result<Self, CaptureError> {
        let mut container = Container::open(path)?;
        let mut outline = container.outline(metadata::NAME)?;
        let (rig, Frames { entries, orphans }) = match outline.metadata.take() {
            Some(content) => (metadata::read_rig(path, &content)?, find_frames(path, &mut container, &mut outline)?),
            None => read_foreign(path, &mut container, &mut outline)?,
        };
        if entries.is_empty() {
            return Err(CaptureError::format(path, why_empty(&outline)));
        }
        if let Some(entry) = entries.iter().find(|entry| entry.stamp.sensor as usize >= rig.sensors.len()) {
            let reason = format!("a frame comes from sensor {}, which the rig does not have", entry.stamp.sensor);
            return Err(CaptureError::format(path, reason));
        }
        let last_index = entries.iter().map(|entry| entry.stamp.frame_index).max();
        let lost = outline.ending.loss(entries.len() as u64, last_index, orphans);
        let (container, path) = (Mutex::new(container), path.to_path_buf());
        Ok(Self { rig, entries, chunks: outline.chunks, container, path, lost, next: 0 })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How many frames can be read.
    pub fn len(&self) -> u64 {
        self.entries.len() as u64
    }

    /// Never true: a recording without frames is not opened.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The losses, where the file is torn or damaged.
    pub fn lost(&self) -> Option<&Loss> {
        self.lost.as_ref()
    }

    /// Numbers and times of frame `index`, without its images; `None` past the end.
    pub fn info(&self, index: u64) -> Option<FrameInfo> {
        let entry = self.entries.get(usize::try_from(index).ok()?)?;
        Some(FrameInfo {
            sensor: entry.stamp.sensor as usize,
            device_frame: entry.stamp.device_frame,
            lost_before: entry.stamp.lost_before,
            device_time_ns: entry.stamp.device_time_ns,
            host_time_ns: entry.stamp.host_time_ns,
            has_depth: entry.depth.is_some(),
            has_color: entry.color.is_some(),
        })
    }

    /// Frame `index`, from 0; any order, from any thread, the same bytes every time.
    ///
    /// # Errors
    /// [`CaptureError`] where there is no such frame or its images are not what the file says.
    pub fn frame(&self, index: u64) -> Result<Frame, CaptureError> {
        let wrong = |reason: String| CaptureError::Frame { index, reason };
        let entry = usize::try_from(index).ok().and_then(|i| self.entries.get(i));
        let entry = entry.ok_or_else(|| wrong(format!("the recording has {} frames", self.entries.len())))?;
        let sensor = &self.rig.sensors[entry.stamp.sensor as usize];
        let size = (sensor.depth.width, sensor.depth.height);
        let depth = match entry.depth {
            Some(location) => {
                let bytes = self.read(location)?;
                Some(Arc::new(decode_depth(location.schema, &bytes, size).map_err(wrong)?))
            }
            None => None,
        };
        let color = match entry.color {
            Some(location) => Some(decode_color(location.schema, &self.read(location)?).map_err(wrong)?),
            None => None,
        };
        Ok(Frame {
            sensor: entry.stamp.sensor as usize,
            index,
            device_frame: entry.stamp.device_frame,
            lost_before: entry.stamp.lost_before,
            device_time_ns: entry.stamp.device_time_ns,
            host_time_ns: entry.stamp.host_time_ns,
            depth,
            color,
        })
    }

    /// The next call to `next_frame` gives frame `index`.
    pub fn seek(&mut self, index: u64) {
        self.next = usize::try_from(index).unwrap_or(usize::MAX);
    }

    fn read(&self, location: Location) -> Result<Vec<u8>, CaptureError> {
        let mut container = self.container.lock().unwrap_or_else(PoisonError::into_inner);
        container.read_in_chunk(&self.chunks[location.chunk], location.start, location.length)
    }
}

impl Source for Replay {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        if self.next >= self.entries.len() {
            return Ok(None);
        }
        self.next += 1;
        self.frame(self.next as u64 - 1).map(Some)
    }

    fn frame_count(&self) -> Option<u64> {
        Some(self.len())
    }
}

/// A recording without our metadata record: of another program, or cut off before it.
fn read_foreign(path: &Path, container: &mut Container, outline: &mut Outline) -> Result<(Rig, Frames), CaptureError> {
    if !outline.ending.closed && outline.chunks.is_empty() {
        return Err(CaptureError::format(path, "was cut off before its rig was written: nothing can be read"));
    }
    let (rig, entries) = foreign::find_frames(path, container, outline)?;
    Ok((rig, Frames { entries, orphans: 0 }))
}

fn why_empty(outline: &Outline) -> &'static str {
    if outline.ending.closed && outline.ending.damaged_chunks == 0 {
        "the recording holds no frames"
    } else {
        "the recording was cut off or damaged in its first chunk: no frame can be read"
    }
}
