//! Legs and their feet: an ankle moved by bending the leg, toes bent up.

use nalgebra::{Unit, UnitQuaternion, Vector3};
use toile_geometry::direction::{swing, unit_or};

use crate::{Joint, Pose, Skeleton, two_bone::middle_joint};

/// A leg that is straight bends its knee to its front: its own plane counts from this distance of the knee off the line on,
/// metres.
const STRAIGHT: f64 = 0.01;

/// The joints of one leg.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leg {
    /// At the hip.
    pub upper: Joint,
    /// At the knee.
    pub lower: Joint,
    /// At the ankle.
    pub foot: Joint,
    /// At the ball.
    pub toes: Joint,
}

impl Leg {
    /// The left leg.
    pub const LEFT: Self =
        Self { upper: Joint::LeftUpperLeg, lower: Joint::LeftLowerLeg, foot: Joint::LeftFoot, toes: Joint::LeftToes };
    /// The right leg.
    pub const RIGHT: Self = Self {
        upper: Joint::RightUpperLeg,
        lower: Joint::RightLowerLeg,
        foot: Joint::RightFoot,
        toes: Joint::RightToes,
    };

    /// Length of thigh and shank together, metres.
    pub fn length(&self, skeleton: &Skeleton) -> f64 {
        skeleton.offset(self.lower).norm() + skeleton.offset(self.foot).norm()
    }

    /// Moves the ankle by `by`, in the subject's frame, metres: hip and knee turn, the foot keeps its turn in the world. An
    /// ankle out of reach ends where the straight leg points at it.
    pub fn move_ankle(&self, skeleton: &Skeleton, pose: &mut Pose, by: &Vector3<f64>) {
        let leg = [self.upper, self.lower, self.foot];
        let frames = pose.joint_frames(skeleton);
        let [hip, knee, ankle] = leg.map(|j| frames[j.index()].translation.vector);
        let [thigh_turn, shank_turn, foot_turn] = leg.map(|j| frames[j.index()].rotation);
        let wanted = ankle + by;
        let (thigh, shank) = ((knee - hip).norm(), (ankle - knee).norm());
        let along = unit_or(&(wanted - hip), &-Vector3::y());
        let front = thigh_turn * Vector3::z();
        let across = |v: Vector3<f64>| v - along * along.dot(&v);
        let side = unit_or(&(across(knee - hip) + across(front) * STRAIGHT), &Vector3::z());
        let (new_knee, reach) = middle_joint(&along, (wanted - hip).norm(), &side, thigh, shank);
        let thigh_turn = swing(&(knee - hip), &new_knee) * thigh_turn;
        let shank_turn = swing(&(ankle - knee), &(along * reach - new_knee)) * shank_turn;
        let hips_turn = frames[Joint::Hips.index()].rotation;
        let turns = [hips_turn, thigh_turn, shank_turn, foot_turn];
        for (joint, pair) in leg.into_iter().zip(turns.windows(2)) {
            *pose.rotation_mut(joint) = pair[0].inverse() * pair[1];
        }
    }

    /// The turn that bends the toes up by `angle` radians, about the axis across the foot.
    pub fn toe_turn(&self, skeleton: &Skeleton, angle: f64) -> UnitQuaternion<f64> {
        let along = skeleton.position(self.toes) - skeleton.position(self.foot);
        let axis = Unit::try_new(along.cross(&Vector3::y()), 1e-9).unwrap_or_else(|| -Vector3::x_axis());
        UnitQuaternion::from_axis_angle(&axis, angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ankle_is_moved_by_the_leg_alone() {
        let model = crate::BodyModel::load_default().unwrap();
        let person = model.skeleton_at(&vec![0.0; model.component_count()]);
        let mut before = Pose::identity();
        *before.rotation_mut(Joint::LeftFoot) = UnitQuaternion::from_euler_angles(0.5, 0.0, 0.0);
        let mut pose = before.clone();
        let by = Vector3::new(0.02, 0.06, -0.03);
        Leg::LEFT.move_ankle(&person, &mut pose, &by);
        let at = |pose: &Pose, joint: Joint| pose.joint_frames(&person)[joint.index()];
        let moved = at(&pose, Joint::LeftFoot).translation.vector - at(&before, Joint::LeftFoot).translation.vector;
        assert!((moved - by).norm() < 1e-9, "{moved}");
        assert!(at(&pose, Joint::LeftFoot).rotation.angle_to(&at(&before, Joint::LeftFoot).rotation) < 1e-9);
        let knee =
            at(&pose, Joint::LeftLowerLeg).translation.vector - at(&before, Joint::LeftLowerLeg).translation.vector;
        assert!(knee.z > 0.05, "a straight leg bends its knee to the front: {knee}");
        assert_eq!(pose.rotation(Joint::RightLowerLeg), before.rotation(Joint::RightLowerLeg));
        let mut out_of_reach = before.clone();
        Leg::LEFT.move_ankle(&person, &mut out_of_reach, &Vector3::new(0.0, -0.3, 0.0));
        assert!(out_of_reach.rotations.iter().all(|r| r.coords.iter().all(|c| c.is_finite())));
    }
}
