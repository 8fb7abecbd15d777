//! First frames that are poses for calibration.

use toile_geometry::statistics::median;

use crate::{Bvh, bvh::Channel};

/// Largest rotation of a channel in a pose for calibration, degrees: legs stand apart by 17 to 21 in the T-poses that
/// conversions of motion capture archives put before the motion.
const NEARLY_ZERO: f64 = 25.0;
/// The motion jumps out of it by at least this many times the median of its steps,
const JUMP: f64 = 5.0;
/// or this many times where every rotation is smaller than [`ZERO`] degrees, which no one who moves looks like,
const JUMP_FROM_ZERO: f64 = 2.5;
const ZERO: f64 = 6.0;
/// and by at least this, radians: more than a limb turns between two frames.
const SMALLEST_JUMP: f64 = 0.26;
/// Steps that lead out of it are at least this many times as large as the usual ones, and over after this time, seconds.
const FADES: f64 = 2.0;
const FADE: f64 = 0.5;
/// Steps whose median is taken.
const STEPS: usize = 60;

/// Number of frames at the start that are a pose for calibration, or lead out of one: small rotations, then steps many times as
/// large as the usual ones. Conversions that were resampled fade from the pose into the motion over some frames.
pub(super) fn calibration_frames(bvh: &Bvh) -> usize {
    if bvh.frames.len() < 4 {
        return 0;
    }
    let rotations: Vec<bool> =
        bvh.joints.iter().flat_map(|j| j.channels.iter().map(|c| matches!(c, Channel::Rotation(_)))).collect();
    let largest = bvh.frames[0].iter().zip(&rotations).filter(|(_, r)| **r).map(|(v, _)| v.abs()).fold(0.0, f64::max);
    let step = |i: usize| {
        let (a, b) = (bvh.joint_frames(i), bvh.joint_frames(i + 1));
        a.iter().zip(&b).map(|(a, b)| a.rotation.angle_to(&b.rotation)).fold(0.0, f64::max)
    };
    let steps: Vec<f64> = (0..bvh.frames.len().min(STEPS) - 1).map(step).collect();
    let usual = median(&mut steps[1..].to_vec()).unwrap_or(0.0);
    let jump = if largest < ZERO { JUMP_FROM_ZERO } else { JUMP };
    if largest > NEARLY_ZERO || steps[0] < SMALLEST_JUMP.max(jump * usual) {
        return 0;
    }
    let most = ((FADE / bvh.frame_time) as usize).clamp(1, steps.len() - 1);
    1 + steps[1..most].iter().take_while(|step| **step > SMALLEST_JUMP.max(FADES * usual)).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::parse;

    /// A leg that hangs from the hips, with rotations about Z, degrees a frame.
    fn dropped(hips: &[f64]) -> usize {
        let skeleton = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 90 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation \
                        Xrotation Yrotation\nJOINT LeftUpLeg\n{\nOFFSET 9 0 0\nCHANNELS 3 Zrotation Xrotation \
                        Yrotation\nEnd Site\n{\nOFFSET 0 -40 0\n}\n}\n}\n";
        let frames: String = hips.iter().map(|z| format!("0 90 0 0 0 0 {z} 0 0\n")).collect();
        let text = format!("{skeleton}MOTION\nFrames: {}\nFrame Time: 0.01\n{frames}", hips.len());
        calibration_frames(&parse(&text, "leg").unwrap())
    }

    #[test]
    fn a_t_pose_before_the_motion_is_recognised_and_a_quick_start_is_not() {
        assert_eq!(dropped(&[0.0, 60.0, 61.0, 62.0, 62.5]), 1);
        assert_eq!(dropped(&[17.0, 60.0, 61.0, 62.0, 62.5]), 1, "legs apart");
        assert_eq!(dropped(&[40.0, 90.0, 91.0, 92.0, 92.5]), 0, "a pose of the motion, then a fault");
        assert_eq!(dropped(&[0.0, 6.0, 7.0, 8.0, 8.5]), 0, "a quick start");
        assert_eq!(dropped(&[0.0, 20.0, 40.0, 60.0, 80.0]), 0, "everything is quick");
        let fading = [3.0, 25.0, 50.0, 75.0, 80.0, 87.0, 92.0, 98.0, 103.0, 108.0, 114.0, 121.0, 127.0];
        assert_eq!(dropped(&fading), 3, "fades into a run");
    }
}
