//! Where a motion stands: on the floor, starting at the origin, or staying there.

use nalgebra::Vector3;
use toile_character::{Joint, Pose, Skeleton};

const FOOT_JOINTS: [Joint; 4] = [Joint::LeftFoot, Joint::LeftToes, Joint::RightFoot, Joint::RightToes];

/// Share of the poses that may have a foot below the floor when the floor is chosen: single bad frames of a
/// capture do not lift the whole motion.
const BELOW_FLOOR_SHARE: f64 = 0.02;

/// Moves the whole motion so that the lowest feet stand on the floor (their joints at rest height) and the hips
/// start above the origin. Where the source's hips never rise or sink, which hand-keyed cycles do, each pose is
/// set on the floor by itself.
pub(crate) fn place(target: &Skeleton, poses: &mut [Pose]) {
    const FIXED_HEIGHT: f64 = 1e-4; // metres
    let heights: Vec<f64> = poses.iter().map(|p| foot_height(target, p)).collect();
    let hips = |p: &Pose| target.position(Joint::Hips).y + p.translation.y;
    let (low, high) = poses.iter().map(hips).fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
    let start = poses.first().map_or_else(Vector3::zeros, |p| p.translation + target.position(Joint::Hips).coords);
    let mut sorted = heights.clone();
    sorted.sort_by(f64::total_cmp);
    let floor = sorted.get((sorted.len() as f64 * BELOW_FLOOR_SHARE) as usize).copied().unwrap_or(0.0);
    let fixed = poses.len() > 1 && high - low < FIXED_HEIGHT;
    for (pose, height) in poses.iter_mut().zip(heights) {
        pose.translation -= Vector3::new(start.x, if fixed { height } else { floor }, start.z);
    }
}

/// Takes the travel over the ground out: the path of the hips, smoothed over about a step, stays at the origin.
pub(crate) fn keep_in_place(target: &Skeleton, poses: &mut [Pose], frame_time: f64) {
    const SMOOTHING: f64 = 0.6; // seconds to either side: about a step
    let reach = (SMOOTHING / frame_time).round().max(1.0) as usize;
    let hips = target.position(Joint::Hips).coords;
    let path: Vec<Vector3<f64>> = poses.iter().map(|p| p.translation + hips).collect();
    for (i, pose) in poses.iter_mut().enumerate() {
        let reach = reach.min(i).min(path.len() - 1 - i);
        let around = &path[i - reach..=i + reach];
        let mean = around.iter().sum::<Vector3<f64>>() / around.len() as f64;
        pose.translation -= Vector3::new(mean.x, 0.0, mean.z);
    }
}

/// 98th percentile of how far the lowest foot joint is below its height at rest, metres; 0 where none is.
pub(crate) fn depth_below_floor(target: &Skeleton, poses: &[Pose]) -> f64 {
    let mut heights: Vec<f64> = poses.iter().map(|p| foot_height(target, p)).collect();
    heights.sort_by(f64::total_cmp);
    let at = (heights.len() as f64 * 0.02) as usize;
    heights.get(at).map_or(0.0, |h| (-h).max(0.0))
}

/// Height of the lowest foot joint above where it is at rest.
fn foot_height(target: &Skeleton, pose: &Pose) -> f64 {
    let frames = pose.joint_frames(target);
    FOOT_JOINTS.iter().map(|j| frames[j.index()].translation.vector.y - target.position(*j).y).fold(f64::MAX, f64::min)
}
