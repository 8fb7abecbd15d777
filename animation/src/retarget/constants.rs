//! The constant rotations between the joint frames of two skeletons.

use nalgebra::{UnitQuaternion, Vector3};
use toile_character::{Joint, Skeleton};

/// `source_joint_from_target_joint` rotations and the source's up axis.
#[derive(Debug, Clone)]
pub(crate) struct Constants {
    /// Up in the source's coordinates during the motion: a coordinate axis.
    pub up: Vector3<f64>,
    /// True where the source's zero pose was taken.
    pub from_rest: bool,
    pub pelvis: UnitQuaternion<f64>,
    /// One a joint of [`Source::spine`].
    pub spine: Vec<UnitQuaternion<f64>>,
    /// One a joint of [`Source::neck`].
    pub neck: Vec<UnitQuaternion<f64>>,
    pub head: UnitQuaternion<f64>,
    /// By [`Joint::index`], meaningful where the source has the limb joint.
    pub limbs: Vec<UnitQuaternion<f64>>,
}

/// The direction of a limb's bone in the target's rest pose.
pub(crate) fn bone(target: &Skeleton, joint: Joint) -> Option<Vector3<f64>> {
    use Joint::*;
    let child = match joint {
        LeftHand => LeftMiddleProximal,
        RightHand => RightMiddleProximal,
        LeftShoulder | RightShoulder | LeftToes | RightToes => return None,
        _ => toile_character::joint::JOINTS.into_iter().find(|c| c.parent() == Some(joint))?,
    };
    Some(target.position(child) - target.position(joint))
}
