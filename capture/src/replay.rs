//! Replay: a recording as a source of frames, by index, the same bytes every time.

use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use serde::Serialize;

use crate::{
    CaptureError, ColorImage, DepthImage, Frame, Rig, Source,
    container::{Chunk, Container, Ending, Outline, Record, records},
    depth_codec,
    message::{ImageMessage, Stamp},
    recording::{METADATA, rgb_from_bytes},
    schema::Schema,
};

/// What could not be read of a torn or damaged recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Loss {
    /// Bytes that could not be read: after the last whole chunk, and in damaged ones.
    pub bytes: u64,
    /// Chunks whose checksum does not hold.
    pub damaged_chunks: u32,
    /// Numbers missing between the frames that were read (frames of damaged chunks).
    pub missing_frames: u64,
    /// Images in whole chunks that cannot be told apart, because what declared them was in a damaged chunk.
    pub orphan_images: u64,
    /// True when the file was never closed or is cut off: frames after the last one that was read may be gone.
    pub torn: bool,
    /// Frames that could be read.
    pub frames_read: u64,
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} frames were read", self.frames_read)?;
        match (self.torn, self.damaged_chunks) {
            (true, _) => write!(f, "; the recording was not closed or is cut off")?,
            (false, n) => write!(f, "; {n} chunks are damaged")?,
        }
        if self.missing_frames > 0 {
            write!(f, "; {} frames among them are lost", self.missing_frames)?;
        }
        if self.orphan_images > 0 {
            write!(f, "; {} images cannot be told apart", self.orphan_images)?;
        }
        write!(f, "; {} bytes could not be read", self.bytes)
    }
}

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

#[derive(Debug, Clone, PartialEq)]
struct Entry {
    stamp: Stamp,
    depth: Option<Location>,
    color: Option<Location>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Location {
    schema: Schema,
    chunk: usize,
    start: u64,
    length: u64,
}

impl Replay {
    /// Opens a recording (also a `.part` that was never finished).
    ///
    /// # Errors
    /// [`CaptureError`] where the file cannot be read, is no MCAP, was not written by Toile, or holds no frame.
    pub fn open(path: &Path) -> Result<Self, CaptureError> {
        let mut container = Container::open(path)?;
        let mut outline = container.outline()?;
        let rig = read_rig(path, &outline)?;
        let mut index = Index::new(path);
        index.add_records(0, &outline.summary)?;
        for (number, chunk) in outline.chunks.iter().enumerate() {
            match container.checked_records(chunk) {
                Some(bytes) => index.add_records(number, &bytes)?,
                None => outline.ending.add_damaged(chunk.length),
            }
        }
        let Index { entries, orphans, .. } = index;
        if entries.is_empty() {
            let reason = if outline.ending.closed && outline.ending.damaged_chunks == 0 {
                "the recording holds no frames"
            } else {
                "the recording was cut off or damaged in its first chunk: no frame can be read"
            };
            return Err(CaptureError::format(path, reason));
        }
        if let Some(entry) = entries.iter().find(|entry| entry.stamp.sensor as usize >= rig.sensors.len()) {
            let reason = format!("a frame comes from sensor {}, which the rig does not have", entry.stamp.sensor);
            return Err(CaptureError::format(path, reason));
        }
        let lost = loss(&outline.ending, &entries, orphans);
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

    /// What could not be read, where the file is torn or damaged.
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

/// Collects where each frame's messages stand, while the file is scanned.
struct Index<'a> {
    path: &'a Path,
    /// Every channel that was declared; `None` for those that are not ours.
    channels: BTreeMap<u16, Option<(Schema, bool)>>,
    schemas: BTreeMap<u16, String>,
    entries: Vec<Entry>,
    /// Messages whose channel's declaration is lost.
    orphans: u64,
}

impl<'a> Index<'a> {
    fn new(path: &'a Path) -> Self {
        Self { path, channels: BTreeMap::new(), schemas: BTreeMap::new(), entries: Vec::new(), orphans: 0 }
    }

    fn add_records(&mut self, chunk: usize, bytes: &[u8]) -> Result<(), CaptureError> {
        let records = records(bytes)
            .ok_or_else(|| CaptureError::format(self.path, format!("chunk {chunk} holds no readable records")))?;
        for record in records {
            match record {
                Record::Schema { id, name } => {
                    self.schemas.insert(id, name.to_string());
                }
                Record::Channel { id, schema_id, metadata } => {
                    let schema = self.schemas.get(&schema_id).and_then(|name| Schema::from_name(name));
                    let is_depth = metadata.get("toile.stream").map(|stream| stream == "depth");
                    self.channels.insert(id, schema.zip(is_depth));
                }
                Record::Message { channel_id, start, data } => self.add_message(chunk, channel_id, start, data)?,
            }
        }
        Ok(())
    }

    fn add_message(&mut self, chunk: usize, channel: u16, start: usize, data: &[u8]) -> Result<(), CaptureError> {
        let (schema, is_depth) = match self.channels.get(&channel) {
            Some(Some((Schema::CameraCalibration, _)) | None) => return Ok(()),
            Some(Some(channel)) => *channel,
            None => {
                self.orphans += 1;
                return Ok(());
            }
        };
        let message = ImageMessage::decode(schema, data).ok_or_else(|| {
            CaptureError::format(self.path, format!("an image message in chunk {chunk} is not readable"))
        })?;
        let location = Location { schema, chunk, start: start as u64, length: data.len() as u64 };
        let same = |entry: &&mut Entry| entry.stamp.frame_index == message.stamp.frame_index;
        let entry = match self.entries.last_mut().filter(same) {
            Some(entry) => entry,
            None => {
                self.entries.push(Entry { stamp: message.stamp, depth: None, color: None });
                let last = self.entries.len() - 1;
                &mut self.entries[last]
            }
        };
        *if is_depth { &mut entry.depth } else { &mut entry.color } = Some(location);
        Ok(())
    }
}

fn read_rig(path: &Path, outline: &Outline) -> Result<Rig, CaptureError> {
    let Some(metadata) = outline.metadata.get(METADATA) else {
        let reason = if outline.ending.closed || !outline.chunks.is_empty() {
            "is an MCAP file, but no recording of Toile's (there is no metadata record `toile.recording` in it)"
        } else {
            "was cut off before its rig was written: nothing can be read"
        };
        return Err(CaptureError::format(path, reason));
    };
    let rig = metadata.get("rig").map_or("", String::as_str);
    let rig: Rig = serde_json::from_str(rig).map_err(|error| {
        CaptureError::format(path, format!("the rig in `toile.recording` is not readable: {error}"))
    })?;
    let usable = |sensor: &crate::Sensor| sensor.depth.is_valid() && sensor.depth_scale > 0.0;
    if rig.sensors.iter().all(usable) {
        Ok(rig)
    } else {
        Err(CaptureError::format(path, "the calibration in `toile.recording` is not usable"))
    }
}

fn loss(ending: &Ending, entries: &[Entry], orphans: u64) -> Option<Loss> {
    if ending.closed && ending.damaged_chunks == 0 && orphans == 0 {
        return None;
    }
    let numbers = entries.iter().map(|entry| entry.stamp.frame_index);
    let expected = numbers.max().map_or(0, |last| last.saturating_add(1));
    Some(Loss {
        bytes: ending.torn_bytes + ending.damaged_bytes,
        damaged_chunks: ending.damaged_chunks,
        missing_frames: expected.saturating_sub(entries.len() as u64),
        orphan_images: orphans,
        torn: !ending.closed,
        frames_read: entries.len() as u64,
    })
}

fn decode_depth(schema: Schema, bytes: &[u8], size: (u32, u32)) -> Result<DepthImage, String> {
    let message = ImageMessage::decode(schema, bytes).ok_or("its depth message is not readable")?;
    let (width, height) = match schema {
        Schema::CompressedDepth => depth_codec::size(message.data).map_err(|error| error.to_string())?,
        _ => (message.width, message.height),
    };
    if (width, height) != size {
        return Err(format!("the depth has {width} x {height} pixels, the calibration says {} x {}", size.0, size.1));
    }
    match (schema, message.format) {
        (Schema::CompressedDepth, depth_codec::NAME) => {
            depth_codec::decode(message.data).map_err(|error| error.to_string())
        }
        (Schema::RawImage, "16UC1" | "mono16")
            if message.data.len() as u64 == 2 * u64::from(width) * u64::from(height) =>
        {
            let values = message.data.as_chunks::<2>().0.iter().map(|&pair| u16::from_le_bytes(pair)).collect();
            Ok(DepthImage { width, height, values })
        }
        (_, format) => Err(format!("depth in the format `{format}` cannot be read")),
    }
}

fn decode_color(schema: Schema, bytes: &[u8]) -> Result<ColorImage, String> {
    let message = ImageMessage::decode(schema, bytes).ok_or("its colour message is not readable")?;
    let image = match (schema, message.format) {
        (Schema::CompressedImage, "jpeg") => Some(ColorImage::Jpeg(message.data.into())),
        (Schema::CompressedImage, "png") => Some(ColorImage::Png(message.data.into())),
        (Schema::RawImage, "rgb8") => rgb_from_bytes(message.width, message.height, message.data),
        _ => None,
    };
    image.ok_or_else(|| format!("colour in the format `{}` cannot be read", message.format))
}
