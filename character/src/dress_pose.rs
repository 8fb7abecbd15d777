//! The poses that avatars rest in, found for any skeleton: A-pose and T-pose.

use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    Joint, Pose, Skeleton,
    joint::{JOINT_COUNT, JOINTS},
};

/// How far the straight arms of the A-pose hang below the horizontal, radians.
pub const A_POSE_ARM_DOWN: f64 = std::f64::consts::FRAC_PI_4;
/// How far the straight legs of the A-pose stand out from the vertical, radians (7°).
pub const A_POSE_LEG_OUT: f64 = 0.122_173_047_639_603_06;

/// The pose that brings `skeleton`'s rest to a T: arms along ±X, legs along −Y, feet level, ankles at their height.
pub fn t_pose(skeleton: &Skeleton) -> Pose {
    straight_limbs(skeleton, 0.0, 0.0)
}

/// The pose that brings `skeleton`'s rest to the body model's A-pose.
pub fn a_pose(skeleton: &Skeleton) -> Pose {
    straight_limbs(skeleton, A_POSE_ARM_DOWN, A_POSE_LEG_OUT)
}

/// Straight arms `arm_down` below the horizontal, straight legs `leg_out` from the vertical (radians).
///
/// Each bone takes the smallest turn that gives it its direction; hands turn with the forearm until the middle finger's
/// root lies on the arm's line; feet keep the world orientation they rest in. The rest must stand upright, facing +Z.
pub fn straight_limbs(skeleton: &Skeleton, arm_down: f64, leg_out: f64) -> Pose {
    let mut world = [UnitQuaternion::identity(); JOINT_COUNT];
    for joint in JOINTS {
        let parent = joint.parent().map_or_else(UnitQuaternion::identity, |p| world[p.index()]);
        world[joint.index()] = match goal(joint, arm_down, leg_out) {
            Goal::Free => parent,
            Goal::Level => UnitQuaternion::identity(),
            Goal::Along(child, direction) => {
                let bone = parent * (skeleton.position(child) - skeleton.position(joint));
                minimum_turn(&bone, &direction) * parent
            }
        };
    }
    let mut pose = Pose::identity();
    for joint in JOINTS {
        let parent = joint.parent().map_or_else(UnitQuaternion::identity, |p| world[p.index()]);
        *pose.rotation_mut(joint) = parent.inverse() * world[joint.index()];
    }
    pose.translation.y = ankle_drop(skeleton, &pose);
    pose
}

enum Goal {
    Free,
    Level,
    Along(Joint, Vector3<f64>),
}

fn goal(joint: Joint, arm_down: f64, leg_out: f64) -> Goal {
    use Joint::*;
    let side = if joint.name().starts_with("left") { 1.0 } else { -1.0 };
    let arm = Vector3::new(side * arm_down.cos(), -arm_down.sin(), 0.0);
    let leg = Vector3::new(side * leg_out.sin(), -leg_out.cos(), 0.0);
    match joint {
        LeftUpperArm => Goal::Along(LeftLowerArm, arm),
        RightUpperArm => Goal::Along(RightLowerArm, arm),
        LeftLowerArm => Goal::Along(LeftHand, arm),
        RightLowerArm => Goal::Along(RightHand, arm),
        LeftHand => Goal::Along(LeftMiddleProximal, arm),
        RightHand => Goal::Along(RightMiddleProximal, arm),
        LeftUpperLeg => Goal::Along(LeftLowerLeg, leg),
        RightUpperLeg => Goal::Along(RightLowerLeg, leg),
        LeftLowerLeg => Goal::Along(LeftFoot, leg),
        RightLowerLeg => Goal::Along(RightFoot, leg),
        LeftFoot | RightFoot => Goal::Level,
        _ => Goal::Free,
    }
}

/// Smallest rotation from one direction to another: half a turn where they are opposite, the identity where one is zero.
/// Safe where they are (nearly) the same: the cosine of rounded unit vectors may exceed 1.
fn minimum_turn(from: &Vector3<f64>, to: &Vector3<f64>) -> UnitQuaternion<f64> {
    let (Some(a), Some(b)) = (from.try_normalize(1e-9), to.try_normalize(1e-9)) else {
        return UnitQuaternion::identity();
    };
    let (axis, cosine) = (a.cross(&b), a.dot(&b));
    match axis.try_normalize(1e-12) {
        Some(unit) => UnitQuaternion::from_scaled_axis(unit * axis.norm().atan2(cosine)),
        None if cosine > 0.0 => UnitQuaternion::identity(),
        None => UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::PI),
    }
}

/// How far the hips must rise for the ankles to keep their mean height.
fn ankle_drop(skeleton: &Skeleton, pose: &Pose) -> f64 {
    let posed = pose.joint_positions(skeleton);
    let height = |j: Joint| skeleton.position(j).y - posed[j.index()].y;
    0.5 * (height(Joint::LeftFoot) + height(Joint::RightFoot))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyModel;

    #[test]
    fn the_t_pose_has_level_arms_and_plumb_legs() {
        let skeleton = &BodyModel::load_default().unwrap().mean_skeleton;
        let posed = t_pose(skeleton).joint_positions(skeleton);
        let at = |j: Joint| posed[j.index()];
        let arm = at(Joint::LeftHand) - at(Joint::LeftUpperArm);
        assert!(arm.y.abs() < 1e-6 && arm.z.abs() < 1e-6 && arm.x > 0.4, "{arm}");
        let leg = at(Joint::RightFoot) - at(Joint::RightUpperLeg);
        assert!(leg.x.abs() < 1e-6 && leg.z.abs() < 1e-6 && leg.y < -0.6, "{leg}");
        let rise = at(Joint::LeftFoot).y - skeleton.position(Joint::LeftFoot).y;
        assert!(rise.abs() < 0.005, "{rise}");
    }

    #[test]
    fn limbs_that_are_straight_already_give_no_nan() {
        let mean = BodyModel::load_default().unwrap().mean_skeleton;
        // straightened again and again, at many angles: bones then have their goal's direction to the last digits
        for k in 0..200 {
            let (arm, leg) = (0.007 * f64::from(k), 0.002 * f64::from(k));
            let mut skeleton = mean.clone();
            for _ in 0..2 {
                let pose = straight_limbs(&skeleton, arm, leg);
                let at = pose.joint_positions(&skeleton);
                assert!(at.iter().all(|p| p.coords.iter().all(|c| c.is_finite())), "{arm} {leg}");
                skeleton.rest.copy_from_slice(&at);
            }
        }
        let turn = |a: [f64; 3], b: [f64; 3]| minimum_turn(&Vector3::from(a), &Vector3::from(b)).angle();
        assert_eq!(turn([1.0, 0.0, 0.0], [3.0, 0.0, 0.0]), 0.0);
        assert!((turn([0.0, 2.0, 0.0], [0.0, -1.0, 0.0]) - std::f64::consts::PI).abs() < 1e-12);
        assert_eq!(turn([0.0; 3], [0.0, -1.0, 0.0]), 0.0);
    }

    #[test]
    fn the_models_rest_is_its_a_pose() {
        let skeleton = &BodyModel::load_default().unwrap().mean_skeleton;
        for (joint, turn) in JOINTS.iter().zip(a_pose(skeleton).rotations) {
            let is_hand = matches!(joint, Joint::LeftHand | Joint::RightHand) || joint.is_finger();
            assert!(is_hand || turn.angle() < 0.01, "{}: {}", joint.name(), turn.angle());
        }
    }
}
