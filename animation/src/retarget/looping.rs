//! A motion cut and blended so that it can be repeated.

use toile_character::{Motion, Pose};

/// Seconds over which the end is blended into the start.
const BLEND: f64 = 0.25;

/// The motion cut at the pose of its second half that is most like its first pose and blended into it, so that
/// its last pose is its first. It works best on a motion that stays in place; a motion of fewer than four poses is
/// returned as it is.
pub fn close_loop(motion: &Motion) -> Motion {
    let count = motion.poses.len();
    if count < 4 {
        return motion.clone();
    }
    let first = &motion.poses[0];
    let second = &motion.poses[1];
    // the pose and the way it moves on must both be alike
    let unlike = |i: usize| {
        let next = motion.poses.get(i + 1).map_or(0.0, |p| distance(p, second));
        distance(&motion.poses[i], first) + next
    };
    let end = (count / 2..count).min_by(|a, b| unlike(*a).total_cmp(&unlike(*b))).unwrap_or(count - 1);
    let window = ((BLEND / motion.frame_time).round() as usize).clamp(1, end / 2);
    let (start_of_blend, mut poses) = (end - window, motion.poses[..=end].to_vec());
    for (i, pose) in poses[start_of_blend..].iter_mut().enumerate() {
        let share = i as f64 / window as f64;
        let eased = share * share * (3.0 - 2.0 * share);
        *pose = pose.interpolated(first, eased);
    }
    Motion { name: motion.name.clone(), frame_time: motion.frame_time, poses }
}

/// Sum of the angles between two poses' joints, radians, with the hips' displacement in metres.
fn distance(a: &Pose, b: &Pose) -> f64 {
    let angles: f64 = a.rotations.iter().zip(&b.rotations).map(|(a, b)| a.angle_to(b)).sum();
    angles + (a.translation - b.translation).norm()
}
