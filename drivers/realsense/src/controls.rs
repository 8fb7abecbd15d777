//! Laser, exposure and preset: controls of the depth part's extension unit.
//!
//! Selectors and their bytes: `DS5_*` of librealsense `src/ds/ds-private.h` and the options that use them in
//! `src/ds/d400/d400-device.cpp`, `src/ds/ds-active-common.cpp`, `src/ds/ds-options.cpp`.

use serde::{Deserialize, Serialize};
use toile_driver_transport::video::VideoNode;

use crate::{RealsenseError, monitor::UNIT};

/// Emitter (one byte), exposure (four, microseconds), laser power (two, milliwatts), preset (one), exposure by itself (one).
const EMITTER: u8 = 2;
const EXPOSURE: u8 = 3;
const LASER_POWER: u8 = 4;
const PRESET: u8 = 6;
const AUTO_EXPOSURE: u8 = 0x0b;

/// How the infrared cameras are exposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Exposure {
    /// By the camera itself.
    Auto,
    /// This exposure, microseconds.
    Microseconds(u32),
}

/// Controls that are set when the camera is opened; `None` leaves a control as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Controls {
    /// The laser on or off.
    pub laser: Option<bool>,
    /// Its power, milliwatts: 0 to 360 in steps of 30.
    pub laser_power: Option<u16>,
    /// Exposure.
    pub exposure: Option<Exposure>,
    /// The firmware's preset (hardware pipe configuration) by its number.
    pub preset: Option<u8>,
}

impl Controls {
    /// Sets them.
    ///
    /// # Errors
    /// [`RealsenseError::Transport`] where the camera refuses one.
    pub fn apply(&self, node: &mut dyn VideoNode) -> Result<(), RealsenseError> {
        // A preset sets others, so it comes first.
        if let Some(preset) = self.preset {
            node.extension_set(UNIT, PRESET, &[preset])?;
        }
        if let Some(is_on) = self.laser {
            node.extension_set(UNIT, EMITTER, &[is_on.into()])?;
        }
        if let Some(power) = self.laser_power {
            node.extension_set(UNIT, LASER_POWER, &power.to_le_bytes())?;
        }
        match self.exposure {
            Some(Exposure::Auto) => node.extension_set(UNIT, AUTO_EXPOSURE, &[1])?,
            Some(Exposure::Microseconds(time)) => {
                node.extension_set(UNIT, AUTO_EXPOSURE, &[0])?;
                node.extension_set(UNIT, EXPOSURE, &time.to_le_bytes())?;
            }
            None => {}
        }
        Ok(())
    }

    /// Reads them.
    ///
    /// # Errors
    /// [`RealsenseError::Transport`] where the camera refuses one.
    pub fn read(node: &mut dyn VideoNode) -> Result<Self, RealsenseError> {
        let (mut emitter, mut auto, mut preset, mut power, mut time) = ([0], [0], [0], [0; 2], [0; 4]);
        node.extension_get(UNIT, EMITTER, &mut emitter)?;
        node.extension_get(UNIT, AUTO_EXPOSURE, &mut auto)?;
        node.extension_get(UNIT, PRESET, &mut preset)?;
        node.extension_get(UNIT, LASER_POWER, &mut power)?;
        node.extension_get(UNIT, EXPOSURE, &mut time)?;
        let is_auto = auto[0] != 0;
        Ok(Self {
            laser: Some(emitter[0] != 0),
            laser_power: Some(u16::from_le_bytes(power)),
            exposure: Some(if is_auto { Exposure::Auto } else { Exposure::Microseconds(u32::from_le_bytes(time)) }),
            preset: Some(preset[0]),
        })
    }
}
