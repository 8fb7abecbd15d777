//! The decisions of the stage.

use serde::{Deserialize, Serialize};

use crate::{drop_reason::DropReason, settings::FusionSettings, subject::ImageSide};

/// A frame that was not fused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DroppedFrame {
    /// Index in the source.
    pub index: u64,
    /// Device time, nanoseconds.
    pub device_time_ns: i64,
    /// Why.
    pub reason: DropReason,
}

/// The volume that was fused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VolumeReport {
    /// Radius of the cylinder, metres.
    pub radius_m: f64,
    /// True where a floor or disk was found.
    pub floor_found: bool,
    /// Height over the disk below which nothing is fused, metres.
    pub bottom_m: f64,
    /// Distance of the axis from the camera, metres.
    pub axis_distance_m: f64,
    /// The side of the image that is up.
    pub image_up: ImageSide,
    /// How far a bent lens that the calibration does not have would bend the floor as it is seen, root mean square,
    /// millimetres; absent without a floor.
    pub floor_bend_mm: Option<f64>,
}

/// A camera that was moved within a take.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MovedReport {
    /// How long after the sensor's first frame, seconds.
    pub after_s: f64,
    /// How far, millimetres.
    pub shift_mm: f64,
    /// By what angle, degrees.
    pub angle_deg: f64,
}

/// A sensor of a rig.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorReport {
    /// Its name.
    pub name: String,
    /// True where it was found where it stands; else it is not in the scan.
    pub is_placed: bool,
    /// Its frames with depth.
    pub frames_seen: usize,
    /// Those of them in the scan.
    pub frames_fused: usize,
    /// Standard deviation of its depth noise, millimetres.
    pub noise_mm: f64,
    /// By how much its clock runs faster than the host's, parts in a million.
    pub clock_drift_ppm: f64,
    /// Its device times jump: its frames are placed by when they arrived.
    pub clock_is_unsteady: bool,
    /// Where it was found to stand in the rig's frame, metres, as a rig file has it. The leading sensor stays.
    pub position_m: [f64; 3],
    /// How it is turned there: axis times angle, degrees.
    pub rotation_deg: [f64; 3],
    /// How far that is from where the recording says, millimetres.
    pub departs_mm: f64,
    /// The same, degrees.
    pub departs_deg: f64,
    /// How far its single frames are from that place at the subject, median, millimetres.
    pub spread_mm: f64,
    /// Where it moved against the leading sensor within the take.
    pub moved: Option<MovedReport>,
}

/// The decisions of the stage.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FusionReport {
    /// Settings as resolved.
    pub settings: FusionSettings,
    /// Frames in the source.
    pub frames_seen: usize,
    /// Frames in the scan.
    pub frames_fused: usize,
    /// Frames left out, with reasons.
    pub dropped: Vec<DroppedFrame>,
    /// Sensors of the rig that gave depth but are not in the scan.
    pub sensors_not_used: Vec<String>,
    /// The sensors of a rig; nothing for a single one.
    #[serde(default)]
    pub sensors: Vec<SensorReport>,
    /// True where nothing turned: the subject stood still before resting sensors all around.
    #[serde(default)]
    pub stands_still: bool,
    /// Degrees turned about the axis from the first to the last fused frame.
    pub turned_deg: f64,
    /// True when the turn is at least 340°, or when the step that closes it is about as wide as the widest one in it.
    pub full_turn: bool,
    /// Degrees a second, mean.
    pub rate_deg_per_s: f64,
    /// Tilt of the axis against the normal of the floor, or without one against the upright of the image, degrees; absent
    /// without a turn.
    pub axis_tilt_deg: Option<f64>,
    /// Volume, where the subject was cut out.
    pub volume: Option<VolumeReport>,
    /// Standard deviation of the depth noise, measured on the subject, millimetres.
    pub noise_mm: f64,
    /// Standard deviation of the noise along the surface's normals, measured against the whole, millimetres; 0 where it was
    /// not measured.
    pub noise_whole_mm: f64,
    /// That of the noisiest twentieth of the surface.
    pub noise_widest_mm: f64,
    /// Correlation of the noise of pixels four apart, 0 (independent) to 1 (blotches).
    pub noise_correlation: f64,
    /// Truncation used: as set, or more where the noise asks for it, millimetres.
    pub truncation_mm: f64,
    /// Root mean square tracking residual, median over frames, millimetres.
    pub residual_mm: f64,
    /// The largest residual of a frame, millimetres.
    pub residual_max_mm: f64,
    /// Smallest conditioning of a frame's registration: below 0.005 the shape leaves a direction open.
    pub conditioning_least: f64,
    /// Frames whose open direction colours decided.
    pub frames_by_color: usize,
    /// Frame pairs in the joint optimisation.
    pub closing_pairs: usize,
    /// Frame pairs across the seam.
    pub seam_pairs: usize,
    /// Offset of the seam at the subject's centre before closing, millimetres.
    pub seam_before_mm: f64,
    /// The same after closing.
    pub seam_after_mm: f64,
    /// Height of the scan's highest point over its zero, metres.
    pub height_m: f64,
    /// What the scan was multiplied by so that its height is the known one; 1 where none is known or they do not fit.
    pub scaled_by: f64,
    /// Triangles before clean-up.
    pub triangles_raw: usize,
    /// Triangles of the scan.
    pub triangles: usize,
    /// Holes closed.
    pub holes_filled: usize,
    /// Share of the scan's area that was filled, percent.
    pub filled_percent: f64,
    /// True when the scan is closed.
    pub watertight: bool,
    /// Warnings for the operator.
    pub warnings: Vec<String>,
}
