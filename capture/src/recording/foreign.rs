//! Recordings of other programs: depth, colour and calibration in Foxglove's messages (Protocol Buffers), without our
//! metadata record.
//!
//! One depth topic is read as one sensor: `foxglove.RawImage` with `16UC1` (or `mono16`), or `foxglove.CompressedImage`
//! with a 16-bit PNG; both are millimetres, as is the custom for these encodings. Its `foxglove.CameraCalibration` is the
//! one with the same `frame_id`, else the one whose topic has the most in common. Colour must be registered to depth; it
//! pairs by time.

use std::{collections::BTreeMap, path::Path};

use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{
    container::{Container, Outline},
    index::{Entry, Location},
    message::{ImageMessage, Stamp, decode_calibration},
    records::Record,
    scan::{MAX_FRAMES, for_each_record},
    schema::Schema,
};
use crate::{CaptureError, DeviceIdentity, Rig, Sensor, associate::associate, encoded};

/// Metres a depth unit of `16UC1` images.
const DEPTH_SCALE: f64 = 0.001;
/// Depth and colour further apart than this do not belong together: two thirds of a frame at 30 a second.
const MAX_APART_NS: i64 = 20_000_000;

/// The rig and the frames of a recording that another program made.
///
/// # Errors
/// [`CaptureError`] that says what is missing, and which messages are there.
pub(super) fn find_frames(
    path: &Path,
    container: &mut Container,
    outline: &mut Outline,
) -> Result<(Rig, Vec<Entry>), CaptureError> {
    let mut survey = Survey::default();
    for_each_record(container, outline, |chunk, record| {
        survey.add(chunk, &record).map_err(|reason| CaptureError::format(path, reason))
    })?;
    survey.frames().map_err(|reason| CaptureError::format(path, reason))
}

/// Everything of use in the file.
#[derive(Default)]
struct Survey {
    schemas: BTreeMap<u16, (Option<Schema>, String)>,
    channels: BTreeMap<u16, Channel>,
    images: BTreeMap<u16, Images>,
    calibrations: BTreeMap<u16, (PinholeCamera, String)>,
    count: usize,
}

struct Channel {
    topic: String,
    schema: Option<Schema>,
}

/// The images of one topic.
struct Images {
    is_depth: bool,
    size: (u32, u32),
    frame_id: String,
    list: Vec<(i64, Location)>,
}

impl Survey {
    fn add(&mut self, chunk: usize, record: &Record) -> Result<(), String> {
        match *record {
            Record::Schema { id, name } => {
                let shown = name.chars().take(80).collect();
                self.schemas.insert(id, (Schema::from_name(name), shown));
            }
            Record::Channel { id, schema_id, topic, encoding, .. } => {
                let schema = self.schemas.get(&schema_id).and_then(|(schema, _)| *schema);
                let schema = schema.filter(|schema| encoding == "protobuf" && *schema != Schema::CompressedDepth);
                self.channels.insert(id, Channel { topic: topic.chars().take(200).collect(), schema });
            }
            Record::Message { channel_id, log_time, start, data } => {
                let Some(schema) = self.channels.get(&channel_id).and_then(|channel| channel.schema) else {
                    return Ok(());
                };
                let location = Location { schema, chunk, start, length: data.len() as u64 };
                return self.add_message(channel_id, log_time, location, data);
            }
            Record::Other => {}
        }
        Ok(())
    }

    fn add_message(&mut self, id: u16, log_time: u64, location: Location, data: &[u8]) -> Result<(), String> {
        let topic = || format!("a message of the topic `{}`", self.channels[&id].topic);
        if location.schema == Schema::CameraCalibration {
            let calibration = decode_calibration(data).ok_or_else(|| {
                format!(
                    "{} is not the calibration of a pinhole camera with five distortion terms, or the eight of a rational lens",
                    topic()
                )
            })?;
            self.calibrations.entry(id).or_insert(calibration);
            return Ok(());
        }
        let message = ImageMessage::decode(location.schema, data).ok_or_else(|| format!("{} is damaged", topic()))?;
        self.count += 1;
        if self.count > MAX_FRAMES {
            return Err(format!("has more than {MAX_FRAMES} images; split the recording"));
        }
        let time_ns = message.time_ns.unwrap_or(i64::try_from(log_time).unwrap_or(i64::MAX));
        if let Some(images) = self.images.get_mut(&id) {
            images.list.push((time_ns, location));
            return Ok(());
        }
        let (is_depth, size) = kind(location.schema, &message).map_err(|reason| format!("{}: {reason}", topic()))?;
        let frame_id = message.frame_id.to_string();
        self.images.insert(id, Images { is_depth, size, frame_id, list: vec![(time_ns, location)] });
        Ok(())
    }

    fn frames(mut self) -> Result<(Rig, Vec<Entry>), String> {
        let depth_id = self.only(true)?.ok_or_else(|| self.nothing())?;
        let color_id = self.only(false)?;
        let depth_camera = self.calibration(depth_id)?;
        let color_camera = color_id.map(|id| self.calibration(id)).transpose()?;
        if let (Some(color), Some(id)) = (color_camera, color_id)
            && color != depth_camera
        {
            return Err(format!(
                "the colour of the topic `{}` is not registered to depth: the two calibrations differ, and where the \
                 cameras stand to each other is not read; record registered colour, or leave the colour topic out",
                self.channels[&id].topic
            ));
        }
        let mut take = |id: u16| self.images.remove(&id).map_or_else(Vec::new, |images| images.list);
        let (depth, color) = (take(depth_id), color_id.map_or_else(Vec::new, take));
        let entries = entries(depth, color);
        let rig = rig(depth_camera, color_camera, fps(&entries));
        Ok((rig, entries))
    }

    /// The only topic with depth (or colour) images.
    fn only(&self, is_depth: bool) -> Result<Option<u16>, String> {
        let ids: Vec<u16> = self.images.iter().filter(|(_, i)| i.is_depth == is_depth).map(|(id, _)| *id).collect();
        if let [_, _, ..] = ids.as_slice() {
            let what = if is_depth { "depth" } else { "colour" };
            let topics: Vec<&str> = ids.iter().map(|id| self.channels[id].topic.as_str()).collect();
            return Err(format!("has several topics with {what} images ({}); keep one of them", topics.join(", ")));
        }
        Ok(ids.first().copied())
    }

    /// The calibration of a topic's camera.
    fn calibration(&self, id: u16) -> Result<PinholeCamera, String> {
        let (images, topic) = (&self.images[&id], &self.channels[&id].topic);
        let named = |(_, name): &&(PinholeCamera, String)| !name.is_empty() && *name == images.frame_id;
        let shared = |id: &u16| {
            let other = &self.channels[id].topic;
            topic.split('/').zip(other.split('/')).take_while(|(a, b)| a == b).count()
        };
        let nearest = || self.calibrations.iter().max_by_key(|(id, _)| shared(id)).map(|(_, found)| found);
        let found = self.calibrations.values().find(named).or_else(nearest);
        let (camera, _) =
            found.ok_or_else(|| format!("there is no foxglove.CameraCalibration for the topic `{topic}`"))?;
        if (camera.width, camera.height) == images.size {
            return Ok(*camera);
        }
        Err(format!(
            "the images of the topic `{topic}` have {} x {} pixels, their calibration says {} x {}",
            images.size.0, images.size.1, camera.width, camera.height
        ))
    }

    fn nothing(&self) -> String {
        let mut names: Vec<&str> = self.schemas.values().map(|(_, name)| name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        names.truncate(8);
        let there = if names.is_empty() { "none".to_string() } else { names.join(", ") };
        format!(
            "is an MCAP file, but neither a recording of Toile's (it has no metadata record `toile.recording`) nor one with \
             depth images in foxglove.RawImage (16UC1) or foxglove.CompressedImage (16-bit PNG); its message types: {there}"
        )
    }
}

/// Whether a message is depth, and its columns and rows.
fn kind(schema: Schema, message: &ImageMessage) -> Result<(bool, (u32, u32)), String> {
    if schema == Schema::RawImage {
        return Ok((matches!(message.format, "16UC1" | "mono16"), (message.width, message.height)));
    }
    let size = encoded::size(message.data)?;
    Ok((encoded::is_deep_grey_png(message.data), size))
}

/// Frames from the images of both topics, in the order of their times.
fn entries(mut depth: Vec<(i64, Location)>, mut color: Vec<(i64, Location)>) -> Vec<Entry> {
    depth.sort_by_key(|image| image.0);
    color.sort_by_key(|image| image.0);
    let times = |list: &[(i64, Location)]| list.iter().map(|image| image.0).collect::<Vec<i64>>();
    let partner = associate(&times(&depth), &times(&color), MAX_APART_NS);
    let mut is_paired = vec![false; color.len()];
    partner.iter().flatten().for_each(|&j| is_paired[j] = true);
    let mut frames: Vec<(i64, Option<Location>, Option<Location>)> = Vec::new();
    frames.extend(depth.iter().zip(&partner).map(|(d, j)| (d.0, Some(d.1), j.map(|j| color[j].1))));
    frames.extend(color.iter().zip(&is_paired).filter(|(_, paired)| !**paired).map(|(c, _)| (c.0, None, Some(c.1))));
    frames.sort_by_key(|frame| frame.0);
    let entry = |(number, (time_ns, depth, color)): (usize, (i64, Option<Location>, Option<Location>))| {
        let frame_index = number as u64;
        let stamp = Stamp {
            frame_index,
            device_frame: frame_index,
            device_time_ns: time_ns,
            host_time_ns: time_ns,
            ..Stamp::default()
        };
        Entry { stamp, depth, color }
    };
    frames.into_iter().enumerate().map(entry).collect()
}

/// The nominal rate: what the median step between two frames gives; 0 for a single frame.
fn fps(entries: &[Entry]) -> f64 {
    let time = |entry: &Entry| entry.stamp.device_time_ns;
    let mut steps: Vec<i64> = entries.windows(2).map(|pair| time(&pair[1]).saturating_sub(time(&pair[0]))).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).filter(|step| **step > 0).map_or(0.0, |step| 1e9 / *step as f64)
}

fn rig(depth: PinholeCamera, color: Option<PinholeCamera>, fps: f64) -> Rig {
    Rig {
        sensors: vec![Sensor {
            name: "camera".to_string(),
            identity: DeviceIdentity { model: "import:mcap".to_string(), ..DeviceIdentity::default() },
            depth,
            depth_scale: DEPTH_SCALE,
            color,
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps,
        }],
    }
}
