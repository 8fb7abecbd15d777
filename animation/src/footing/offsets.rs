//! How far a foot is moved so that it stands still on the floor, and comes back to its way in the air.

use nalgebra::Vector3;

use super::{smooth::averaged, stances::Stances, track::Track};

/// Farthest that a foot is moved along the floor, metres: a file whose feet slide further in one stance, as on ice, slides on.
const MOST: f64 = 0.08;
/// Two stances this near to each other, seconds, hold each other's displacement as much as a stance of that length holds its own.
const SHORT: f64 = 0.2;
/// Sweeps of the solution by Gauss and Seidel: a pull goes over as many stances.
const SWEEPS: usize = 40;
/// Seconds in which the speed that a foot leaves the floor with, or comes to it with, is blended.
const BLEND: f64 = 0.25;
/// Seconds of a stance over which that speed is taken.
const SLOPE: f64 = 0.017;
/// Seconds to either side over which the corners of displacements are rounded; less than a frame of usual files.
const ROUND: f64 = 0.017;

/// Displacement of the foot in every pose, metres: in stances such that it does not slip and is on the floor, between them
/// from one to the next without a jump in speed.
pub(super) fn of(track: &Track, stances: &Stances, frame_time: f64) -> Vec<Vector3<f64>> {
    let count = track.heights.len();
    let mut offsets = vec![Vector3::zeros(); count];
    let mut all: Vec<Vec<Vector3<f64>>> = stances.0.iter().map(|stance| held(track, stance.clone())).collect();
    bring_together(&mut all, stances, frame_time);
    for (stance, held) in stances.0.iter().zip(&all) {
        offsets[stance.clone()].copy_from_slice(held);
    }
    let blend = (BLEND / frame_time).round().max(1.0);
    let over = (SLOPE / frame_time).round().max(1.0) as usize;
    for (left, right) in gaps(stances, count) {
        let slopes = slopes(&offsets, stances, (left, right), over);
        fill(&mut offsets, (left, right), slopes, blend);
    }
    rounded(&offsets, (ROUND / frame_time).floor() as usize)
}

/// The displacements without the corners of stances' ends and without a fast camera's noise: means over `reach` poses to both
/// sides, twice.
fn rounded(offsets: &[Vector3<f64>], reach: usize) -> Vec<Vector3<f64>> {
    let of = |axis: usize| {
        let values: Vec<f64> = offsets.iter().map(|o| o[axis]).collect();
        averaged(&averaged(&values, reach), reach)
    };
    let [x, y, z] = [0, 1, 2].map(of);
    (0..offsets.len()).map(|k| Vector3::new(x[k], y[k], z[k])).collect()
}

/// The displacements within a stance: what the sole slips, taken back, about its mean place.
fn held(track: &Track, stance: std::ops::Range<usize>) -> Vec<Vector3<f64>> {
    let mut at = Vector3::zeros();
    let mut held = vec![at];
    for pose in stance.start..stance.end - 1 {
        at -= Vector3::new(track.steps[pose].x, 0.0, track.steps[pose].z);
        held.push(at);
    }
    let (low, high) = held.iter().fold((held[0], held[0]), |(low, high), o| (low.inf(o), high.sup(o)));
    let middle = 0.5 * (low + high);
    let furthest = held.iter().map(|o| (o - middle).norm()).fold(0.0, f64::max);
    let share = if furthest > MOST { MOST / furthest } else { 1.0 };
    let place = |(o, height): (&Vector3<f64>, &f64)| (o - middle) * share - Vector3::y() * *height;
    held.iter().zip(&track.heights[stance]).map(place).collect()
}

/// Shifts whole stances along the floor so that those with little time between them are displaced alike: least squares of the shifts, by
/// the stances' seconds, and of the changes in the gaps.
fn bring_together(all: &mut [Vec<Vector3<f64>>], stances: &Stances, frame_time: f64) {
    let ends: Vec<(Vector3<f64>, Vector3<f64>)> = all.iter().filter_map(|h| Some((*h.first()?, *h.last()?))).collect();
    let pull = |i: usize| {
        let gap = (stances.0[i + 1].start + 1 - stances.0[i].end) as f64 * frame_time;
        SHORT * (SHORT / gap).powi(2)
    };
    let mut shifts = vec![Vector3::zeros(); all.len()];
    for _ in 0..SWEEPS {
        for i in 0..all.len() {
            let (mut sum, mut weights) = (Vector3::zeros(), all[i].len() as f64 * frame_time);
            if i > 0 {
                sum += (shifts[i - 1] + ends[i - 1].1 - ends[i].0) * pull(i - 1);
                weights += pull(i - 1);
            }
            if i + 1 < all.len() {
                sum += (shifts[i + 1] + ends[i + 1].0 - ends[i].1) * pull(i);
                weights += pull(i);
            }
            shifts[i] = Vector3::new(sum.x, 0.0, sum.z) / weights;
        }
    }
    for (held, shift) in all.iter_mut().zip(shifts) {
        held.iter_mut().for_each(|o| *o += shift);
    }
}

/// The last pose of each stance with the first of the next; `None` at the ends of the motion.
fn gaps(stances: &Stances, count: usize) -> Vec<(Option<usize>, Option<usize>)> {
    let Some((first, last)) = stances.0.first().zip(stances.0.last()) else { return Vec::new() };
    let mut gaps = Vec::new();
    if first.start > 0 {
        gaps.push((None, Some(first.start)));
    }
    gaps.extend(stances.0.windows(2).map(|pair| (Some(pair[0].end - 1), Some(pair[1].start))));
    if last.end < count {
        gaps.push((Some(last.end - 1), None));
    }
    gaps
}

/// Change of the offsets a pose before and after a gap, the mean over at most `over` poses of the stances.
fn slopes(
    offsets: &[Vector3<f64>],
    stances: &Stances,
    (left, right): (Option<usize>, Option<usize>),
    over: usize,
) -> [Vector3<f64>; 2] {
    let stance = |pose: usize| stances.0.iter().find(|s| s.contains(&pose)).cloned().unwrap_or(pose..pose + 1);
    let slope = |from: usize, to: usize| match to - from {
        0 => Vector3::zeros(),
        poses => (offsets[to] - offsets[from]) / poses as f64,
    };
    let out = left.map(|l| slope(l.saturating_sub(over).max(stance(l).start), l));
    let back = right.map(|r| slope(r, (r + over).min(stance(r).end - 1)));
    [out, back].map(Option::unwrap_or_default)
}

/// Fills a gap: smoothly from one offset to the other, the slopes at its ends carried on and blended out in `blend` poses.
fn fill(
    offsets: &mut [Vector3<f64>],
    (left, right): (Option<usize>, Option<usize>),
    slopes: [Vector3<f64>; 2],
    blend: f64,
) {
    let start = offsets[left.or(right).unwrap_or(0)];
    let end = offsets[right.or(left).unwrap_or(0)];
    let length = left.zip(right).map(|(l, r)| (r - l) as f64);
    let window = length.map_or(blend, |length| length.min(blend));
    // the tangent of a cubic Hermite spline over `window` poses, `at` poses from its end
    let tangent = |slope: Vector3<f64>, at: f64| {
        let u = (at / window).min(1.0);
        slope * window * (u * (1.0 - u) * (1.0 - u))
    };
    for pose in left.map_or(0, |l| l + 1)..right.unwrap_or(offsets.len()) {
        let share = length.zip(left).map_or(0.0, |(length, l)| (pose - l) as f64 / length);
        let eased = share * share * (3.0 - 2.0 * share);
        let out = left.map_or_else(Vector3::zeros, |l| tangent(slopes[0], (pose - l) as f64));
        let back = right.map_or_else(Vector3::zeros, |r| tangent(slopes[1], (r - pose) as f64));
        offsets[pose] = start + (end - start) * eased + out - back;
    }
}
