//! Writing a recording.

use std::{
    collections::BTreeMap,
    fs::{self, File, TryLockError},
    io::BufWriter,
    path::{Path, PathBuf},
};

use mcap::{
    records::MessageHeader,
    write::{Metadata, NoSeek, WriteOptions, Writer},
};

use super::{
    depth_codec,
    message::{ImageMessage, Stamp, encode_calibration},
    metadata::{self, check_rig},
    options::{DepthEncoding, RecorderOptions, RecordingSummary},
    schema::Schema,
    stream::Stream,
};
use crate::{
    CaptureError, ColorImage, DepthImage, Frame, RgbImage, Rig,
    files::{claim, create_parent, is_there, open_regular, part_path, sync_parent, with_suffix},
};

/// Writes a recording. It grows as `FILE.part` and becomes `FILE` in [`Self::finish`]; dropped before, the `.part` stays
/// and can be replayed up to its last whole chunk.
pub struct Recorder {
    path: PathBuf,
    part: PathBuf,
    rig: Rig,
    options: RecorderOptions,
    writer: Writer<NoSeek<BufWriter<File>>>,
    file: File,
    channels: BTreeMap<(usize, Stream), u16>,
    frames: u64,
    pending: usize,
    kept: Option<PathBuf>,
    is_finished: bool,
}

impl Recorder {
    /// Starts a recording that will be `path`.
    ///
    /// # Errors
    /// [`CaptureError`] where `path` exists already, the rig is unusable or the file cannot be written.
    pub fn create(path: &Path, rig: &Rig, options: RecorderOptions) -> Result<Self, CaptureError> {
        check_rig(path, rig)?;
        if path.exists() {
            return Err(CaptureError::format(path, "the recording exists already; recordings are never overwritten"));
        }
        create_parent(path)?;
        let part = part_path(path);
        let kept = if options.replace_part { None } else { keep_part(&part)? };
        let file = claim(&part).map_err(|error| CaptureError::io(&part, error))?;
        let file = file.ok_or_else(|| CaptureError::Busy { path: path.to_path_buf() })?;
        let twin = file.try_clone().map_err(|error| CaptureError::io(&part, error))?;
        let writer = start_writer(file, rig, options.depth).map_err(|error| mcap_error(&part, error))?;
        let (path, rig, channels) = (path.to_path_buf(), rig.clone(), BTreeMap::new());
        let (file, is_finished) = (twin, false);
        Ok(Self { path, part, rig, options, writer, file, channels, frames: 0, pending: 0, kept, is_finished })
    }

    /// The rig that is recorded.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Frames written so far.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Appends a frame; `frame.index` is not kept (frames are numbered in the order they are written).
    ///
    /// # Errors
    /// [`CaptureError::Frame`] where the frame does not fit the rig (nothing is written then); [`CaptureError::DiskFull`]
    /// and [`CaptureError::Io`] where it cannot be written.
    pub fn write(&mut self, frame: &Frame) -> Result<(), CaptureError> {
        self.check(frame)?;
        let depth = frame.depth.as_deref().map(|depth| self.encode_depth(depth)).transpose()?;
        if self.frames == 0 {
            self.write_calibrations(frame.device_time_ns, frame.host_time_ns)?;
        }
        if let (Some(image), Some((schema, format, data))) = (&frame.depth, &depth) {
            let name = self.camera_name(frame.sensor, Stream::Depth);
            let size = [image.width, image.height, 2 * image.width];
            let bytes = self.message(frame, *schema, (&name, format), size, data).encode(*schema);
            self.append(Stream::Depth, *schema, frame, &bytes)?;
        }
        if let Some(color) = &frame.color {
            self.write_color(frame, color)?;
        }
        self.frames += 1;
        if self.pending >= self.options.chunk_bytes { self.close_chunk() } else { Ok(()) }
    }

    /// The file that grows until [`Self::finish`].
    pub fn part_path(&self) -> &Path {
        &self.part
    }

    /// Where the `.part` of an earlier, interrupted run was moved to, where there was one.
    pub fn kept_part(&self) -> Option<&Path> {
        self.kept.as_deref()
    }

    /// Closes the file, syncs it and gives it its final name.
    ///
    /// # Errors
    /// [`CaptureError`] where that fails; the `.part` stays.
    pub fn finish(mut self) -> Result<RecordingSummary, CaptureError> {
        self.writer.finish().map_err(|error| mcap_error(&self.part, error))?;
        self.file.sync_all().map_err(|error| CaptureError::io(&self.part, error))?;
        let bytes = self.file.metadata().map_err(|error| CaptureError::io(&self.part, error))?.len();
        fs::rename(&self.part, &self.path).map_err(|error| CaptureError::io(&self.path, error))?;
        self.is_finished = true;
        sync_parent(&self.path)?;
        Ok(RecordingSummary { path: self.path.clone(), frames: self.frames, bytes })
    }

    fn check(&self, frame: &Frame) -> Result<(), CaptureError> {
        let wrong = |reason: String| Err(CaptureError::Frame { index: frame.index, reason });
        let Some(sensor) = self.rig.sensors.get(frame.sensor) else {
            return wrong(format!("sensor {} is not in the rig of {}", frame.sensor, self.rig.sensors.len()));
        };
        if frame.depth.is_none() && frame.color.is_none() {
            return wrong("there is neither depth nor colour in it".to_string());
        }
        let (width, height) = (sensor.depth.width, sensor.depth.height);
        match &frame.depth {
            Some(depth) if (depth.width, depth.height) != (width, height) => wrong(format!(
                "the depth has {} x {} pixels, the calibration of {} says {width} x {height}",
                depth.width, depth.height, sensor.name
            )),
            _ => Ok(()),
        }
    }

    fn encode_depth(&self, depth: &DepthImage) -> Result<(Schema, &'static str, Vec<u8>), CaptureError> {
        match self.options.depth {
            DepthEncoding::Raw => {
                let data = depth.values.iter().flat_map(|value| value.to_le_bytes()).collect();
                Ok((Schema::RawImage, "16UC1", data))
            }
            DepthEncoding::Packed => {
                let data = depth_codec::encode(depth)
                    .map_err(|error| CaptureError::Frame { index: self.frames, reason: error.to_string() })?;
                Ok((Schema::CompressedDepth, depth_codec::NAME, data))
            }
        }
    }

    fn write_color(&mut self, frame: &Frame, color: &ColorImage) -> Result<(), CaptureError> {
        let name = self.camera_name(frame.sensor, Stream::Color);
        match color {
            ColorImage::Jpeg(data) | ColorImage::Png(data) => {
                let format = if matches!(color, ColorImage::Jpeg(_)) { "jpeg" } else { "png" };
                let schema = Schema::CompressedImage;
                let bytes = self.message(frame, schema, (&name, format), [0; 3], data).encode(schema);
                self.append(Stream::Color, schema, frame, &bytes)
            }
            ColorImage::Rgb(image) => {
                let RgbImage { width, height, pixels } = image.as_ref();
                let size = [*width, *height, 3 * width];
                let message = self.message(frame, Schema::RawImage, (&name, "rgb8"), size, pixels.as_flattened());
                let bytes = message.encode(Schema::RawImage);
                self.append(Stream::RawColor, Schema::RawImage, frame, &bytes)
            }
        }
    }

    /// The message of one image. Only raw ones say their size: columns, rows, bytes a row.
    fn message<'a>(
        &self,
        frame: &Frame,
        schema: Schema,
        (frame_id, format): (&'a str, &'a str),
        size: [u32; 3],
        data: &'a [u8],
    ) -> ImageMessage<'a> {
        let stamp = Stamp {
            frame_index: self.frames,
            sensor: frame.sensor as u32,
            device_frame: frame.device_frame,
            lost_before: frame.lost_before,
            device_time_ns: frame.device_time_ns,
            host_time_ns: frame.host_time_ns,
        };
        let [width, height, step] = if schema == Schema::RawImage { size } else { [0; 3] };
        let time_ns = Some(frame.device_time_ns);
        ImageMessage { stamp: Some(stamp), time_ns, frame_id, format, width, height, step, data }
    }

    fn write_calibrations(&mut self, device_time_ns: i64, host_time_ns: i64) -> Result<(), CaptureError> {
        let cameras: Vec<_> = self.rig.sensors.iter().map(|sensor| (sensor.depth, sensor.color)).collect();
        for (sensor, (depth, color)) in cameras.into_iter().enumerate() {
            let frame = Frame {
                sensor,
                index: 0,
                device_frame: 0,
                lost_before: 0,
                device_time_ns,
                host_time_ns,
                depth: None,
                color: None,
            };
            let streams = [(Stream::DepthCalibration, Some(depth)), (Stream::ColorCalibration, color)];
            for (stream, camera) in streams {
                let Some(camera) = camera else { continue };
                let bytes = encode_calibration(&camera, &self.camera_name(sensor, stream), device_time_ns);
                self.append(stream, Schema::CameraCalibration, &frame, &bytes)?;
            }
        }
        Ok(())
    }

    fn camera_name(&self, sensor: usize, stream: Stream) -> String {
        format!("{}/{}", self.rig.sensors[sensor].name, stream.role())
    }

    fn append(&mut self, stream: Stream, schema: Schema, frame: &Frame, data: &[u8]) -> Result<(), CaptureError> {
        let channel_id = self.channel(frame.sensor, stream, schema)?;
        let header = MessageHeader {
            channel_id,
            sequence: frame.device_frame as u32,
            log_time: u64::try_from(frame.host_time_ns).unwrap_or(0),
            publish_time: u64::try_from(frame.device_time_ns).unwrap_or(0),
        };
        self.pending += data.len();
        self.writer.write_to_known_channel(&header, data).map_err(|error| mcap_error(&self.part, error))
    }

    fn channel(&mut self, sensor: usize, stream: Stream, schema: Schema) -> Result<u16, CaptureError> {
        if let Some(&id) = self.channels.get(&(sensor, stream)) {
            return Ok(id);
        }
        let topic = format!("/{}/{}", self.rig.sensors[sensor].name, stream.topic());
        let about = BTreeMap::from([
            ("toile.sensor".to_string(), sensor.to_string()),
            ("toile.stream".to_string(), stream.role().to_string()),
        ]);
        let id = self
            .writer
            .add_schema(schema.name(), "protobuf", &schema.descriptor())
            .and_then(|schema| self.writer.add_channel(schema, &topic, "protobuf", &about))
            .map_err(|error| mcap_error(&self.part, error))?;
        self.channels.insert((sensor, stream), id);
        Ok(id)
    }

    fn close_chunk(&mut self) -> Result<(), CaptureError> {
        self.pending = 0;
        self.writer.flush().map_err(|error| mcap_error(&self.part, error))?;
        self.file.sync_data().map_err(|error| CaptureError::io(&self.part, error))
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if self.options.replace_part && !self.is_finished {
            // A failure here leaves a file that the next run removes.
            let _ = fs::remove_file(&self.part);
        }
    }
}

/// Moves what an interrupted run recorded out of the way, and says where to.
fn keep_part(part: &Path) -> Result<Option<PathBuf>, CaptureError> {
    let is_recording = fs::symlink_metadata(part).is_ok_and(|found| found.is_file());
    if !is_recording || is_in_use(part) {
        return Ok(None);
    }
    let kept = (1_u32..).map(|n| with_suffix(part, &format!(".{n}"))).find(|kept| !is_there(kept));
    let kept = kept.unwrap_or_else(|| with_suffix(part, ".kept"));
    fs::rename(part, &kept).map_err(|error| CaptureError::io(part, error))?;
    Ok(Some(kept))
}

/// True while another process records into a file.
fn is_in_use(part: &Path) -> bool {
    open_regular(part).is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
}

type McapWriter = Writer<NoSeek<BufWriter<File>>>;

fn start_writer(file: File, rig: &Rig, depth: DepthEncoding) -> Result<McapWriter, mcap::McapError> {
    let mut writer = WriteOptions::new()
        .compression(None)
        .chunk_size(None)
        .disable_seeking(true)
        .library(concat!("toile ", env!("CARGO_PKG_VERSION")))
        .create(NoSeek::new(BufWriter::new(file)))?;
    let content = metadata::content(rig, depth).map_err(|error| mcap::McapError::Io(std::io::Error::other(error)))?;
    writer.write_metadata(&Metadata { name: metadata::NAME.to_string(), metadata: content })?;
    Ok(writer)
}

fn mcap_error(path: &Path, error: mcap::McapError) -> CaptureError {
    match error {
        mcap::McapError::Io(error) => CaptureError::io(path, error),
        other => CaptureError::format(path, other.to_string()),
    }
}
