//! One or more sensors with their calibration.

use serde::{Deserialize, Serialize};
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::ClockDomain;

/// Who made the frames.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct DeviceIdentity {
    /// Device model, such as `Kinect v2`, `synthetic` or `import:folder`.
    pub model: String,
    /// Serial number, empty where there is none.
    pub serial: String,
    /// Firmware version, empty where there is none.
    pub firmware: String,
    /// The clock of its frames' device time.
    #[serde(default)]
    pub clock: ClockDomain,
    /// Nobody gave its calibration: a usual one was assumed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub calibration_assumed: bool,
}

/// One depth camera with its colour camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Short name, unique in the rig.
    pub name: String,
    /// Who it is.
    pub identity: DeviceIdentity,
    /// The depth camera.
    pub depth: PinholeCamera,
    /// Metres a depth unit (0.001 for millimetres).
    pub depth_scale: f64,
    /// The colour camera; `None` where there is no colour.
    pub color: Option<PinholeCamera>,
    /// Where the depth camera stands in the colour camera's frame; identity where colour is registered to depth.
    pub color_from_depth: Rigid,
    /// Where the depth camera stands in the rig's frame; identity for a single sensor.
    pub rig_from_depth: Rigid,
    /// Nominal frames a second; 0 where unknown.
    pub fps: f64,
}

impl Sensor {
    /// A sentence where its calibration is assumed.
    pub fn assumption(&self) -> Option<String> {
        let PinholeCamera { width, height, fx, .. } = self.depth;
        self.identity.calibration_assumed.then(|| {
            format!(
                "nobody gave the calibration of `{}`: {fx:.0} pixels of focal length are assumed for {width} x {height}, and \
                 lengths may be wrong by a fifth; write the true one into camera.json beside the images and import again",
                self.name
            )
        })
    }
}

/// One or more sensors that record together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Rig {
    /// The sensors; frames name them by index.
    pub sensors: Vec<Sensor>,
}
