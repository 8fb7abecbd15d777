//! The choices of a caller; every field has a default that suits a person on a turntable.

use serde::{Deserialize, Serialize};
use toile_geometry::Rigid;

use crate::FusionError;

/// A known pose belongs to a frame whose device time is at most this far from its own, nanoseconds.
pub(crate) const KNOWN_POSE_WITHIN_NS: i64 = 5_000_000;

/// The frames that are fused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Volume {
    /// The subject that turns before a resting camera: floor, disk, walls and what rests are cut away.
    #[default]
    Auto,
    /// Everything that the sensor saw (a room, a hand-held camera).
    All,
}

/// The assumption about the motion between frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Prior {
    /// The subject turns about a resting axis; axis and rate are found from the data.
    #[default]
    Turntable,
    /// Nothing but that the motion goes on as before.
    None,
}

/// A pose known beforehand, matched to frames by device time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct KnownPose {
    /// Device time of the frame, nanoseconds.
    pub device_time_ns: i64,
    /// Pose of the depth camera; the scan comes out in this frame.
    pub scan_from_camera: Rigid,
}

/// Settings of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FusionSettings {
    /// Edge of a voxel, metres. Default 0.004. Smaller resolves more and costs its inverse square.
    pub voxel_size: f64,
    /// Truncation distance of the signed distance field, metres. Default 0.016; at least two voxels.
    pub truncation: f64,
    /// The surfaces that are fused. Default: the subject alone.
    pub volume: Volume,
    /// Assumption about the motion. Default: a turntable.
    pub prior: Prior,
    /// Known poses; `None` (default) to track. Frames without one (nearest time within 5 ms) are dropped.
    pub poses: Option<Vec<KnownPose>>,
    /// A pixel is an edge, and dropped, where its depth differs from a neighbour's by more than this many pixel
    /// widths (the tangent of the incidence angle). Default 8.3: 50 mm at 2.2 m with a focal length of 365 pixels.
    pub jump_slope: f64,
    /// Depth beyond this is not used, metres. Default 6.
    pub max_depth: f64,
    /// Rounds of joint optimisation of all poses over frame pairs after tracking (0: none). Default 8.
    pub closing_rounds: usize,
    /// Rounds of "fuse, then register every frame to the whole model" after closing. Default 2.
    pub refine_rounds: usize,
    /// Triangles of the finished scan, about. Default 80 000; 0 keeps all.
    pub target_triangles: usize,
    /// Close all holes, mark them in the attribute `filled`. Default true; a room is never closed.
    pub fill_holes: bool,
    /// Passes of non-shrinking smoothing. Default 5.
    pub smoothing_passes: usize,
    /// Height of the subject's highest point, as it stands there, over what it stands on, metres; 0 (default): not known.
    /// The scan is scaled to it, so that a sensor whose depth is a few thousandths too long or short is set right.
    pub known_height: f64,
}

impl Default for FusionSettings {
    fn default() -> Self {
        Self {
            voxel_size: 0.004,
            truncation: 0.016,
            volume: Volume::Auto,
            prior: Prior::Turntable,
            poses: None,
            jump_slope: 8.3,
            max_depth: 6.0,
            closing_rounds: 8,
            refine_rounds: 2,
            target_triangles: 80_000,
            fill_holes: true,
            smoothing_passes: 5,
            known_height: 0.0,
        }
    }
}

impl FusionSettings {
    /// Checks every range.
    ///
    /// # Errors
    /// [`FusionError::Settings`] names the first setting that is out of its range.
    pub(crate) fn check(&self) -> Result<(), FusionError> {
        if !(self.voxel_size > 1e-4 && self.voxel_size < 0.2) {
            return Err(FusionError::Settings("voxel_size must be between 0.1 mm and 0.2 m".into()));
        }
        if !(self.truncation >= 2.0 * self.voxel_size && self.truncation < 1.0) {
            return Err(FusionError::Settings("truncation must be at least two voxels and less than 1 m".into()));
        }
        if !(self.known_height == 0.0 || (0.1..=3.0).contains(&self.known_height)) {
            return Err(FusionError::Settings(
                "known_height must be between 0.1 and 3 m, or 0 where it is not known".into(),
            ));
        }
        Ok(())
    }
}
