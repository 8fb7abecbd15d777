//! First frames that are poses for calibration.

use toile_geometry::statistics::median;

use crate::{Bvh, bvh::Channel};

/// True where the first frame is a pose for calibration that the motion jumps out of: nearly zero rotations, then
/// a step many times as large as the usual ones.
pub(super) fn starts_with_calibration(bvh: &Bvh) -> bool {
    const NEARLY_ZERO: f64 = 8.0; // degrees, a channel
    const JUMP: f64 = 5.0; // times the median step
    if bvh.frames.len() < 4 {
        return false;
    }
    let rotations: Vec<bool> =
        bvh.joints.iter().flat_map(|j| j.channels.iter().map(|c| matches!(c, Channel::Rotation(_)))).collect();
    let still = bvh.frames[0].iter().zip(&rotations).all(|(v, rotation)| !rotation || v.abs() < NEARLY_ZERO);
    let step = |i: usize| {
        let (a, b) = (bvh.joint_frames(i), bvh.joint_frames(i + 1));
        a.iter().zip(&b).map(|(a, b)| a.rotation.angle_to(&b.rotation)).fold(0.0, f64::max)
    };
    let mut steps: Vec<f64> = (1..bvh.frames.len().min(60) - 1).map(step).collect();
    still && step(0) > JUMP * median(&mut steps).unwrap_or(0.0).max(1e-3)
}
