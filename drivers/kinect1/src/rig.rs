//! The sensor that frames come from.

use toile_capture::{ClockDomain, DeviceIdentity, Rig, Sensor};
use toile_driver_transport::DeviceInfo;
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{
    Settings, VideoMode,
    decode::{HEIGHT, INFRARED_HEIGHT},
    registration::Registration,
    streams::FPS,
};

/// Depth with colour or infrared, as the settings say.
pub(crate) fn rig(info: &DeviceInfo, serial: String, registration: &Registration, settings: &Settings) -> Rig {
    let (color, color_from_depth) = registration.color_camera();
    let measured = registration.depth_camera();
    // Where the eight additional rows of infrared are is documented nowhere: half above, half below.
    let margin = (INFRARED_HEIGHT - HEIGHT) as f64 / 2.0;
    let infrared = PinholeCamera { height: INFRARED_HEIGHT as u32, cy: measured.cy + margin, ..measured };
    let (color, color_from_depth) = match (settings.video, settings.registered) {
        (VideoMode::Off, _) => (None, Rigid::identity()),
        (VideoMode::Color, true) => (Some(color), Rigid::identity()),
        (VideoMode::Color, false) => (Some(color), color_from_depth),
        (VideoMode::Infrared, true) => (Some(infrared), color_from_depth.inverse()),
        (VideoMode::Infrared, false) => (Some(infrared), Rigid::identity()),
    };
    let sensor = Sensor {
        name: if serial.is_empty() { "kinect1".into() } else { format!("kinect1-{serial}") },
        identity: DeviceIdentity {
            model: "Kinect v1".into(),
            serial,
            firmware: format!("{:x}.{:02x}", info.release >> 8, info.release & 0xff),
            clock: ClockDomain::Device,
            ..DeviceIdentity::default()
        },
        depth: if settings.registered { registration.color_camera().0 } else { measured },
        depth_scale: 0.001,
        color,
        color_from_depth,
        rig_from_depth: Rigid::identity(),
        fps: FPS,
    };
    Rig { sensors: vec![sensor] }
}
