//! What the stage decided, and how long it took.

use std::{collections::BTreeMap, time::Instant};

use serde::Serialize;

use crate::settings::FusionSettings;

/// A frame that was not fused.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DroppedFrame {
    /// Index in the source.
    pub index: u64,
    /// Device time, nanoseconds.
    pub device_time_ns: i64,
    /// Why.
    pub reason: String,
}

/// The volume that was fused.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VolumeReport {
    /// Radius of the cylinder, metres.
    pub radius_m: f64,
    /// True where a floor or disk was found.
    pub floor_found: bool,
    /// Height over the disk below which nothing is fused, metres.
    pub bottom_m: f64,
    /// Distance of the axis from the camera, metres.
    pub axis_distance_m: f64,
}

/// What the stage decided.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct FusionReport {
    /// Settings as resolved.
    pub settings: FusionSettings,
    /// Frames in the source.
    pub frames_seen: usize,
    /// Frames in the scan.
    pub frames_fused: usize,
    /// Frames left out, with reasons.
    pub dropped: Vec<DroppedFrame>,
    /// Degrees turned about the axis from the first to the last fused frame.
    pub turned_deg: f64,
    /// True when the turn is at least 340°.
    pub full_turn: bool,
    /// Degrees a second, mean.
    pub rate_deg_per_s: f64,
    /// Tilt of the axis against the floor's normal, degrees; absent without a floor or a turn.
    pub axis_tilt_deg: Option<f64>,
    /// Volume, where the subject was cut out.
    pub volume: Option<VolumeReport>,
    /// Standard deviation of the depth noise, measured on the subject, millimetres.
    pub noise_mm: f64,
    /// Truncation used: as set, or more where the noise asks for it, millimetres.
    pub truncation_mm: f64,
    /// Root mean square tracking residual, median over frames, millimetres.
    pub residual_mm: f64,
    /// The largest residual of a frame, millimetres.
    pub residual_max_mm: f64,
    /// Frame pairs in the joint optimisation.
    pub closing_pairs: usize,
    /// Frame pairs across the seam.
    pub seam_pairs: usize,
    /// Offset of the seam at the subject's centre before closing, millimetres.
    pub seam_before_mm: f64,
    /// The same after closing.
    pub seam_after_mm: f64,
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
    /// What the operator should know.
    pub warnings: Vec<String>,
}

/// Duration of one step over its calls.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct StepTiming {
    /// Calls.
    pub count: usize,
    /// Median, milliseconds.
    pub median_ms: f64,
    /// 95th percentile, milliseconds.
    pub p95_ms: f64,
    /// All calls, seconds.
    pub total_s: f64,
}

/// How long the steps took and how much they touched.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Timings {
    /// Wall time by step.
    pub steps: BTreeMap<String, StepTiming>,
    /// Whole stage, seconds.
    pub seconds: f64,
    /// Blocks of the final field.
    pub blocks: usize,
    /// Voxels that exist.
    pub voxels: usize,
    /// Voxels in the truncation band of a frame, mean.
    pub voxels_updated_per_frame: usize,
    /// Bytes of the final field.
    pub field_bytes: usize,
}

/// Collects durations by step.
#[derive(Debug, Clone)]
pub(crate) struct Stopwatch {
    start: Instant,
    samples: BTreeMap<&'static str, Vec<f64>>,
}

impl Stopwatch {
    pub(crate) fn new() -> Self {
        Self { start: Instant::now(), samples: BTreeMap::new() }
    }

    /// Runs and times one call of a step.
    pub(crate) fn time<T>(&mut self, step: &'static str, run: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let value = run();
        self.samples.entry(step).or_default().push(start.elapsed().as_secs_f64());
        value
    }

    pub(crate) fn timings(&self) -> Timings {
        let summary = |seconds: &Vec<f64>| {
            let mut sorted = seconds.clone();
            sorted.sort_unstable_by(f64::total_cmp);
            let at = |q: f64| sorted[((sorted.len() - 1) as f64 * q).round() as usize] * 1e3;
            StepTiming { count: sorted.len(), median_ms: at(0.5), p95_ms: at(0.95), total_s: sorted.iter().sum() }
        };
        Timings {
            steps: self.samples.iter().map(|(k, v)| ((*k).to_string(), summary(v))).collect(),
            seconds: self.start.elapsed().as_secs_f64(),
            ..Timings::default()
        }
    }
}
