//! A walk made by rule, of our own making: the program uses it where no motion is given.
//!
//! One gait cycle is two steps; the left heel strikes at phase 0, the right at 0.5. Feet follow the rolling of a
//! heel, a flat sole and a ball (in `gait`); legs reach them by two-bone inverse kinematics; pelvis and
//! trunk counter-rotate, rise and sink twice a cycle; arms hang close to the body and swing against the legs.
//! Proportions are those of an adult 1.7 m tall; retargeting carries them to anyone.

mod channels;
mod gait;
mod moment;
mod walker;

use serde::{Deserialize, Serialize};

use crate::{AnimationError, Bvh};
use channels::channels;
use gait::Gait;
use moment::{Moment, pelvis_height};

/// Settings of the walk.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WalkSettings {
    /// Steps a minute, 40 to 180. Default 112.5 (a cycle of 32 frames at 30 Hz, so that it closes exactly).
    pub cadence: f64,
    /// Metres a second of the 1.7 m tall walker, 0.2 to 2. Default 1.15.
    pub speed: f64,
    /// Number of cycles of two steps, 1 to 1000. Default 4.
    pub cycles: u32,
    /// Frames a second, 10 to 240. Default 30.
    pub rate: f64,
    /// Angle between upper arms and the vertical, seen from the front, radians, 0 to 0.6. Default 0.21 (12°).
    pub arm_spread: f64,
    /// Walk as on a treadmill, so that the last pose is the first. Default true.
    pub in_place: bool,
}

impl Default for WalkSettings {
    fn default() -> Self {
        Self { cadence: 112.5, speed: 1.15, cycles: 4, rate: 30.0, arm_spread: 0.21, in_place: true }
    }
}

/// The walk as a BVH motion.
///
/// # Errors
/// [`AnimationError::Setting`] for a setting out of its range.
pub fn walk(settings: &WalkSettings) -> Result<Bvh, AnimationError> {
    check(settings)?;
    let cycle = 120.0 / settings.cadence;
    let gait = Gait::new(settings.speed * cycle);
    let height = pelvis_height(gait);
    // The last pose closes the cycle.
    let count = (settings.cycles as f64 * cycle * settings.rate).round() as usize + 1;
    let frames = (0..count)
        .map(|i| {
            let phase = i as f64 / settings.rate / cycle;
            let travel = if settings.in_place { 0.0 } else { phase * gait.stride };
            channels(&Moment::new(gait, height, settings.arm_spread, phase), travel)
        })
        .collect();
    let (joints, frame_time) = (walker::joints(), 1.0 / settings.rate);
    Ok(Bvh { joints, frame_time, frames, positions_add: false, warnings: Vec::new() })
}

fn check(settings: &WalkSettings) -> Result<(), AnimationError> {
    let ranges = [
        ("cadence", settings.cadence, 40.0, 180.0, "40 to 180 steps a minute"),
        ("speed", settings.speed, 0.2, 2.0, "0.2 to 2 m/s"),
        ("cycles", f64::from(settings.cycles), 1.0, 1000.0, "1 to 1000"),
        ("rate", settings.rate, 10.0, 240.0, "10 to 240 frames a second"),
        ("arm_spread", settings.arm_spread, 0.0, 0.6, "0 to 0.6 rad"),
    ];
    for (name, value, low, high, range) in ranges {
        if !(low..=high).contains(&value) {
            return Err(AnimationError::Setting { name, value, range });
        }
    }
    Ok(())
}

/// The walk in `assets/walk.bvh`: what [`walk`] makes by default.
pub const SHIPPED_WALK: &str = include_str!("../assets/walk.bvh");

/// The shipped walk, parsed.
///
/// # Errors
/// [`AnimationError::Bvh`] only if the file was damaged before the build.
pub fn shipped_walk() -> Result<Bvh, AnimationError> {
    crate::bvh::parse(SHIPPED_WALK, "walk.bvh")
}
