//! What was found about the sensors of a rig.

use toile_geometry::Rigid;

use super::moved::Push;

/// A further sensor whose place was found.
#[derive(Debug, Clone)]
pub(crate) struct FoundSensor {
    pub sensor: usize,
    pub frames_seen: usize,
    pub noise: f64,
    pub drift_ppm: f64,
    /// Its device times cannot be used.
    pub by_arrival: bool,
    /// The place by all frames together, room frame.
    pub room_from_camera: Rigid,
    pub push: Option<(Push, f64)>,
}

/// What was found about the further sensors.
#[derive(Debug, Clone, Default)]
pub(crate) struct RigFound {
    pub sensors: Vec<FoundSensor>,
    /// Drift of the leading sensor's clock, parts in a million.
    pub leading_ppm: f64,
}
