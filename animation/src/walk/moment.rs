//! The walker at one moment of the gait cycle.

use nalgebra::{UnitQuaternion, Vector3};
use toile_character::{Joint, two_bone::bend};

use super::{
    gait::{Foot, Gait},
    walker::{HIP_JOINT, SHANK, SKELETON, THIGH},
};

/// World rotations of the walker's joints at one moment and where the hips are.
pub(super) struct Moment {
    pub hips: Vector3<f64>,
    pub world: Vec<UnitQuaternion<f64>>,
}

/// A rotation about a coordinate axis.
pub(super) fn turn(axis: usize, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::ith_axis(axis), angle)
}

/// 1 when the left leg is furthest forward, −1 when the right one is.
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
pub(super) fn pelvis_height(gait: Gait) -> f64 {
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
    /// The walker at `phase` of the cycle, hips at mean `height`, upper arms `arm_spread` from the vertical.
    pub fn new(gait: Gait, height: f64, arm_spread: f64, phase: f64) -> Self {
        let hips = hips_offset(phase) + Vector3::y() * height;
        let mut moment = Self { hips, world: vec![UnitQuaternion::identity(); SKELETON.len()] };
        moment.trunk(phase);
        for (side, foot_phase) in [(1.0, phase), (-1.0, phase + 0.5)] {
            moment.leg(side, &gait.foot(foot_phase));
            moment.arm(side, foot_phase, arm_spread);
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
        let joints = if side > 0.0 {
            [Joint::LeftUpperLeg, Joint::LeftLowerLeg, Joint::LeftFoot, Joint::LeftToes]
        } else {
            [Joint::RightUpperLeg, Joint::RightLowerLeg, Joint::RightFoot, Joint::RightToes]
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
        let joints = if side > 0.0 {
            [Joint::LeftUpperArm, Joint::LeftLowerArm, Joint::LeftHand]
        } else {
            [Joint::RightUpperArm, Joint::RightLowerArm, Joint::RightHand]
        };
        for (joint, rotation) in joints.into_iter().zip([upper, lower, hand]) {
            self.set(joint, rotation);
        }
    }
}
