//! The calibration that k4arecorder attaches (`calibration.json`): each camera for its whole sensor, lengths as shares of it,
//! from which a mode of the camera takes a part.
//!
//! Sensors are calibrated with (0, 0) in the corner of the first pixel; here pixel centres are at integers. Where cameras stand
//! is stated in metres, each as `camera_from_depth`.

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{import::rigid::rigid_from_parts, printable};

/// Depth modes by their pictures' size: the size that the whole sensor has in it, and where its pictures begin.
const DEPTH_MODES: [((u32, u32), f64, [f64; 2]); 4] = [
    ((320, 288), 512.0, [96.0, 90.0]),
    ((640, 576), 1024.0, [192.0, 180.0]),
    ((512, 512), 512.0, [0.0, 0.0]),
    ((1024, 1024), 1024.0, [0.0, 0.0]),
];
/// The lens of prototypes has a centre of distortion of its own and half of the tangential terms that mix x and y. What is left
/// out of it by [`PinholeCamera`] may be so many pixels at most.
const LARGEST_DEPARTURE: f64 = 0.5;

#[derive(Debug, Deserialize)]
struct Document {
    #[serde(rename = "CalibrationInformation")]
    information: Information,
}

#[derive(Debug, Deserialize)]
struct Information {
    #[serde(rename = "Cameras")]
    cameras: Vec<RawCamera>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "PascalCase")]
struct RawCamera {
    intrinsics: Intrinsics,
    purpose: String,
    rt: Pose,
    sensor_width: f64,
    sensor_height: f64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Intrinsics {
    model_type: String,
    /// cx cy fx fy k1..k6 codx cody p2 p1
    model_parameters: Vec<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Pose {
    rotation: [f64; 9],
    translation: [f64; 3],
}

/// Both cameras of a recording.
#[derive(Debug)]
pub(super) struct Calibration {
    pub(super) depth: PinholeCamera,
    /// The colour camera and `color_from_depth`.
    pub(super) color: Option<(PinholeCamera, Rigid)>,
    /// What is left out of their lenses.
    pub(super) remarks: Vec<String>,
}

/// Reads the text for pictures of depth (and of colour) of these sizes.
///
/// # Errors
/// What is wrong with it.
pub(super) fn read(bytes: &[u8], depth: (u32, u32), color: Option<(u32, u32)>) -> Result<Calibration, String> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}').trim_end_matches('\0');
    let document: Document =
        serde_json::from_str(text).map_err(|error| format!("its calibration.json cannot be used: {error}"))?;
    let of = |purpose: &str| {
        let found = document.information.cameras.iter().find(|camera| camera.purpose.ends_with(purpose));
        found.ok_or_else(|| format!("its calibration.json has no camera with the purpose {purpose}"))
    };
    let raw = of("CameraPurposeDepth")?;
    let (whole, offset) = depth_mode(depth).ok_or_else(|| {
        format!(
            "its depth has {} x {} pixels, which is no mode of the cameras that this calibration is of",
            depth.0, depth.1
        )
    })?;
    let mut remarks = Vec::new();
    let depth = raw.camera("depth", [whole, whole], offset, depth, &mut remarks)?;
    let depth_from_reference = raw.pose()?;
    let color = match color {
        None => None,
        Some(size) => {
            let raw = of("CameraPurposePhotoVideo")?;
            let (whole, offset) = color_mode(raw, size)?;
            let camera = raw.camera("colour", whole, offset, size, &mut remarks)?;
            Some((camera, raw.pose()? * depth_from_reference.inverse()))
        }
    };
    Ok(Calibration { depth, color, remarks })
}

fn depth_mode(size: (u32, u32)) -> Option<(f64, [f64; 2])> {
    DEPTH_MODES.iter().find(|mode| mode.0 == size).map(|mode| (mode.1, mode.2))
}

/// The size of the whole sensor in pictures of a size, and where they begin in it. Pictures of 4:3 show the whole sensor, those of
/// 16:9 its middle. Early calibrations are for a sensor of 16:9.
fn color_mode(raw: &RawCamera, (width, height): (u32, u32)) -> Result<([f64; 2], [f64; 2]), String> {
    let (w, h) = (f64::from(width), f64::from(height));
    let sensor = [w, w * raw.sensor_height / raw.sensor_width];
    let offset = 0.5 * (sensor[1] - h);
    let known = [3.0 / 4.0, 9.0 / 16.0];
    let is_known = |ratio: f64| known.iter().any(|k| (ratio - k).abs() < 1e-3);
    if is_known(h / w) && is_known(sensor[1] / sensor[0]) {
        return Ok((sensor, [0.0, offset]));
    }
    Err(format!(
        "its colour has {width} x {height} pixels and its calibration is for {} x {}; pictures of 4:3 and 16:9 are read",
        raw.sensor_width, raw.sensor_height
    ))
}

impl RawCamera {
    /// The camera of pictures that begin at `offset` in a sensor of `whole` pixels.
    fn camera(
        &self,
        what: &str,
        whole: [f64; 2],
        offset: [f64; 2],
        (width, height): (u32, u32),
        remarks: &mut Vec<String>,
    ) -> Result<PinholeCamera, String> {
        let Some(&[cx, cy, fx, fy, k1, k2, k3, k4, k5, k6, codx, cody, p2, p1]) =
            self.intrinsics.model_parameters.first_chunk::<14>()
        else {
            return Err(format!("its calibration of {what} has fewer than 14 parameters"));
        };
        let [cx, cy] = [cx * whole[0] - offset[0] - 0.5, cy * whole[1] - offset[1] - 0.5];
        let ideal = PinholeCamera::ideal(width, height, fx * whole[0], fy * whole[1], cx, cy);
        let camera = PinholeCamera { distortion: [k1, k2, p1, p2, k3], rational: [k4, k5, k6], ..ideal };
        if !camera.is_valid() || !codx.is_finite() || !cody.is_finite() {
            return Err(format!("its calibration of {what} is not that of a camera"));
        }
        match self.intrinsics.model_type.rsplit('_').next() {
            Some("LensDistortionModelBrownConrady") => {}
            Some("LensDistortionModelRational6KT") => {
                let most = largest_departure(&camera, [codx, cody]);
                if most > LARGEST_DEPARTURE {
                    return Err(format!(
                        "the lens of its {what} camera is a prototype's, {most:.1} pixels from what is read"
                    ));
                }
                remarks.push(format!(
                    "the lens of its {what} camera is a prototype's; up to {most:.2} pixels of it are left out"
                ));
            }
            _ => {
                let model = printable(&self.intrinsics.model_type).into_owned();
                return Err(format!("the lens of its {what} camera is calibrated as `{model}`, which is not read"));
            }
        }
        Ok(camera)
    }

    /// `camera_from_reference`.
    fn pose(&self) -> Result<Rigid, String> {
        let rotation = Matrix3::from_row_slice(&self.rt.rotation);
        let pose = rigid_from_parts(&rotation, Vector3::from(self.rt.translation));
        pose.ok_or_else(|| "its calibration says a place of a camera that is not a rotation and a way".to_string())
    }
}

/// The largest distance in a picture between the lens of a prototype and `camera`, pixels.
fn largest_departure(camera: &PinholeCamera, [codx, cody]: [f64; 2]) -> f64 {
    let [.., p1, p2, _] = camera.distortion;
    let straight = PinholeCamera {
        distortion: [camera.distortion[0], camera.distortion[1], 0.0, 0.0, camera.distortion[4]],
        ..*camera
    };
    let departure = |i: u32| {
        let (u, v) =
            (f64::from(i % 9) / 8.0 * f64::from(camera.width), f64::from(i / 9) / 8.0 * f64::from(camera.height));
        let ray = camera.unproject(u, v, 1.0);
        let (x, y) = (ray.x - codx, ray.y - cody);
        let (Some(radial), Some(ours)) = (straight.project(&nalgebra::Point3::new(x, y, 1.0)), camera.project(&ray))
        else {
            return f64::INFINITY;
        };
        let r2 = x * x + y * y;
        let tangential = [p2 * (r2 + 2.0 * x * x) + p1 * x * y, p1 * (r2 + 2.0 * y * y) + p2 * x * y];
        let theirs = [radial.x + camera.fx * (tangential[0] + codx), radial.y + camera.fy * (tangential[1] + cody)];
        (theirs[0] - ours.x).hypot(theirs[1] - ours.y)
    };
    (0..81).map(departure).fold(0.0, f64::max)
}
