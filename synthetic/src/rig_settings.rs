//! The choices of a rig of virtual sensors.

use serde::{Deserialize, Serialize};

/// Sensors of a rig at most.
pub const MAX_SENSORS: usize = 8;

/// The rig of a virtual session. The defaults are one sensor, which stands where the recording says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RigSettings {
    /// Sensors, evenly around the disk; 1..8, default 1. Their exposures interleave.
    pub sensors: usize,
    /// How far the recording's places of the sensors are from the true ones at most, metres, default 0.02.
    pub error_m: f64,
    /// How far its rotations are from the true ones at most, degrees, default 1.
    pub error_degrees: f64,
    /// How fast the clock of every second sensor runs away from the host's, parts in a million, default 0.
    pub clock_drift_ppm: f64,
    /// How far the last sensor is pushed aside in the middle of each take, metres, and turned, 0.2° a millimetre; default 0.
    pub knock_m: f64,
    /// Share of the pixels that a sensor loses to the light of the others, in lumps, 0..0.5, default 0. What is left there is
    /// twice as noisy.
    pub interference: f64,
    /// How far sensors on motors shake against interference (standard deviation), degrees, 0..0.3, default 0.
    pub shake_degrees: f64,
}

impl Default for RigSettings {
    fn default() -> Self {
        Self {
            sensors: 1,
            error_m: 0.02,
            error_degrees: 1.0,
            clock_drift_ppm: 0.0,
            knock_m: 0.0,
            interference: 0.0,
            shake_degrees: 0.0,
        }
    }
}
