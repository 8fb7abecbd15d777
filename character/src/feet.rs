//! Feet kept out of the floor.
//!
//! Feet of other proportions than the source's dip below the floor where they roll over heel and ball. Such a foot
//! is lifted by bending its knee, and toes that would point into the floor bend up. The rest of the pose and feet
//! above the floor are left alone, and the correction grows from nothing, so nothing jumps.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use toile_geometry::direction::{swing, unit_or};

use crate::{Joint, Pose, Skeleton, two_bone::middle_joint};

/// Length of the toes by that of the foot from ankle to ball.
const TOES_BY_FOOT: f64 = 0.5;
/// Heel behind the ankle by the same length.
const HEEL_BY_FOOT: f64 = 0.35;

/// The joints of one leg.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leg {
    pub upper: Joint,
    pub lower: Joint,
    pub foot: Joint,
    pub toes: Joint,
}

impl Leg {
    pub const LEFT: Self =
        Self { upper: Joint::LeftUpperLeg, lower: Joint::LeftLowerLeg, foot: Joint::LeftFoot, toes: Joint::LeftToes };
    pub const RIGHT: Self = Self {
        upper: Joint::RightUpperLeg,
        lower: Joint::RightLowerLeg,
        foot: Joint::RightFoot,
        toes: Joint::RightToes,
    };
}

/// Lifts every foot that is below the floor of the skeleton's rest.
pub fn lift_out_of_floor(target: &Skeleton, poses: &mut [Pose]) {
    for pose in poses {
        for leg in [Leg::LEFT, Leg::RIGHT] {
            lift(target, pose, leg);
        }
    }
}

/// Height of the lowest of heel and ball above the floor, metres; negative below it.
pub fn foot_height(target: &Skeleton, pose: &Pose, foot: Joint, toes: Joint) -> f64 {
    let frames = pose.joint_frames(target);
    let ankle = frames[foot.index()];
    let rest_bone = target.position(toes) - target.position(foot);
    let back = Vector3::new(rest_bone.x, 0.0, rest_bone.z) * -HEEL_BY_FOOT;
    let heel = ankle * Point3::from(Vector3::new(back.x, -target.position(foot).y, back.z));
    let ball = frames[toes.index()].translation.vector.y - target.position(toes).y;
    heel.y.min(ball)
}

fn lift(target: &Skeleton, pose: &mut Pose, leg: Leg) {
    let depth = -foot_height(target, pose, leg.foot, leg.toes);
    if depth > 0.0 {
        raise_ankle(target, pose, leg, depth);
    }
    bend_toes(target, pose, leg.foot, leg.toes);
}

/// Moves the ankle up by `height` in the plane of the leg; the foot keeps its turn in the world.
pub(crate) fn raise_ankle(target: &Skeleton, pose: &mut Pose, leg: Leg, height: f64) {
    let leg = [leg.upper, leg.lower, leg.foot];
    let frames = pose.joint_frames(target);
    let [hip, knee, ankle] = leg.map(|j| frames[j.index()].translation.vector);
    let [thigh_turn, shank_turn, foot_turn] = leg.map(|j| frames[j.index()].rotation);
    let wanted = ankle + Vector3::y() * height;
    let (thigh, shank) = ((knee - hip).norm(), (ankle - knee).norm());
    let along = unit_or(&(wanted - hip), &-Vector3::y());
    let front = thigh_turn * Vector3::z();
    let bent = knee - hip - along * along.dot(&(knee - hip));
    // A straight leg has no plane of its own: its knee goes to its front.
    let side = unit_or(&(bent + (front - along * along.dot(&front)) * 1e-3), &Vector3::z());
    let (new_knee, reach) = middle_joint(&along, (wanted - hip).norm(), &side, thigh, shank);
    let thigh_turn = swing(&(knee - hip), &new_knee) * thigh_turn;
    let shank_turn = swing(&(ankle - knee), &(along * reach - new_knee)) * shank_turn;
    let hips_turn = frames[Joint::Hips.index()].rotation;
    let turns = [hips_turn, thigh_turn, shank_turn, foot_turn];
    for (joint, pair) in leg.into_iter().zip(turns.windows(2)) {
        *pose.rotation_mut(joint) = pair[0].inverse() * pair[1];
    }
}

/// Bends the toes up until their tip is not below the floor.
fn bend_toes(target: &Skeleton, pose: &mut Pose, foot: Joint, toes: Joint) {
    let frames = pose.joint_frames(target);
    let rest_bone = target.position(toes) - target.position(foot);
    let length = TOES_BY_FOOT * rest_bone.norm();
    let rest_front = unit_or(&Vector3::new(rest_bone.x, 0.0, rest_bone.z), &Vector3::z());
    let (at, turn) = (frames[toes.index()].translation.vector, frames[toes.index()].rotation);
    let front = turn * rest_front;
    // toes lie level at rest, so their tip is then as high as their joint
    let lowest_slope = (target.position(toes).y - at.y) / length.max(1e-9);
    if front.y >= lowest_slope || lowest_slope > 0.9 {
        return;
    }
    let level = unit_or(&Vector3::new(front.x, 0.0, front.z), &rest_front);
    let raised = level * (1.0 - lowest_slope * lowest_slope).max(0.0).sqrt() + Vector3::y() * lowest_slope;
    let turned: UnitQuaternion<f64> = swing(&front, &raised) * turn;
    *pose.rotation_mut(toes) = frames[foot.index()].rotation.inverse() * turned;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sunken_foot_is_lifted_by_the_knee_alone() {
        let model = crate::BodyModel::load_default().unwrap();
        let person = model.skeleton_at(&vec![0.0; model.component_count()]);
        let mut sunken = Pose::identity();
        sunken.translation.y = -0.04;
        *sunken.rotation_mut(Joint::LeftFoot) = UnitQuaternion::from_euler_angles(0.5, 0.0, 0.0);
        let mut poses = [sunken.clone()];
        lift_out_of_floor(&person, &mut poses);
        for (foot, toes) in [(Joint::LeftFoot, Joint::LeftToes), (Joint::RightFoot, Joint::RightToes)] {
            assert!(foot_height(&person, &sunken, foot, toes) < -0.03);
            assert!(foot_height(&person, &poses[0], foot, toes).abs() < 1e-6);
        }
        let turn = |p: &Pose| p.joint_frames(&person)[Joint::LeftFoot.index()].rotation;
        assert!(turn(&poses[0]).angle_to(&turn(&sunken)) < 1e-9);
        assert_eq!(poses[0].rotation(Joint::LeftUpperArm), sunken.rotation(Joint::LeftUpperArm));
        assert_eq!(poses[0].translation, sunken.translation);
        let toe = poses[0].joint_frames(&person)[Joint::LeftToes.index()].rotation * Vector3::z();
        assert!(toe.y > -0.2, "toes point {toe}");
    }
}
