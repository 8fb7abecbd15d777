//! The sensor that frames come from.

use toile_capture::{ClockDomain, DeviceIdentity, Rig, Sensor};
use toile_geometry::Rigid;

use crate::{Calibration, ColorMode, commands::Identity, registration::Registration, streams::FPS};

/// Depth with colour, as the settings say.
pub(crate) fn rig(identity: Identity, calibration: &Calibration, registration: &Registration, mode: ColorMode) -> Rig {
    let (color, color_from_depth) = match mode {
        ColorMode::Registered => (Some(calibration.depth), Rigid::identity()),
        ColorMode::Full => {
            let (camera, color_from_depth) = registration.color_camera();
            (Some(camera), color_from_depth)
        }
        ColorMode::Off => (None, Rigid::identity()),
    };
    let sensor = Sensor {
        name: format!("kinect2-{}", identity.serial),
        identity: DeviceIdentity {
            model: "Kinect v2".into(),
            serial: identity.serial,
            firmware: identity.firmware,
            clock: ClockDomain::Device,
            ..DeviceIdentity::default()
        },
        depth: calibration.depth,
        depth_scale: 0.001,
        color,
        color_from_depth,
        rig_from_depth: Rigid::identity(),
        fps: FPS,
    };
    Rig { sensors: vec![sensor] }
}
