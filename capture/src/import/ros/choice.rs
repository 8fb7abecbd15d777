//! Which streams of a log become depth and colour of a sensor.

use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{
    between,
    survey::{Stream, Survey},
};
use crate::printable;

/// Metres a unit of depth where nothing is said: millimetres, as is the custom for `16UC1` (REP 118).
const DEPTH_SCALE: f64 = 0.001;

/// The streams that are read.
pub(super) struct Choice<'a> {
    pub(super) depth: (&'a Stream, PinholeCamera),
    pub(super) depth_scale: f64,
    /// Colour, its camera, and where that stands: `color_from_depth`.
    pub(super) color: Option<(&'a Stream, PinholeCamera, Rigid)>,
    pub(super) remarks: Vec<String>,
}

/// Chooses: the depth stream with the most pictures that has a calibration, and with it the colour stream that has the most in
/// common with it and whose place is known.
///
/// # Errors
/// A sentence that says what is missing.
pub(super) fn choose(survey: &Survey) -> Result<Choice<'_>, String> {
    let mut remarks = Vec::new();
    let mut depths: Vec<&Stream> = survey.streams.iter().filter(|stream| stream.is_depth()).collect();
    depths.sort_by(|a, b| b.pictures.len().cmp(&a.pictures.len()).then_with(|| a.topic.name.cmp(&b.topic.name)));
    let (&depth, others) = depths.split_first().ok_or_else(|| nothing(survey))?;
    if !others.is_empty() {
        let names: Vec<String> = others.iter().map(|stream| printable(&stream.topic.name).into_owned()).collect();
        let read = printable(&depth.topic.name);
        remarks.push(format!("of several topics with depth, {read} is read; left out: {}", names.join(", ")));
    }
    let camera = camera_of(survey, depth)?;
    let mut colors: Vec<&Stream> = survey.streams.iter().filter(|stream| is_color(stream)).collect();
    // Colour that is registered to depth comes first, then what has the most in common.
    colors.sort_by_key(|stream| {
        (
            !is_registered(depth, stream),
            usize::MAX - shared(&depth.topic.name, &stream.topic.name),
            stream.is_compressed(),
        )
    });
    let mut color = None;
    for stream in colors {
        match place(survey, (depth, &camera), stream) {
            Ok((camera, pose)) => {
                color = Some((stream, camera, pose));
                break;
            }
            Err(reason) => remarks.push(format!("colour of {} is left out: {reason}", printable(&stream.topic.name))),
        }
    }
    if color.is_some() {
        remarks.retain(|remark| !remark.starts_with("colour of"));
    }
    let is_float = depth.encoding.eq_ignore_ascii_case("32FC1");
    let unit = survey.depth_unit.filter(|_| depth.is_librealsense() && !is_float);
    if unit.is_none() && depth.is_librealsense() {
        remarks.push("the recording does not say its unit of depth; millimetres are assumed".into());
    }
    Ok(Choice { depth: (depth, camera), depth_scale: unit.unwrap_or(DEPTH_SCALE), color, remarks })
}

fn is_color(stream: &Stream) -> bool {
    let encoding = stream.encoding.to_ascii_lowercase();
    let raw = ["rgb8", "bgr8", "rgba8", "bgra8", "yuv422", "yuv422_yuy2", "yuyv", "uyvy"];
    if stream.is_compressed() {
        return !encoding.contains("compresseddepth") && (encoding.contains("jp") || encoding.contains("png"));
    }
    raw.contains(&encoding.as_str())
}

/// Where a colour stream's camera stands, with the camera.
fn place(
    survey: &Survey,
    (depth, depth_camera): (&Stream, &PinholeCamera),
    color: &Stream,
) -> Result<(PinholeCamera, Rigid), String> {
    let camera = camera_of(survey, color)?;
    if is_registered(depth, color) || camera == *depth_camera {
        return Ok((camera, Rigid::identity()));
    }
    let of = |stream: &Stream| {
        let prefix = stream.topic.name.split("/image/").next().unwrap_or_default();
        let found = survey
            .transforms
            .iter()
            .find(|(topic, _)| topic.strip_prefix(prefix).is_some_and(|t| t.starts_with("/tf")));
        found.map(|(_, stream_from_reference)| *stream_from_reference)
    };
    if let (Some(color_from_reference), Some(depth_from_reference)) = (of(color), of(depth)) {
        return Ok((camera, color_from_reference * depth_from_reference.inverse()));
    }
    let pose = between(&survey.links, &depth.frame_id, &color.frame_id);
    pose.map(|pose| (camera, pose)).ok_or_else(|| {
        format!(
            "where its camera stands is not said (no /tf between `{}` and `{}`); record colour that is registered to depth, or \
             /tf_static with it",
            printable(&depth.frame_id),
            printable(&color.frame_id)
        )
    })
}

/// True where both streams are of one camera, as registered pictures are.
fn is_registered(depth: &Stream, color: &Stream) -> bool {
    let name = depth.topic.name.to_ascii_lowercase();
    let aligned = ["aligned_depth_to_color", "depth_registered", "depth_to_rgb"].iter().any(|word| name.contains(word));
    (!depth.frame_id.is_empty() && depth.frame_id == color.frame_id && !depth.is_librealsense()) || aligned
}

/// The calibration of a stream: of the same frame and size, else of the topic with the most in common.
fn camera_of(survey: &Survey, stream: &Stream) -> Result<PinholeCamera, String> {
    let name = &stream.topic.name;
    let mut candidates: Vec<_> = survey.cameras.iter().collect();
    candidates.sort_by_key(|(topic, _)| usize::MAX - shared(topic, name));
    let usable = || candidates.iter().filter_map(|(topic, found)| Some((topic, found.as_ref().ok()?)));
    let fits = |camera: &PinholeCamera| (camera.width, camera.height) == stream.size;
    let same_frame =
        usable().find(|(_, (camera, frame))| !frame.is_empty() && *frame == stream.frame_id && fits(camera));
    // Beyond the first name of a path, topics of one camera have its own name in common.
    let nearest = || usable().find(|(topic, (camera, _))| shared(topic, name) > 1 && fits(camera));
    if let Some((_, (camera, _))) = same_frame.or_else(nearest) {
        return Ok(*camera);
    }
    let reason = candidates.iter().find_map(|(_, found)| found.as_ref().err());
    let reason = reason.map_or_else(|| "no sensor_msgs/CameraInfo of its size is near it".to_string(), Clone::clone);
    let (width, height) = stream.size;
    Err(format!("there is no calibration for the topic `{}` of {width} x {height} pixels: {reason}", printable(name)))
}

/// How many names two topics have in common from their beginning.
fn shared(a: &str, b: &str) -> usize {
    a.split('/').zip(b.split('/')).take_while(|(a, b)| a == b).count()
}

fn nothing(survey: &Survey) -> String {
    let mut topics: Vec<&str> = survey.topics.iter().map(String::as_str).collect();
    let more = topics.len().saturating_sub(8);
    topics.truncate(8);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let listed = printable(&topics.join(", ")).into_owned();
    format!(
        "is a ROS recording, but has no topic with depth pictures (sensor_msgs/Image with 16UC1, mono16 or 32FC1, or \
         compressedDepth); its topics: {listed}{more}"
    )
}
