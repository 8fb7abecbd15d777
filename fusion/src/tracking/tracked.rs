//! The result of registering a frame.

use serde::Serialize;
use toile_geometry::Rigid;

/// The result of tracking a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tracked {
    /// The pose that was found.
    #[serde(skip)]
    pub model_from_camera: Rigid,
    /// Share of the frame's points that lie within the model's band.
    pub overlap: f64,
    /// Share of those that agree with it (within three robust standard deviations).
    pub inliers: f64,
    /// Root mean square point-to-surface distance of the inliers, metres.
    pub residual: f64,
    /// Smallest over largest eigenvalue of the normal matrix (rotations scaled by the subject's size); near 0 where a
    /// direction is not determined.
    pub conditioning: f64,
    /// Iterations of the fine stage.
    pub iterations: usize,
    /// True when the last step was negligible.
    pub converged: bool,
    /// True where the shape left a direction open and colours decided it.
    pub by_color: bool,
}

/// The pose of a frame.
pub(crate) struct Located {
    pub model_from_camera: Rigid,
    /// `None` for the first frame and known poses.
    pub tracked: Option<Tracked>,
}

impl Tracked {
    /// A pose about which nothing is known yet.
    pub(crate) fn at(pose: &Rigid) -> Self {
        Self {
            model_from_camera: *pose,
            overlap: 0.0,
            inliers: 0.0,
            residual: f64::INFINITY,
            conditioning: 0.0,
            iterations: 0,
            converged: false,
            by_color: false,
        }
    }
}
