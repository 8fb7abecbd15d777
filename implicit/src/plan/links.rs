//! The links that contours lie around.

use toile_character::Joint;

use crate::bones::{Chain, Place};

/// Links of trunk, neck and head.
pub(super) fn spine() -> Chain {
    use Joint::*;
    let mut places = vec![Place::Seat];
    places.extend([Spine, Chest, UpperChest, Neck, Head].map(Place::Joint));
    Chain(places)
}

/// Links of an arm, from the collar bone.
pub(super) fn arm_chain(side: usize) -> Chain {
    use Joint::*;
    let joints = [
        [LeftShoulder, LeftUpperArm, LeftLowerArm, LeftHand],
        [RightShoulder, RightUpperArm, RightLowerArm, RightHand],
    ];
    Chain(joints[side].map(Place::Joint).to_vec())
}

/// Links of a leg.
pub(super) fn leg_chain(side: usize) -> Chain {
    use Joint::*;
    let joints = [[LeftUpperLeg, LeftLowerLeg, LeftFoot], [RightUpperLeg, RightLowerLeg, RightFoot]];
    Chain(joints[side].map(Place::Joint).to_vec())
}
