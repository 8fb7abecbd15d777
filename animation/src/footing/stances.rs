//! When a foot stands: low and slow, with hysteresis.

use std::ops::Range;

use toile_geometry::statistics::median;

use super::track::Track;

/// A foot begins to stand below this speed of the skin that touches, metres a second: a fifth of a stroll.
const ENTER: f64 = 0.3;
/// and stands until it is faster than this: what a captured foot still moves while it is pushed off.
const LEAVE: f64 = 0.5;
/// It begins to stand within this height, metres: captures' floors, and feet of other lengths, differ by some centimetres.
const LOW: f64 = 0.04;
/// While it stands its sole keeps its height within this, metres: a foot of other length than the file's rolls by that much up.
const ROLLS: f64 = 0.025;
/// Speeds are taken over this time, seconds, so that fast cameras' noise is no speed.
const WINDOW: f64 = 1.0 / 30.0;
/// Shorter gaps, seconds, in which the foot stays within [`GAP_WAY`] metres, are no gaps.
const GAP: f64 = 0.08;
const GAP_WAY: f64 = 0.06;
/// Shorter stances, seconds, are none.
const SHORTEST: f64 = 0.03;

/// The poses in which one foot stands.
pub(super) struct Stances(pub Vec<Range<usize>>);

impl Stances {
    /// Finds them in a motion of `frame_time` seconds a pose.
    pub fn of(track: &Track, frame_time: f64) -> Self {
        if track.heights.len() == 1 {
            return Self(std::iter::once(0..1).filter(|_| track.heights[0] < LOW).collect());
        }
        let speeds = speeds(track, frame_time);
        let mut steps: Vec<Range<usize>> = Vec::new();
        let mut at = 0;
        while at < speeds.len() {
            let Some(run) = run_from(at, track, &speeds) else { break };
            at = run.end;
            match steps.last_mut() {
                Some(last) if joins(last, &run, track, frame_time) => last.end = run.end,
                _ => steps.push(run),
            }
        }
        steps.retain(|run| run.len() as f64 * frame_time > SHORTEST);
        Self(steps.into_iter().map(|run| run.start..run.end + 1).collect())
    }

    /// Number of times that it stands.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// All poses in which it stands.
    pub fn poses(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().cloned().flatten()
    }

    /// True where it stands, for each of `count` poses.
    pub fn mask(&self, count: usize) -> Vec<bool> {
        let mut mask = vec![false; count];
        self.poses().for_each(|pose| mask[pose] = true);
        mask
    }
}

/// Speed of each step: that of the way over [`WINDOW`] about it.
fn speeds(track: &Track, frame_time: f64) -> Vec<f64> {
    let steps = &track.steps;
    let reach = (0.5 * (WINDOW / frame_time - 1.0)).round().max(0.0) as usize;
    let speed = |at: usize| {
        let around = &steps[at.saturating_sub(reach)..(at + reach + 1).min(steps.len())];
        around.iter().sum::<nalgebra::Vector3<f64>>().norm() / (around.len() as f64 * frame_time)
    };
    (0..steps.len()).map(speed).collect()
}

/// The next run of steps, from step `from` on, in which the foot stands.
fn run_from(from: usize, track: &Track, speeds: &[f64]) -> Option<Range<usize>> {
    let begins = |&at: &usize| speeds[at] < ENTER && track.heights[at].max(track.heights[at + 1]) < LOW;
    let first = (from..speeds.len()).find(begins)?;
    let certain = (first..speeds.len()).take_while(begins).count();
    let level = median(&mut track.heights[first..=first + certain].to_vec()).unwrap_or(0.0);
    let stays = |at: &usize| {
        speeds[*at] < LEAVE && [*at, at + 1].iter().all(|&pose| (track.heights[pose] - level).abs() < ROLLS)
    };
    let before = (from..first).rev().take_while(stays).count();
    let after = (first + certain..speeds.len()).take_while(stays).count();
    Some(first - before..first + certain + after)
}

/// True where two runs are one stance with a gap in it.
fn joins(last: &Range<usize>, next: &Range<usize>, track: &Track, frame_time: f64) -> bool {
    let gap = last.end..next.start;
    let way: nalgebra::Vector3<f64> = track.steps[gap.clone()].iter().sum();
    gap.len() as f64 * frame_time < GAP && way.norm() < GAP_WAY
}
