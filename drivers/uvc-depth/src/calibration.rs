//! The intrinsics file of a UVC depth camera.

use std::path::Path;

use serde::Deserialize;
use toile_capture::{ClockDomain, DeviceIdentity, Sensor, files::read_text};
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::UvcDepthError;

/// The content of the file (TOML): `name`, `depth_scale` (metres a unit) and a `[camera]` table with `width`, `height`,
/// `fx`, `fy`, `cx`, `cy` and, where the lens bends, `distortion = [k1, k2, p1, p2, k3]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    depth_scale: f64,
    camera: PinholeCamera,
}

/// Reads the calibration of a depth camera.
///
/// # Errors
/// [`UvcDepthError::Calibration`] names the field that is missing or impossible.
pub fn read(path: &Path) -> Result<Sensor, UvcDepthError> {
    let wrong = |reason: String| UvcDepthError::Calibration { path: path.to_path_buf(), reason };
    let text = read_text(path).map_err(|e| wrong(e.reason()))?;
    parse(&text).map_err(wrong)
}

fn parse(text: &str) -> Result<Sensor, String> {
    let file: File = toml::from_str(text).map_err(|e| e.to_string())?;
    if !file.camera.is_valid() {
        return Err("camera: width, height, fx and fy must be positive and every number finite".into());
    }
    if !(file.depth_scale.is_finite() && file.depth_scale > 0.0) {
        return Err("depth_scale must be positive: metres a depth unit, 0.001 for millimetres".into());
    }
    Ok(Sensor {
        name: file.name.clone(),
        // V4L2 stamps buffers with the monotonic clock.
        identity: DeviceIdentity { model: file.name, clock: ClockDomain::HostMonotonic, ..DeviceIdentity::default() },
        depth: file.camera,
        depth_scale: file.depth_scale,
        color: None,
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::identity(),
        fps: 0.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_regular_file_is_refused_without_waiting() {
        let told = read(Path::new("/dev/null")).unwrap_err().to_string();
        assert!(told.contains("not a regular file"), "{told}");
    }

    const GOOD: &str = "name = \"gemini\"\ndepth_scale = 0.001\n[camera]\nwidth = 640\nheight = 400\nfx = 475.0\nfy = 475.0\ncx = 319.5\ncy = 199.5\n";

    #[test]
    fn a_good_file_is_read() {
        let sensor = parse(GOOD).unwrap();
        assert_eq!((sensor.depth.width, sensor.depth.fx, sensor.depth_scale), (640, 475.0, 0.001));
    }

    #[test]
    fn what_is_wrong_is_named() {
        assert!(parse(&GOOD.replace("fx = 475.0\n", "")).unwrap_err().contains("fx"));
        assert!(parse(&GOOD.replace("fx = 475.0", "fx = -1.0")).unwrap_err().contains("fx"));
        assert!(parse(&GOOD.replace("0.001", "0.0")).unwrap_err().contains("depth_scale"));
        assert!(parse(&GOOD.replace("name", "nome")).unwrap_err().contains("nome"));
    }
}
