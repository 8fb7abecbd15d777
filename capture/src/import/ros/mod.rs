//! Recordings of ROS 1 and ROS 2 (`sensor_msgs`), and those of librealsense, which are ROS 1 bags with topics of their own.
//!
//! Depth is `sensor_msgs/Image` with `16UC1` or `mono16` (millimetres, or the unit that the recording states) or `32FC1`
//! (metres), or a `CompressedImage` that holds a 16-bit PNG. Its calibration is the `CameraInfo` of the same frame, else the one
//! whose topic has the most in common. Colour may be a camera of its own where `tf` says where it stands.

mod bag;
mod bag2;
mod choice;
mod db3;
mod log;
mod mcap;
mod messages;
mod pixels;
mod reader;
mod survey;

use std::{collections::BTreeMap, path::Path};

use toile_geometry::Rigid;

use super::stored::{Album, StoredSource, fps, shots};
use crate::{CaptureError, ColorImage, DepthImage, DeviceIdentity, Rig, Sensor};
use log::{Log, Opened};
use survey::{Stream, Survey};

pub(super) use bag::MAGIC as BAG_MAGIC;
pub(super) use bag2::is_here as holds_bag2;
pub(super) use db3::MAGIC as SQLITE_MAGIC;
pub(super) use mcap::holds_ros;

/// Opens a ROS 1 bag.
///
/// # Errors
/// [`CaptureError`] that says what is missing, and which topics there are.
pub(super) fn open_bag(path: &Path) -> Result<StoredSource, CaptureError> {
    open(path, "bag", bag::Bag::open(path)?)
}

/// Opens an MCAP file with messages of ROS 1 or ROS 2.
///
/// # Errors
/// As [`open_bag`].
pub(super) fn open_mcap(path: &Path) -> Result<StoredSource, CaptureError> {
    open(path, "ros-mcap", mcap::open(path)?)
}

/// Opens a ROS 2 bag: its folder, or one file of it in SQLite.
///
/// # Errors
/// As [`open_bag`].
pub(super) fn open_bag2(path: &Path) -> Result<StoredSource, CaptureError> {
    open(path, "ros2-bag", bag2::open(path)?)
}

fn open<L: Log + 'static>(path: &Path, format: &str, opened: Opened<L>) -> Result<StoredSource, CaptureError> {
    let wrong = |reason: String| CaptureError::format(path, reason);
    let Opened { mut log, topics, messages, ending } = opened;
    let survey = Survey::new(&mut log, &topics, &messages).map_err(wrong)?;
    let choice = choice::choose(&survey).map_err(wrong)?;
    let mut remarks: Vec<String> = ending.into_iter().collect();
    remarks.extend(choice.remarks);
    let times = |stream: &Stream| stream.pictures.iter().map(|picture| picture.time_ns).collect::<Vec<i64>>();
    let color_times = choice.color.as_ref().map_or_else(Vec::new, |(stream, ..)| times(stream));
    let shots = shots(&times(choice.depth.0), &color_times);
    let sensor = Sensor {
        name: "camera".into(),
        identity: DeviceIdentity { model: format!("import:{format}"), ..DeviceIdentity::default() },
        depth: choice.depth.1,
        depth_scale: choice.depth_scale,
        color: choice.color.as_ref().map(|(_, camera, _)| *camera),
        color_from_depth: choice.color.as_ref().map_or_else(Rigid::identity, |(_, _, pose)| *pose),
        rig_from_depth: Rigid::identity(),
        fps: fps(&shots),
    };
    let color = choice.color.map(|(stream, ..)| stream.clone());
    let album = RosAlbum { log: Box::new(log), depth: choice.depth.0.clone(), color };
    StoredSource::new(path.to_path_buf(), Rig { sensors: vec![sensor] }, shots, Box::new(album), remarks)
}

/// The pictures of two topics.
#[derive(Debug)]
struct RosAlbum {
    log: Box<dyn Log>,
    depth: Stream,
    color: Option<Stream>,
}

impl Album for RosAlbum {
    fn depth(&mut self, k: usize) -> Result<DepthImage, String> {
        let bytes = self.log.payload(self.depth.pictures[k].message)?;
        pixels::depth(&self.depth.image(&bytes)?)
    }

    fn color(&mut self, k: usize) -> Result<ColorImage, String> {
        let stream = self.color.as_ref().ok_or("is of no stream")?;
        let bytes = self.log.payload(stream.pictures[k].message)?;
        pixels::color(&stream.image(&bytes)?, stream.is_librealsense())
    }
}

/// The bytes of a log as each of its readers would take them; for `fuzz/`.
pub(crate) fn parse(bytes: &[u8]) {
    for coding in [reader::Coding::Ros1, reader::Coding::Cdr] {
        for image in
            [messages::Image::raw(bytes, coding), messages::Image::compressed(bytes, coding)].into_iter().flatten()
        {
            let _ = (pixels::depth(&image), pixels::color(&image, false));
        }
        let _ =
            (messages::camera_info(bytes, coding), messages::links(bytes, coding), messages::transform(bytes, coding));
    }
    let _ = messages::legacy_stream(bytes);
}

/// What is between two frames by their names, from a list of links; `None` where nothing joins them.
fn between(links: &[messages::Link], from: &str, to: &str) -> Option<Rigid> {
    let clean = |name: &str| name.trim_start_matches('/').to_string();
    let (from, to) = (clean(from), clean(to));
    let mut known: BTreeMap<String, Rigid> = BTreeMap::from([(from, Rigid::identity())]);
    // Each round reaches at least one frame more.
    for _ in 0..=links.len() {
        let before = known.len();
        for link in links {
            let (parent, child) = (clean(&link.parent), clean(&link.child));
            if let Some(child_from) = known.get(&child).copied() {
                known.entry(parent).or_insert(link.parent_from_child * child_from);
            } else if let Some(parent_from) = known.get(&parent).copied() {
                known.entry(child).or_insert(link.parent_from_child.inverse() * parent_from);
            }
        }
        if known.len() == before {
            break;
        }
    }
    known.get(&to).copied()
}

#[cfg(test)]
mod tests;
