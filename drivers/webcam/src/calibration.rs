//! The calibration file of a webcam beside a depth camera.

use std::path::Path;

use serde::Deserialize;
use toile_capture::files::read_text;
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::WebcamError;

/// A webcam's lens, and where the depth camera beside it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct ColorCalibration {
    /// The webcam's camera model, for pictures of its size.
    pub camera: PinholeCamera,
    /// Maps points of the depth camera's frame to the webcam's, metres.
    pub color_from_depth: Rigid,
}

/// The content of the file (TOML): a `[camera]` table with `width`, `height`, `fx`, `fy`, `cx`, `cy` and, where the lens bends,
/// `distortion = [k1, k2, p1, p2, k3]`; and a `[color_from_depth]` table.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    camera: PinholeCamera,
    color_from_depth: CameraPosition,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraPosition {
    /// Where the depth camera stands in the webcam's frame, metres.
    position: [f64; 3],
    /// How it is turned there: axis times angle, degrees.
    #[serde(default)]
    rotation: [f64; 3],
}

/// Cameras that record one person stand at most this far apart, metres; a larger number is one in millimetres.
const MAX_POSITION: f64 = 10.0;

impl ColorCalibration {
    /// Reads a file.
    ///
    /// # Errors
    /// [`WebcamError::Calibration`] names the file and the field that is missing or impossible.
    pub fn read(path: &Path) -> Result<Self, WebcamError> {
        let wrong = |reason: String| WebcamError::Calibration { path: path.to_path_buf(), reason };
        let text = read_text(path).map_err(|e| wrong(e.reason()))?;
        parse(&text).map_err(wrong)
    }
}

fn parse(text: &str) -> Result<ColorCalibration, String> {
    let file: File = toml::from_str(text).map_err(|e| e.message().to_string())?;
    if !file.camera.is_valid() {
        return Err("camera: width, height, fx and fy must be positive and every number finite".into());
    }
    let CameraPosition { position, rotation } = file.color_from_depth;
    if !position.iter().all(|v| v.abs() <= MAX_POSITION) {
        return Err(format!(
            "color_from_depth: position is {position:?}, but must be metres, each at most {MAX_POSITION}"
        ));
    }
    if !rotation.iter().all(|v| v.abs() <= 360.0) {
        return Err(format!("color_from_depth: rotation is {rotation:?}, but must be degrees, each at most 360"));
    }
    let color_from_depth = Rigid::new(position.into(), rotation.map(f64::to_radians).into());
    Ok(ColorCalibration { camera: file.camera, color_from_depth })
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn what_is_no_regular_file_is_refused_without_waiting() {
        let told = ColorCalibration::read(Path::new("/dev/null")).unwrap_err().to_string();
        assert!(told.contains("not a regular file"), "{told}");
    }

    const GOOD: &str = "[camera]\nwidth = 1280\nheight = 720\nfx = 940.0\nfy = 940.0\ncx = 639.5\ncy = 359.5\n\
                        [color_from_depth]\nposition = [0.0, 0.1, 0.0]\nrotation = [0.0, 90.0, 0.0]\n";

    #[test]
    fn a_good_file_places_the_depth_camera_in_the_webcams_frame() {
        let read = parse(GOOD).unwrap();
        assert_eq!((read.camera.width, read.camera.fx), (1280, 940.0));
        let seen = read.color_from_depth * Point3::new(0.0, 0.0, 1.0);
        assert!((seen - Point3::new(1.0, 0.1, 0.0)).norm() < 1e-12, "{seen}");
        assert!(parse(&GOOD.replace("rotation = [0.0, 90.0, 0.0]\n", "")).is_ok());
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (good, bad, words) in [
            ("fx = 940.0\n", "", "fx"),
            ("fx = 940.0", "fx = -1.0", "fx"),
            ("position = [0.0, 0.1, 0.0]\n", "", "position"),
            ("[0.0, 0.1, 0.0]", "[0.0, 52.0, 0.0]", "metres"),
            ("[0.0, 0.1, 0.0]", "[0.0, nan, 0.0]", "metres"),
            ("[0.0, 90.0, 0.0]", "[0.0, inf, 0.0]", "degrees"),
            ("[0.0, 90.0, 0.0]", "[0.0, 361.0, 0.0]", "degrees"),
            ("rotation", "turned", "turned"),
        ] {
            let error = parse(&GOOD.replace(good, bad)).unwrap_err();
            assert!(error.contains(words), "{bad}: {error}");
        }
    }
}
