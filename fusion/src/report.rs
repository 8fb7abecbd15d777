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
    /// Sensors of the rig that gave depth but are not in the scan: it is made from the first sensor alone.
    pub sensors_not_used: Vec<String>,
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
    /// Least conditioning of a frame's registration: below 0.005 the shape hardly tells a direction.
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

/// Duration of one step over its calls: wall time, and processor time of the whole process in it (all threads).
/// Beside other work wall time is longer; with one thread and an idle machine both are the same.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct StepTiming {
    /// Calls.
    pub count: usize,
    /// Median wall time, milliseconds.
    pub median_ms: f64,
    /// 95th percentile of the wall time, milliseconds.
    pub p95_ms: f64,
    /// Wall time of all calls, seconds.
    pub total_s: f64,
    /// Median processor time, milliseconds; 0 where the system does not tell.
    pub cpu_median_ms: f64,
    /// 95th percentile of the processor time, milliseconds.
    pub cpu_p95_ms: f64,
    /// Processor time of all calls, seconds.
    pub cpu_total_s: f64,
}

/// How long the steps took and how much they touched: what `timings.json` says of this stage, beside the run's `seconds`,
/// `threads` and `peak_memory_bytes`.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Timings {
    /// By step. Of a pushed frame: `unpack`, `filter`, `cut`, `normals`, `track` (or `first turn`, `relocalise`),
    /// `integrate`. Of a frame that is fused again: `integrate again` or `integrate with colour`; `prepare again` is
    /// 16 frames' normals and colours. Of the take: `read`, `survey`, `close`, `refine`, `extract`, `clean up`.
    pub steps: BTreeMap<String, StepTiming>,
    /// Whole stage, wall seconds.
    pub seconds: f64,
    /// Whole stage, processor seconds of all threads.
    pub cpu_seconds: f64,
    /// Instructions that the voxel update used on this processor, such as `avx2`; `scalar` where there are none.
    pub simd: String,
    /// Blocks of the final field.
    pub blocks: usize,
    /// Voxels that exist.
    pub voxels: usize,
    /// Voxels of the blocks in the truncation band of a frame, mean over frames: those that are looked at.
    pub voxels_touched_per_frame: usize,
    /// Voxels that a frame changed, mean over frames.
    pub voxels_updated_per_frame: usize,
    /// Bytes of the final field.
    pub field_bytes: usize,
}

/// A moment: wall clock and the process' processor time.
#[derive(Debug, Clone, Copy)]
struct Moment {
    wall: Instant,
    cpu_s: f64,
}

impl Moment {
    fn now() -> Self {
        Self { wall: Instant::now(), cpu_s: cpu_seconds() }
    }

    /// Wall and processor seconds since.
    fn elapsed(&self) -> [f64; 2] {
        [self.wall.elapsed().as_secs_f64(), cpu_seconds() - self.cpu_s]
    }
}

/// Processor time of this process so far, all threads, seconds; 0 where the system does not tell.
#[cfg(unix)]
fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(not(unix))]
fn cpu_seconds() -> f64 {
    0.0
}

/// Collects durations by step.
#[derive(Debug, Clone)]
pub(crate) struct Stopwatch {
    start: Moment,
    samples: BTreeMap<&'static str, Vec<[f64; 2]>>,
}

impl Stopwatch {
    pub(crate) fn new() -> Self {
        Self { start: Moment::now(), samples: BTreeMap::new() }
    }

    /// Runs and times one call of a step.
    pub(crate) fn time<T>(&mut self, step: &'static str, run: impl FnOnce() -> T) -> T {
        let start = Moment::now();
        let value = run();
        self.samples.entry(step).or_default().push(start.elapsed());
        value
    }

    pub(crate) fn timings(&self) -> Timings {
        let [seconds, cpu_seconds] = self.start.elapsed();
        let steps = self.samples.iter().map(|(step, calls)| ((*step).to_string(), StepTiming::new(calls))).collect();
        Timings { steps, seconds, cpu_seconds, ..Timings::default() }
    }
}

impl StepTiming {
    /// The summary of calls of [wall, processor] seconds.
    fn new(calls: &[[f64; 2]]) -> Self {
        let sorted = |which: usize| {
            let mut values: Vec<f64> = calls.iter().map(|c| c[which]).collect();
            values.sort_unstable_by(f64::total_cmp);
            values
        };
        let (wall, cpu) = (sorted(0), sorted(1));
        let at_ms = |values: &[f64], q: f64| values[((values.len() - 1) as f64 * q).round() as usize] * 1e3;
        Self {
            count: calls.len(),
            median_ms: at_ms(&wall, 0.5),
            p95_ms: at_ms(&wall, 0.95),
            total_s: wall.iter().sum(),
            cpu_median_ms: at_ms(&cpu, 0.5),
            cpu_p95_ms: at_ms(&cpu, 0.95),
            cpu_total_s: cpu.iter().sum(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_are_summed_up_by_step() {
        let timing = StepTiming::new(&[[0.004, 0.002], [0.001, 0.001], [0.010, 0.003]]);
        assert_eq!((timing.count, timing.median_ms, timing.p95_ms), (3, 4.0, 10.0));
        assert!((timing.total_s - 0.015).abs() < 1e-12 && (timing.cpu_total_s - 0.006).abs() < 1e-12);
        assert_eq!((timing.cpu_median_ms, timing.cpu_p95_ms), (2.0, 3.0));
    }

    #[test]
    fn waiting_costs_no_processor_time_and_work_does() {
        let mut clock = Stopwatch::new();
        clock.time("wait", || std::thread::sleep(std::time::Duration::from_millis(20)));
        let sum = clock.time("work", || (0..3_000_000u64).map(std::hint::black_box).sum::<u64>());
        let timings = clock.timings();
        assert!(sum > 0 && timings.steps["wait"].median_ms >= 20.0);
        assert!(timings.cpu_seconds >= timings.steps["work"].cpu_total_s && timings.seconds >= 0.02);
        if cfg!(unix) {
            assert!(timings.steps["work"].cpu_total_s > 0.0);
        }
    }
}
