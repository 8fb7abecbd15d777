//! A motion at another rate.

use toile_character::Motion;

/// Frame times in files are rounded (0.0333 s for 30 Hz): rates that differ by less than this share are the same,
/// and a last pose that is missed by less than this share of a step is included.
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
    let poses = (0..count).filter_map(|i| motion.pose_at(i as f64 * frame_time)).collect();
    Motion { name: motion.name.clone(), frame_time, poses }
}
