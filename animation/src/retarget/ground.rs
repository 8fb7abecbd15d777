//! The place of a motion: on the floor, starting at the origin, or staying there.

use nalgebra::Vector3;
use toile_character::{Joint, Pose, Skeleton, soles::Soles};
use toile_geometry::statistics::{Rank, median, quantile_by};

/// Moves the whole motion so that standing feet stand on the floor and the hips start above the origin. Where the
/// source's hips never rise or sink, which hand-keyed cycles do, each pose is set on the floor separately.
pub(super) fn place(soles: &Soles, poses: &mut [Pose]) {
    const FIXED_HEIGHT: f64 = 1e-4; // metres
    let target = soles.skeleton();
    let heights: Vec<f64> = poses.iter().map(|p| lowest_foot(soles, p).1).collect();
    let hips = |p: &Pose| target.position(Joint::Hips).y + p.translation.y;
    let (low, high) = poses.iter().map(hips).fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
    let start = poses.first().map_or_else(Vector3::zeros, |p| p.translation + target.position(Joint::Hips).coords);
    let floor = floor_height(soles, poses);
    let fixed = poses.len() > 1 && high - low < FIXED_HEIGHT;
    for (pose, height) in poses.iter_mut().zip(heights) {
        pose.translation -= Vector3::new(start.x, if fixed { height } else { floor }, start.z);
    }
}

/// The height that feet stand at: of the poses in which the ankle of the lower foot is slowest, the median. Feet
/// that roll over heel or ball are in motion, and so are feet in the air.
fn floor_height(soles: &Soles, poses: &[Pose]) -> f64 {
    const STANDING_SHARE: f64 = 0.3;
    let ankle = |p: &Pose, foot: Joint| p.joint_frames(soles.skeleton())[foot.index()].translation.vector;
    let mut standing: Vec<(f64, f64)> = Vec::with_capacity(poses.len());
    for (i, pose) in poses.iter().enumerate() {
        let (foot, height) = lowest_foot(soles, pose);
        let other = &poses[if i + 1 < poses.len() { i + 1 } else { i.saturating_sub(1) }];
        standing.push(((ankle(pose, foot) - ankle(other, foot)).norm(), height));
    }
    standing.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let count = ((standing.len() as f64 * STANDING_SHARE).ceil() as usize).min(standing.len());
    let mut heights: Vec<f64> = standing[..count].iter().map(|s| s.1).collect();
    median(&mut heights).unwrap_or(0.0)
}

/// Removes the travel over the ground: the path of the hips, smoothed over about a step, stays at the origin.
pub(super) fn keep_in_place(target: &Skeleton, poses: &mut [Pose], frame_time: f64) {
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

/// 98th percentile of how far the lowest foot is below the floor, metres; 0 where it never is.
pub(super) fn depth_below_floor(soles: &Soles, poses: &[Pose]) -> f64 {
    let mut heights: Vec<f64> = poses.iter().map(|p| soles.height(p)).collect();
    quantile_by(&mut heights, 0.02, Rank::Count).map_or(0.0, |h| (-h).max(0.0))
}

/// The lower foot and the height of its sole above the floor, its toes bent as the floor would bend them.
fn lowest_foot(soles: &Soles, pose: &Pose) -> (Joint, f64) {
    let [left, right] = soles.feet().each_ref().map(|sole| (sole.leg.foot, soles.roll(sole, &mut pose.clone())));
    if left.1 <= right.1 { left } else { right }
}
