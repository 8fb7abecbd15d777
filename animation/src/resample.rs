//! A motion at another rate.

use toile_character::{Motion, Pose};

use crate::retarget::shortest;

/// Frame times in files are rounded (0.0333 s for 30 Hz): rates that differ by less than this share are the same,
/// and a last pose that is missed by less than this share of a step is taken.
const ROUNDING: f64 = 5e-3;

/// The motion with at most `max_rate` poses a second; a slower one is returned as it is.
///
/// Poses between frames are interpolated (translations on a line, rotations the short way). The last pose is the
/// last whole step at or before the source's end.
pub fn resample(motion: &Motion, max_rate: f64) -> Motion {
    if motion.poses.len() < 2 || motion.frame_time * max_rate > 1.0 - ROUNDING {
        return motion.clone();
    }
    let frame_time = 1.0 / max_rate;
    let count = (motion.duration() / frame_time + ROUNDING).floor() as usize + 1;
    let poses = (0..count).map(|i| pose_at(motion, i as f64 * frame_time)).collect();
    Motion { name: motion.name.clone(), frame_time, poses }
}

/// The pose at `time` seconds, clamped to the motion's ends.
///
/// # Panics
/// Where the motion has no pose.
pub fn pose_at(motion: &Motion, time: f64) -> Pose {
    let last = motion.poses.len() - 1;
    let at = (time / motion.frame_time).clamp(0.0, last as f64);
    let low = (at.floor() as usize).min(last);
    blend(&motion.poses[low], &motion.poses[(low + 1).min(last)], at - low as f64)
}

/// The pose at `share` of the way from `a` to `b`.
pub fn blend(a: &Pose, b: &Pose, share: f64) -> Pose {
    Pose {
        translation: a.translation.lerp(&b.translation, share),
        rotations: a.rotations.iter().zip(&b.rotations).map(|(a, b)| shortest(a, b, share)).collect(),
    }
}
