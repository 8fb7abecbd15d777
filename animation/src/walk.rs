//! A walk made by rule, of our own making: what the program uses where no motion is given.
//!
//! One gait cycle is two steps; the left heel strikes at phase 0, the right at 0.5. Feet follow the rolling of a
//! heel, a flat sole and a ball (in `gait`); legs reach them by two-bone inverse kinematics; pelvis and
//! trunk counter-rotate, rise and sink twice a cycle; arms hang close to the body and swing against the legs.
//! Proportions are those of an adult 1.7 m tall; retargeting carries them to anyone.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use toile_character::{Joint, two_bone::bend};

use crate::{
    AnimationError,
    bvh::{Bvh, BvhJoint, Channel},
    gait::{Foot, Gait},
};

/// What the walk is like.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WalkSettings {
    /// Steps a minute, 40 to 180. Default 112.5 (a cycle of 32 frames at 30 Hz, so that it closes exactly).
    pub cadence: f64,
    /// Metres a second of the 1.7 m tall walker, 0.2 to 2. Default 1.15.
    pub speed: f64,
    /// How many cycles of two steps, 1 to 1000. Default 4.
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

/// Centimetres a metre: BVH files are in centimetres by custom.
const CENTIMETRES: f64 = 100.0;

/// A joint of the walker: T-pose offset from its parent, and its End Site, metres.
type WalkerJoint = (Joint, [f64; 3], Option<[f64; 3]>);

/// The walker's joints.
const SKELETON: &[WalkerJoint] = &[
    (Joint::Hips, [0.0, 0.94, 0.0], None),
    (Joint::Spine, [0.0, 0.1, 0.0], None),
    (Joint::Chest, [0.0, 0.12, -0.01], None),
    (Joint::UpperChest, [0.0, 0.12, 0.0], None),
    (Joint::Neck, [0.0, 0.16, 0.0], None),
    (Joint::Head, [0.0, 0.09, 0.02], Some([0.0, 0.18, 0.0])),
    (Joint::LeftShoulder, [0.03, 0.12, 0.0], None),
    (Joint::LeftUpperArm, [0.14, 0.0, 0.0], None),
    (Joint::LeftLowerArm, [0.28, 0.0, 0.0], None),
    (Joint::LeftHand, [0.25, 0.0, 0.0], Some([0.1, 0.0, 0.0])),
    (Joint::RightShoulder, [-0.03, 0.12, 0.0], None),
    (Joint::RightUpperArm, [-0.14, 0.0, 0.0], None),
    (Joint::RightLowerArm, [-0.28, 0.0, 0.0], None),
    (Joint::RightHand, [-0.25, 0.0, 0.0], Some([-0.1, 0.0, 0.0])),
    (Joint::LeftUpperLeg, [0.09, -0.05, 0.0], None),
    (Joint::LeftLowerLeg, [0.0, -0.42, 0.0], None),
    (Joint::LeftFoot, [0.0, -0.39, 0.0], None),
    (Joint::LeftToes, [0.0, -0.06, 0.13], Some([0.0, 0.0, 0.07])),
    (Joint::RightUpperLeg, [-0.09, -0.05, 0.0], None),
    (Joint::RightLowerLeg, [0.0, -0.42, 0.0], None),
    (Joint::RightFoot, [0.0, -0.39, 0.0], None),
    (Joint::RightToes, [0.0, -0.06, 0.13], Some([0.0, 0.0, 0.07])),
];

/// Lengths of thigh and shank of the walker, metres.
const THIGH: f64 = 0.42;
const SHANK: f64 = 0.39;
/// Upper leg joint seen from the hips, left side, metres.
const HIP_JOINT: [f64; 3] = [0.09, -0.05, 0.0];

/// The walk as a BVH motion.
///
/// # Errors
/// [`AnimationError::Setting`] for a setting out of its range.
pub fn walk(settings: &WalkSettings) -> Result<Bvh, AnimationError> {
    check(settings)?;
    let cycle = 120.0 / settings.cadence;
    let gait = Gait::new(settings.speed * cycle);
    let height = pelvis_height(&gait);
    // The last pose closes the cycle.
    let count = (settings.cycles as f64 * cycle * settings.rate).round() as usize + 1;
    let frames = (0..count)
        .map(|i| {
            let phase = i as f64 / settings.rate / cycle;
            let travel = if settings.in_place { 0.0 } else { phase * gait.stride };
            frame(&Moment::new(&gait, height, settings, phase), travel)
        })
        .collect();
    Ok(Bvh { joints: joints(), frame_time: 1.0 / settings.rate, frames, positions_add: false })
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

fn joints() -> Vec<BvhJoint> {
    let rotations = [Channel::Rotation(2), Channel::Rotation(0), Channel::Rotation(1)];
    let positions = [Channel::Position(0), Channel::Position(1), Channel::Position(2)];
    let index = |joint: Joint| SKELETON.iter().position(|s| s.0 == joint);
    SKELETON
        .iter()
        .map(|(joint, offset, end)| BvhJoint {
            name: joint.name().into(),
            parent: joint.parent().and_then(index),
            offset: Vector3::from(*offset) * CENTIMETRES,
            channels: match joint {
                Joint::Hips => positions.into_iter().chain(rotations).collect(),
                _ => rotations.to_vec(),
            },
            end_site: end.map(|e| Vector3::from(e) * CENTIMETRES),
        })
        .collect()
}

/// World rotations of the walker's joints at one moment and where the hips are.
struct Moment {
    hips: Vector3<f64>,
    world: Vec<UnitQuaternion<f64>>,
}

fn turn(axis: usize, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::ith_axis(axis), angle)
}

/// 1 when the left leg is most forward, -1 when the right one is.
fn forward(phase: f64) -> f64 {
    (std::f64::consts::TAU * phase).cos()
}

/// The pelvis turns with the leading leg, drops on the swinging side and stays nearly level: about y, z, x.
fn pelvis(phase: f64) -> UnitQuaternion<f64> {
    const YAW: f64 = 0.08;
    const LIST: f64 = 0.05;
    const TILT: f64 = 0.03;
    let side = (std::f64::consts::TAU * phase).sin();
    turn(1, -YAW * forward(phase)) * turn(2, LIST * side) * turn(0, TILT)
}

/// Sideways, over the standing leg (left is +x), and up and down, lowest just after each heel strike.
fn hips_offset(phase: f64) -> Vector3<f64> {
    const SWAY: f64 = 0.018;
    const BOB: f64 = 0.018;
    let tau = std::f64::consts::TAU;
    Vector3::new(SWAY * (tau * phase).sin(), -BOB * (2.0 * tau * (phase - 0.04)).cos(), 0.0)
}

/// The greatest mean height of the hips at which both legs always reach their feet.
fn pelvis_height(gait: &Gait) -> f64 {
    const STRETCH: f64 = 0.992; // of the leg's length: knees are never quite straight
    let leg = (THIGH + SHANK) * STRETCH;
    let mut height = f64::MAX;
    for i in 0..256 {
        let phase = f64::from(i) / 256.0;
        for (side, foot_phase) in [(1.0, phase), (-1.0, phase + 0.5)] {
            let ankle = gait.foot(foot_phase).ankle_on(side);
            let hip = pelvis(phase) * side_of(Vector3::from(HIP_JOINT), side) + hips_offset(phase);
            let level = (ankle.x - hip.x).hypot(ankle.z - hip.z);
            height = height.min(ankle.y + (leg * leg - level * level).max(0.0).sqrt() - hip.y);
        }
    }
    height
}

fn side_of(left: Vector3<f64>, side: f64) -> Vector3<f64> {
    Vector3::new(left.x * side, left.y, left.z)
}

impl Moment {
    fn new(gait: &Gait, height: f64, settings: &WalkSettings, phase: f64) -> Self {
        let hips = hips_offset(phase) + Vector3::y() * height;
        let mut moment = Self { hips, world: vec![UnitQuaternion::identity(); SKELETON.len()] };
        moment.trunk(phase);
        for (side, foot_phase) in [(1.0, phase), (-1.0, phase + 0.5)] {
            moment.leg(side, &gait.foot(foot_phase));
            moment.arm(side, foot_phase, settings.arm_spread);
        }
        moment
    }

    fn set(&mut self, joint: Joint, rotation: UnitQuaternion<f64>) {
        if let Some(index) = SKELETON.iter().position(|s| s.0 == joint) {
            self.world[index] = rotation;
        }
    }

    /// Shoulders turn against the pelvis; the head looks ahead.
    fn trunk(&mut self, phase: f64) {
        const COUNTER: f64 = 0.09;
        const LEAN: f64 = 0.03;
        let low = pelvis(phase);
        let high = turn(1, COUNTER * forward(phase)) * turn(0, LEAN);
        for (k, joint) in [Joint::Hips, Joint::Spine, Joint::Chest, Joint::UpperChest].into_iter().enumerate() {
            self.set(joint, low.slerp(&high, k as f64 / 3.0));
        }
        let ahead = turn(0, 0.02);
        self.set(Joint::LeftShoulder, high);
        self.set(Joint::RightShoulder, high);
        self.set(Joint::Neck, high.slerp(&ahead, 0.5));
        self.set(Joint::Head, ahead);
    }

    fn leg(&mut self, side: f64, foot: &Foot) {
        let hip = self.hips + self.world[0] * side_of(Vector3::from(HIP_JOINT), side);
        // Knees point ahead and slightly outward, with the pelvis.
        let knee_forward = turn(1, side * 0.06) * Vector3::z();
        let (thigh, shank) = bend(&(foot.ankle_on(side) - hip), THIGH, SHANK, &knee_forward);
        let outward = turn(1, side * Foot::TOE_OUT);
        let joints = match side > 0.0 {
            true => [Joint::LeftUpperLeg, Joint::LeftLowerLeg, Joint::LeftFoot, Joint::LeftToes],
            false => [Joint::RightUpperLeg, Joint::RightLowerLeg, Joint::RightFoot, Joint::RightToes],
        };
        let turns = [thigh, shank, outward * turn(0, foot.pitch), outward * turn(0, foot.toe_pitch)];
        for (joint, rotation) in joints.into_iter().zip(turns) {
            self.set(joint, rotation);
        }
    }

    /// The arm of `side` swings back when its leg is forward; elbows bend more in front.
    fn arm(&mut self, side: f64, leg_phase: f64, spread: f64) {
        const SWING: f64 = 0.3;
        const MEAN: f64 = 0.04;
        let ahead = -forward(leg_phase - 0.03);
        let swing = MEAN + SWING * ahead;
        let flexion = 0.28 + 0.16 * ahead;
        let shoulders = self.world[3];
        let hang = turn(2, -side * (std::f64::consts::FRAC_PI_2 - spread));
        let upper = shoulders * turn(0, -swing) * hang;
        let lower = upper * turn(1, -side * flexion);
        let hand = lower * turn(1, -side * 0.08);
        let joints = match side > 0.0 {
            true => [Joint::LeftUpperArm, Joint::LeftLowerArm, Joint::LeftHand],
            false => [Joint::RightUpperArm, Joint::RightLowerArm, Joint::RightHand],
        };
        for (joint, rotation) in joints.into_iter().zip([upper, lower, hand]) {
            self.set(joint, rotation);
        }
    }
}

/// Channel values of one moment: hips position, then every joint's local rotation as z, x, y angles.
fn frame(moment: &Moment, travel: f64) -> Vec<f64> {
    let position = (moment.hips + Vector3::z() * travel) * CENTIMETRES;
    let mut values = vec![position.x, position.y, position.z];
    for (index, (joint, ..)) in SKELETON.iter().enumerate() {
        let parent = SKELETON.iter().position(|s| Some(s.0) == joint.parent());
        let parent = parent.map_or_else(UnitQuaternion::identity, |p| moment.world[p]);
        values.extend(angles_zxy(&(parent.inverse() * moment.world[index])).map(f64::to_degrees));
    }
    values
}

/// Angles a, b, c with rotation = Rz(a)·Rx(b)·Ry(c), radians.
fn angles_zxy(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let m = rotation.to_rotation_matrix();
    let x = m[(2, 1)].clamp(-1.0, 1.0).asin();
    if m[(2, 1)].abs() > 1.0 - 1e-12 {
        return [m[(1, 0)].atan2(m[(0, 0)]), x, 0.0];
    }
    [(-m[(0, 1)]).atan2(m[(1, 1)]), x, (-m[(2, 0)]).atan2(m[(2, 2)])]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_give_the_rotation_back() {
        for i in 0..200 {
            let t = f64::from(i);
            let r = UnitQuaternion::from_euler_angles((t * 0.7).sin() * 3.0, (t * 1.3).cos() * 1.5, t);
            let [a, b, c] = angles_zxy(&r);
            assert!((turn(2, a) * turn(0, b) * turn(1, c)).angle_to(&r) < 1e-6);
        }
    }

    #[test]
    fn offsets_agree_with_the_leg_lengths() {
        let of = |joint: Joint| SKELETON.iter().find(|s| s.0 == joint).map(|s| Vector3::from(s.1)).unwrap();
        assert_eq!(of(Joint::LeftLowerLeg).norm(), THIGH);
        assert_eq!(of(Joint::LeftFoot).norm(), SHANK);
        assert_eq!(of(Joint::LeftUpperLeg), Vector3::from(HIP_JOINT));
        assert!((of(Joint::LeftToes) - Foot::BALL).norm() < 1e-12);
    }
}
