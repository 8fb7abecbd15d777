//! The joints of a motion file recognised: limbs by name, the trunk by structure.

mod joint_names;
mod prefix;
mod source;
mod tree;

use toile_character::Joint;

pub(crate) use source::Source;

use crate::{AnimationError, Bvh};
use joint_names::Side;
use tree::{Tree, on_side};

/// Finds the joints of a person in `bvh`.
///
/// # Errors
/// [`AnimationError::UnknownSkeleton`] names the part that is missing and the joints of the file.
pub(crate) fn recognise(bvh: &Bvh) -> Result<Source, AnimationError> {
    let tree = Tree::new(bvh);
    let mut limbs = vec![None; toile_character::JOINT_COUNT];
    for side in [Side::Left, Side::Right] {
        for (joint, found) in tree.limbs_of(side) {
            limbs[on_side(joint, side).index()] = found;
        }
        tree.fingers_of(side, &mut limbs);
    }
    let missing = |what: &str| tree.unknown(what);
    let chains = [
        (Joint::LeftUpperLeg, Joint::LeftLowerLeg, "upper leg with a lower leg below it"),
        (Joint::LeftUpperArm, Joint::LeftLowerArm, "upper arm with a lower arm below it"),
    ];
    for (upper, lower, what) in chains {
        for (upper, lower, side) in [(upper, lower, "left"), (upper.mirrored(), lower.mirrored(), "right")] {
            match (limbs[upper.index()], limbs[lower.index()]) {
                (Some(u), Some(l)) if u != l && tree.is_below(l, u) => {}
                _ => return Err(missing(&format!("{side} {what}"))),
            }
        }
    }
    let required = |joint: Joint| limbs[joint.index()].unwrap_or(0);
    let pelvis = tree.common_ancestor(required(Joint::LeftUpperLeg), required(Joint::RightUpperLeg));
    let chest = tree.common_ancestor(required(Joint::LeftUpperArm), required(Joint::RightUpperArm));
    let waist = tree.common_ancestor(pelvis, chest);
    let spine = tree.path(waist, chest);
    if spine.is_empty() {
        return Err(missing("spine joint between legs and arms"));
    }
    let head = tree.head();
    let neck = head.map_or(Vec::new(), |head| {
        let mut path = tree.path(tree.common_ancestor(chest, head), head);
        path.pop();
        path
    });
    let mut source = Source { pelvis, spine, neck, head, tips: vec![None; limbs.len()], limbs };
    tree.find_tips(&mut source);
    for (joint, side) in [(Joint::LeftLowerLeg, "left"), (Joint::RightLowerLeg, "right")] {
        if source.tips[joint.index()].is_none() {
            return Err(missing(&format!("{side} foot")));
        }
    }
    Ok(source)
}
