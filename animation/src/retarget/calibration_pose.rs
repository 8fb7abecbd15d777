//! First frames that are poses for calibration.

use toile_geometry::statistics::median;

use crate::{Bvh, bvh::Channel};

/// Largest rotation of a channel in a pose for calibration, degrees: legs stand apart by 17 to 21 in the T-poses that
/// conversions of motion capture archives put before the motion.
const NEARLY_ZERO: f64 = 25.0;
/// The motion jumps out of it by at least this many times the median of its steps,
const JUMP: f64 = 5.0;
/// and by at least this, radians: more than a limb turns between two frames.
const SMALLEST_JUMP: f64 = 0.26;
/// Steps whose median is taken.
const STEPS: usize = 60;

/// True where the first frame is a pose for calibration that the motion jumps out of: small rotations, then a step many
/// times as large as the usual ones.
pub(super) fn starts_with_calibration(bvh: &Bvh) -> bool {
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
    let mut steps: Vec<f64> = (1..bvh.frames.len().min(STEPS) - 1).map(step).collect();
    still && step(0) > SMALLEST_JUMP.max(JUMP * median(&mut steps).unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::parse;

    /// A leg that hangs from the hips, with rotations about Z, degrees a frame.
    fn starts_so(hips: &[f64]) -> bool {
        let skeleton = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 90 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation \
                        Xrotation Yrotation\nJOINT LeftUpLeg\n{\nOFFSET 9 0 0\nCHANNELS 3 Zrotation Xrotation \
                        Yrotation\nEnd Site\n{\nOFFSET 0 -40 0\n}\n}\n}\n";
        let frames: String = hips.iter().map(|z| format!("0 90 0 0 0 0 {z} 0 0\n")).collect();
        let text = format!("{skeleton}MOTION\nFrames: {}\nFrame Time: 0.01\n{frames}", hips.len());
        starts_with_calibration(&parse(&text, "leg").unwrap())
    }

    #[test]
    fn a_t_pose_before_the_motion_is_recognised_and_a_quick_start_is_not() {
        assert!(starts_so(&[0.0, 60.0, 61.0, 62.0, 62.5]));
        assert!(starts_so(&[17.0, 60.0, 61.0, 62.0, 62.5]), "legs apart");
        assert!(!starts_so(&[40.0, 90.0, 91.0, 92.0, 92.5]), "a pose of the motion, then a fault");
        assert!(!starts_so(&[0.0, 6.0, 7.0, 8.0, 8.5]), "a quick start");
        assert!(!starts_so(&[0.0, 20.0, 40.0, 60.0, 80.0]), "everything is quick");
    }
}
