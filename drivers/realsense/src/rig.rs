//! The sensors that frames come from.

use toile_capture::{ClockDomain, DeviceIdentity, Rig, Sensor};
use toile_geometry::Rigid;

use crate::{Calibration, Camera, RealsenseError, Settings, VideoMode, monitor::Details};

/// Metres a depth unit: the factory's setting, and that of the D405 (librealsense `src/ds/d400/d400-device.cpp`).
const DEPTH_SCALE: f64 = 0.001;
const D405: u16 = 0x0b5b;
const D405_DEPTH_SCALE: f64 = 0.0001;

/// Depth with colour, or depth with left infrared and then right infrared as a sensor of its own.
pub(crate) fn rig(
    camera: &Camera,
    details: &Details,
    calibration: &Calibration,
    settings: &Settings,
    clock: ClockDomain,
) -> Result<Rig, RealsenseError> {
    let (width, height) = settings.size;
    let depth = calibration.depth_camera(width, height)?;
    let (color, color_from_depth) = match settings.video {
        VideoMode::Color => {
            (calibration.color_camera(settings.color_size.0, settings.color_size.1)?, calibration.color_from_depth()?)
        }
        VideoMode::Infrared => (Some(depth), Rigid::identity()),
        VideoMode::Off => (None, Rigid::identity()),
    };
    let identity = DeviceIdentity {
        model: camera.name.into(),
        serial: details.serial.clone(),
        firmware: details.firmware.clone(),
        clock,
        ..DeviceIdentity::default()
    };
    let name = format!("realsense-{}", details.serial);
    let sensor = Sensor {
        name: name.clone(),
        identity,
        depth,
        depth_scale: if camera.id.1 == D405 { D405_DEPTH_SCALE } else { DEPTH_SCALE },
        color,
        color_from_depth,
        rig_from_depth: Rigid::identity(),
        fps: settings.fps.into(),
    };
    let mut sensors = vec![sensor.clone()];
    if settings.video == VideoMode::Infrared {
        let rig_from_depth = Rigid::translation(calibration.baseline()?, 0.0, 0.0);
        sensors.push(Sensor { name: format!("{name}-right"), rig_from_depth, ..sensor });
    }
    Ok(Rig { sensors })
}
