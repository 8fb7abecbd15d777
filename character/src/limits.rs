//! How far human joints turn: bounds that hold for everyone, for fits and for programs that pose the avatar.

use nalgebra::{UnitQuaternion, Vector3};

use crate::{Joint, Pose, Skeleton};

/// Bounds of the component about `axis` of a joint's rotation vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimit {
    /// The joint that turns.
    pub joint: Joint,
    /// Unit vector in the frame of the joint's parent, which at rest lies along the subject's.
    pub axis: Vector3<f64>,
    /// Smallest angle, radians.
    pub low: f64,
    /// Largest angle, radians.
    pub high: f64,
}

/// The limits of a body whose joints rest in the A-pose at `skeleton`: knees and elbows are hinges that do not bend
/// backwards, feet tip as far as on tiptoe, the neck does not turn the head backwards.
pub fn joint_limits(skeleton: &Skeleton) -> Vec<JointLimit> {
    use Joint::*;
    let degrees = |joint, axis: Vector3<f64>, low: f64, high: f64| JointLimit {
        joint,
        axis: axis.try_normalize(1e-9).unwrap_or_else(Vector3::x),
        low: low.to_radians(),
        high: high.to_radians(),
    };
    let mut out = vec![
        degrees(LeftLowerLeg, Vector3::x(), -4.0, 150.0),
        degrees(RightLowerLeg, Vector3::x(), -4.0, 150.0),
        degrees(Neck, Vector3::y(), -60.0, 60.0),
        degrees(Head, Vector3::y(), -60.0, 60.0),
    ];
    for (elbow, wrist) in [(LeftLowerArm, LeftHand), (RightLowerArm, RightHand)] {
        let arm = skeleton.position(wrist) - skeleton.position(elbow);
        out.push(degrees(elbow, arm.cross(&Vector3::z()), -8.0, 150.0));
    }
    for (knee, ankle) in [(LeftLowerLeg, LeftFoot), (RightLowerLeg, RightFoot)] {
        out.push(degrees(knee, skeleton.position(ankle) - skeleton.position(knee), -20.0, 20.0));
        out.push(degrees(knee, Vector3::z(), -8.0, 8.0));
    }
    for foot in [LeftFoot, RightFoot] {
        // on tiptoe the ankle bends by 50° (American Academy of Orthopaedic Surgeons, ranges of motion)
        out.push(degrees(foot, Vector3::x(), -40.0, 50.0));
    }
    out
}

impl JointLimit {
    /// How far a joint's rotation lies beyond the limit, radians: negative below `low`, 0 within.
    pub fn beyond(&self, rotation: &UnitQuaternion<f64>) -> f64 {
        let angle = rotation_vector(rotation).dot(&self.axis);
        (angle - self.high).max(0.0) + (angle - self.low).min(0.0)
    }

    /// The same limit for rotations away from `pose`, axes again along the subject's: the limit where `pose`
    /// has become the rest.
    pub fn from_rest(&self, pose: &Pose) -> Self {
        let mut parent = UnitQuaternion::identity();
        let mut at = self.joint.parent();
        while let Some(joint) = at {
            parent = pose.rotation(joint) * parent;
            at = joint.parent();
        }
        let turned = rotation_vector(&pose.rotation(self.joint)).dot(&self.axis);
        Self { axis: parent * self.axis, low: self.low - turned, high: self.high - turned, ..*self }
    }
}

/// Rotation vector of at most half a turn.
pub fn rotation_vector(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = if q.w < 0.0 { UnitQuaternion::new_unchecked(-q.into_inner()) } else { *q };
    q.scaled_axis()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BodyModel, dress_pose::t_pose};

    #[test]
    fn knees_and_elbows_bend_one_way_from_either_rest() {
        let skeleton = BodyModel::load_default().unwrap().mean_skeleton;
        let t = t_pose(&skeleton);
        for (joint, next, toward) in [
            (Joint::LeftLowerLeg, Joint::LeftFoot, -Vector3::z()),
            (Joint::RightLowerLeg, Joint::RightFoot, -Vector3::z()),
            (Joint::LeftLowerArm, Joint::LeftHand, Vector3::z()),
            (Joint::RightLowerArm, Joint::RightHand, Vector3::z()),
        ] {
            let limit = joint_limits(&skeleton).into_iter().find(|l| l.joint == joint).unwrap();
            for (rest, limit) in [(Pose::identity(), limit), (t.clone(), limit.from_rest(&t))] {
                let at = rest.joint_positions(&skeleton);
                let bone = (at[next.index()] - at[joint.index()]).normalize();
                let bend = |angle: f64| UnitQuaternion::from_scaled_axis(bone.cross(&toward).normalize() * angle);
                assert!((bend(1.0) * bone).dot(&toward) > 0.5);
                assert_eq!(limit.beyond(&bend(1.0)), 0.0, "{joint:?}");
                assert!(limit.beyond(&bend(-0.4)) < -0.1, "{joint:?}");
                assert!(limit.beyond(&bend(3.0)) > 0.2, "{joint:?}");
            }
        }
    }

    #[test]
    fn limits_hold_alike_for_a_rotation_given_from_another_rest() {
        let skeleton = BodyModel::load_default().unwrap().mean_skeleton;
        let t = t_pose(&skeleton);
        let world = |pose: &Pose, joint: Joint| pose.joint_frames(&skeleton)[joint.index()].rotation;
        let mut bent = t.clone();
        let elbow = Joint::LeftLowerArm;
        let limit = joint_limits(&skeleton).into_iter().find(|l| l.joint == elbow).unwrap();
        *bent.rotation_mut(elbow) = UnitQuaternion::from_scaled_axis(limit.axis * 3.0) * t.rotation(elbow);
        // world axes: the turn of the elbow away from the T-pose
        let turned = world(&bent, elbow) * world(&t, elbow).inverse();
        let (from_a, from_t) = (limit.beyond(&bent.rotation(elbow)), limit.from_rest(&t).beyond(&turned));
        assert!((from_a - from_t).abs() < 0.05 && from_a > 0.1, "{from_a} {from_t}");
    }
}
