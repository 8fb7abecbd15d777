//! What was found about the sensors of a rig.

use toile_geometry::Rigid;

use super::{member::Member, moved::Push};

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

impl FoundSensor {
    /// A sensor of which nothing is known but where it stands: before a subject that does not turn clocks do not matter.
    pub(crate) fn resting(member: &Member, place: &Rigid) -> Self {
        Self {
            sensor: member.sensor,
            frames_seen: member.len(),
            noise: member.noise,
            drift_ppm: 0.0,
            by_arrival: false,
            room_from_camera: *place,
            push: None,
        }
    }
}

/// What was found about the further sensors.
#[derive(Debug, Clone, Default)]
pub(crate) struct RigFound {
    pub sensors: Vec<FoundSensor>,
    /// Drift of the leading sensor's clock, parts in a million.
    pub leading_ppm: f64,
}
