//! What a log of ROS messages holds: streams of pictures, calibrations, transforms, units.

use std::collections::BTreeMap;

use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{
    log::{Log, LogMessage, Topic},
    messages::{Image, Link, camera_info, legacy_stream, links, number, transform},
};

/// More pictures than these are not indexed: nine hours at 30 a second.
const MAX_PICTURES: usize = 1 << 20;

/// A picture of a stream.
#[derive(Debug, Clone, Copy)]
pub(super) struct Picture {
    pub(super) message: usize,
    pub(super) time_ns: i64,
}

/// The pictures of a topic.
#[derive(Debug, Clone)]
pub(super) struct Stream {
    pub(super) topic: Topic,
    pub(super) pictures: Vec<Picture>,
    /// Of the first picture.
    pub(super) frame_id: String,
    pub(super) encoding: String,
    pub(super) size: (u32, u32),
}

impl Stream {
    /// The image in a message of this stream.
    ///
    /// # Errors
    /// That it is damaged.
    pub(super) fn image<'a>(&self, bytes: &'a [u8]) -> Result<Image<'a>, String> {
        let image = if self.is_compressed() { Image::compressed } else { Image::raw };
        image(bytes, self.topic.coding).ok_or_else(|| "message is damaged".into())
    }

    pub(super) fn is_compressed(&self) -> bool {
        self.topic.is("sensor_msgs/CompressedImage")
    }

    /// True for the topics of librealsense's own recordings, of either version.
    pub(super) fn is_librealsense(&self) -> bool {
        self.topic.name.starts_with("/device_") || self.topic.name.contains("/image_raw/")
    }

    pub(super) fn is_depth(&self) -> bool {
        let encoding = self.encoding.to_ascii_lowercase();
        if self.is_compressed() {
            return encoding.contains("compresseddepth");
        }
        matches!(encoding.as_str(), "16uc1" | "mono16" | "32fc1" | "z16") && !self.topic.name.contains("nfra")
    }
}

/// A camera and the name of its frame, or why it cannot be used.
pub(super) type FoundCamera = Result<(PinholeCamera, String), String>;

/// What a log holds.
#[derive(Default)]
pub(super) struct Survey {
    pub(super) streams: Vec<Stream>,
    /// Cameras with the topic and the frame that they are of; those that cannot be used with the reason.
    pub(super) cameras: Vec<(String, FoundCamera)>,
    pub(super) links: Vec<Link>,
    /// librealsense: where streams stand, `stream_from_reference`, by topic.
    pub(super) transforms: Vec<(String, Rigid)>,
    /// librealsense: metres a unit of depth.
    pub(super) depth_unit: Option<f64>,
    /// All topics with their types, for messages.
    pub(super) topics: Vec<String>,
}

impl Survey {
    /// Reads everything but pictures; of each picture its time.
    ///
    /// # Errors
    /// A sentence where a message cannot be read from the file.
    pub(super) fn new(log: &mut dyn Log, topics: &[Topic], messages: &[LogMessage]) -> Result<Self, String> {
        let names = topics.iter().map(|topic| format!("{} ({})", topic.name, topic.kind));
        let mut survey = Self { topics: names.collect(), ..Self::default() };
        let mut streams: BTreeMap<usize, Stream> = BTreeMap::new();
        let mut last = BTreeMap::new();
        for (k, message) in messages.iter().enumerate() {
            let topic = &topics[message.topic];
            if topic.is("sensor_msgs/Image") || topic.is("sensor_msgs/CompressedImage") {
                add_picture(log, topic, message, k, &mut streams)?;
            } else if is_of_use(topic) && last.insert(message.topic, k).is_none_or(|_| topic.is("tf2_msgs/TFMessage")) {
                survey.add(topic, &log.payload(k)?);
            }
        }
        survey.streams = streams.into_values().collect();
        Ok(survey)
    }

    fn add(&mut self, topic: &Topic, bytes: &[u8]) {
        let name = topic.name.clone();
        if topic.is("sensor_msgs/CameraInfo") {
            self.cameras.push((name, camera_info(bytes, topic.coding)));
        } else if topic.kind.ends_with("/stream_info") {
            if let Some((stream, camera)) = legacy_stream(bytes) {
                let topic = format!("/camera/{}/stream_info", stream.to_ascii_lowercase());
                self.cameras.push((topic, camera.map(|camera| (camera, String::new()))));
            }
        } else if topic.is("tf2_msgs/TFMessage") {
            self.links.extend(links(bytes, topic.coding).unwrap_or_default());
        } else if topic.is("geometry_msgs/Transform") {
            self.transforms.extend(transform(bytes, topic.coding).map(|pose| (name, pose)));
        } else if let Some(unit) = number(bytes, topic.coding).filter(|unit| (1e-6..0.1).contains(unit)) {
            // A float's neighbours are rounded to the decimal that was meant: 0.001 m.
            self.depth_unit = Some((f64::from(unit) * 1e7).round() / 1e7);
        }
    }
}

/// Topics besides pictures that are read.
fn is_of_use(topic: &Topic) -> bool {
    let kinds = ["sensor_msgs/CameraInfo", "tf2_msgs/TFMessage", "geometry_msgs/Transform"];
    kinds.iter().any(|kind| topic.is(kind))
        || topic.kind.ends_with("/stream_info")
        || (topic.is("std_msgs/Float32") && topic.name.ends_with("/Depth Units/value"))
}

fn add_picture(
    log: &mut dyn Log,
    topic: &Topic,
    message: &LogMessage,
    k: usize,
    streams: &mut BTreeMap<usize, Stream>,
) -> Result<(), String> {
    let bytes = log.payload(k)?;
    let empty = || Stream {
        topic: topic.clone(),
        pictures: Vec::new(),
        frame_id: String::new(),
        encoding: String::new(),
        size: (0, 0),
    };
    let stream = streams.entry(message.topic).or_insert_with(empty);
    if stream.pictures.len() >= MAX_PICTURES {
        return Err(format!("has more than {MAX_PICTURES} pictures; split the recording"));
    }
    let image = stream.image(&bytes).ok();
    // Some writers leave the header's time at 0.
    let time_ns = image.as_ref().map(|image| image.time_ns).filter(|time| *time > 0).unwrap_or(message.time_ns);
    if let Some(image) = image.filter(|_| stream.encoding.is_empty()) {
        let (frame_id, encoding, size) = (image.frame_id.to_string(), image.encoding.to_string(), image.size);
        let size = if size == (0, 0) { super::pixels::compressed_size(&image).unwrap_or((0, 0)) } else { size };
        (stream.frame_id, stream.encoding, stream.size) = (frame_id, encoding, size);
    }
    stream.pictures.push(Picture { message: k, time_ns });
    Ok(())
}
