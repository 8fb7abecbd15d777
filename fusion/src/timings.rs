//! How long the steps of the stage took.

use std::{collections::BTreeMap, time::Instant};

use serde::Serialize;
use toile_geometry::statistics::{Rank, quantile_of_sorted, sort};

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
    /// Median processor time, milliseconds; 0 where the system does not say.
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

/// Processor time of this process so far, all threads, seconds; 0 where the system does not say.
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
            sort(&mut values);
            values
        };
        let (wall, cpu) = (sorted(0), sorted(1));
        let at_ms = |values: &[f64], q: f64| quantile_of_sorted(values, q, Rank::Nearest).unwrap_or(0.0) * 1e3;
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
