//! The messages of `sensor_msgs`, `geometry_msgs` and `tf2_msgs` that recordings of depth cameras need.

use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use toile_geometry::{Rigid, camera::PinholeCamera};

use super::reader::{Coding, Reader};

/// `sensor_msgs/Image` or `CompressedImage`.
pub(super) struct Image<'a> {
    pub(super) time_ns: i64,
    pub(super) frame_id: &'a str,
    /// Columns and rows; 0 in compressed images.
    pub(super) size: (u32, u32),
    /// `16UC1`, `rgb8`, or of compressed images `jpeg` and the like.
    pub(super) encoding: &'a str,
    pub(super) is_big_endian: bool,
    /// Bytes from row to row.
    pub(super) step: u32,
    pub(super) data: &'a [u8],
}

impl<'a> Image<'a> {
    pub(super) fn raw(bytes: &'a [u8], coding: Coding) -> Option<Self> {
        let mut reader = Reader::new(bytes, coding)?;
        let (time_ns, frame_id) = reader.header()?;
        let (height, width) = (reader.u32()?, reader.u32()?);
        let (encoding, is_big_endian, step) = (reader.text()?, reader.u8()? != 0, reader.u32()?);
        Some(Self { time_ns, frame_id, size: (width, height), encoding, is_big_endian, step, data: reader.bytes()? })
    }

    pub(super) fn compressed(bytes: &'a [u8], coding: Coding) -> Option<Self> {
        let mut reader = Reader::new(bytes, coding)?;
        let (time_ns, frame_id) = reader.header()?;
        let encoding = reader.text()?;
        Some(Self { time_ns, frame_id, size: (0, 0), encoding, is_big_endian: false, step: 0, data: reader.bytes()? })
    }
}

/// `sensor_msgs/CameraInfo`: the camera, and its frame's name.
///
/// # Errors
/// A sentence where it is damaged or of a lens that is not read.
pub(super) fn camera_info(bytes: &[u8], coding: Coding) -> Result<(PinholeCamera, String), String> {
    let mut reader = Reader::new(bytes, coding).ok_or(DAMAGED)?;
    read_camera(&mut reader)
}

const DAMAGED: &str = "a calibration is damaged";

/// A camera from a reader that stands at a `sensor_msgs/CameraInfo`.
fn read_camera(reader: &mut Reader) -> Result<(PinholeCamera, String), String> {
    let (_, frame_id) = reader.header().ok_or(DAMAGED)?;
    let mut size = || Some((reader.u32()?, reader.u32()?));
    let (height, width) = size().ok_or(DAMAGED)?;
    let model = reader.text().ok_or(DAMAGED)?.to_string();
    let distortion = reader.f64_list().ok_or(DAMAGED)?;
    let k: [f64; 9] = reader.f64s().ok_or(DAMAGED)?;
    let _: [f64; 21] = reader.f64s().ok_or(DAMAGED)?; // R and P, of rectified pictures
    if reader.u32().and(reader.u32()).is_none() || (0..4).any(|_| reader.u32().is_none()) || reader.u8().is_none() {
        return Err(DAMAGED.into());
    }
    let camera = PinholeCamera::ideal(width, height, k[0], k[4], k[2], k[5]);
    let (distortion, rational) = lens(&model, &distortion)?;
    let camera = PinholeCamera { distortion, rational, ..camera };
    if camera.is_valid() {
        Ok((camera, frame_id.to_string()))
    } else {
        Err("a calibration is not that of a camera".into())
    }
}

/// The coefficients k1 k2 p1 p2 k3, and k4 k5 k6 of a rational lens. The model of librealsense that is named "Inverse Brown
/// Conrady" is of depth cameras whose pictures are rectified: all its coefficients are 0, or it is refused as any other.
fn lens(model: &str, coefficients: &[f64]) -> Result<([f64; 5], [f64; 3]), String> {
    let is_zero = coefficients.iter().all(|c| *c == 0.0);
    let is_rational = model == "rational_polynomial";
    let is_brown = ["", "plumb_bob", "Brown Conrady", "Modified Brown Conrady", "None"].contains(&model) || is_rational;
    let beyond = coefficients.iter().skip(if is_rational { 8 } else { 5 }).any(|c| *c != 0.0);
    if !is_zero && (beyond || !is_brown) {
        let shown: String = model.chars().filter(|c| !c.is_control()).take(40).collect();
        return Err(format!(
            "the lens is calibrated as `{shown}` with {} coefficients, which is not read; record rectified pictures",
            coefficients.len()
        ));
    }
    let (mut five, mut three) = ([0.0; 5], [0.0; 3]);
    five.iter_mut().chain(&mut three).zip(coefficients).for_each(|(to, from)| *to = *from);
    Ok((five, three))
}

/// `geometry_msgs/Transform`.
pub(super) fn transform(bytes: &[u8], coding: Coding) -> Option<Rigid> {
    read_transform(&mut Reader::new(bytes, coding)?)
}

fn read_transform(reader: &mut Reader) -> Option<Rigid> {
    let [x, y, z] = reader.f64s()?;
    let [i, j, k, w] = reader.f64s()?;
    let rotation = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-6)?;
    let finite = [x, y, z].iter().all(|c| c.is_finite()) && rotation.coords.iter().all(|c| c.is_finite());
    finite.then(|| Rigid::from_parts(Translation3::new(x, y, z), rotation))
}

/// One of the transforms of `tf2_msgs/TFMessage`.
pub(super) struct Link {
    pub(super) parent: String,
    pub(super) child: String,
    pub(super) parent_from_child: Rigid,
}

/// `tf2_msgs/TFMessage`.
pub(super) fn links(bytes: &[u8], coding: Coding) -> Option<Vec<Link>> {
    let mut reader = Reader::new(bytes, coding)?;
    let count = reader.u32()?;
    let one = |_| {
        let (_, parent) = reader.header()?;
        let child = reader.text()?.to_string();
        Some(Link { parent: parent.to_string(), child, parent_from_child: read_transform(&mut reader)? })
    };
    (0..count).map(one).collect()
}

/// `std_msgs/Float32`.
pub(super) fn number(bytes: &[u8], coding: Coding) -> Option<f32> {
    Reader::new(bytes, coding)?.f32()
}

/// `realsense_legacy_msgs/stream_info` of the first librealsense recordings: the stream's name and its camera. Their
/// description and their files name its first two fields in different orders.
pub(super) fn legacy_stream(bytes: &[u8]) -> Option<(String, Result<PinholeCamera, String>)> {
    let name_of = |fps_first: bool| {
        let mut reader = Reader::new(bytes, Coding::Ros1)?;
        if fps_first {
            reader.u32()?;
        }
        let name = reader.text()?;
        let is_name = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b' ');
        if !fps_first {
            reader.u32()?;
        }
        is_name.then(|| (name.to_string(), read_camera(&mut reader).map(|(camera, _)| camera)))
    };
    name_of(false).or_else(|| name_of(true))
}
