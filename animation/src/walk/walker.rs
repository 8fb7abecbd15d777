//! The walker's joints: those of an adult 1.7 m tall in a T-pose.

use nalgebra::Vector3;
use toile_character::Joint;

use crate::bvh::{BvhJoint, Channel};

/// Centimetres a metre: BVH files are in centimetres by custom.
pub(super) const CENTIMETRES: f64 = 100.0;

/// A joint of the walker: T-pose offset from its parent, and its End Site, metres.
pub(super) type WalkerJoint = (Joint, [f64; 3], Option<[f64; 3]>);

/// The walker's joints.
pub(super) const SKELETON: &[WalkerJoint] = &[
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
pub(super) const THIGH: f64 = 0.42;
pub(super) const SHANK: f64 = 0.39;
/// Upper leg joint seen from the hips, left side, metres.
pub(super) const HIP_JOINT: [f64; 3] = [0.09, -0.05, 0.0];

/// The joints as a BVH file holds them.
pub(super) fn joints() -> Vec<BvhJoint> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walk::gait::Foot;

    #[test]
    fn offsets_agree_with_the_leg_lengths() {
        let of = |joint: Joint| SKELETON.iter().find(|s| s.0 == joint).map(|s| Vector3::from(s.1)).unwrap();
        assert_eq!(of(Joint::LeftLowerLeg).norm(), THIGH);
        assert_eq!(of(Joint::LeftFoot).norm(), SHANK);
        assert_eq!(of(Joint::LeftUpperLeg), Vector3::from(HIP_JOINT));
        assert!((of(Joint::LeftToes) - Foot::BALL).norm() < 1e-12);
    }
}
