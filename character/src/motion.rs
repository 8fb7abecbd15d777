//! A pose over time.

use crate::Pose;

/// Poses of one skeleton at a constant rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Name of the clip.
    pub name: String,
    /// Seconds between two poses; positive.
    pub frame_time: f64,
    /// The poses, relative to the rest pose of the skeleton they were made for.
    pub poses: Vec<Pose>,
}

impl Motion {
    /// Seconds from the first to the last pose.
    pub fn duration(&self) -> f64 {
        self.frame_time * self.poses.len().saturating_sub(1) as f64
    }
}
