//! What the joints do in a pose, without allocation.

use nalgebra::{Isometry3, Translation3};
use toile_character::{
    JOINT_COUNT, Pose, Skeleton,
    interpolation::rotation_between,
    joint::{JOINTS, Joint},
};

use crate::AnimationError;

/// Transforms of the joints, used again from pose to pose.
pub(super) struct Posing {
    skeleton: Skeleton,
    /// `joint_from_subject` in the first pose.
    first: [Isometry3<f64>; JOINT_COUNT],
    frames: [Isometry3<f64>; JOINT_COUNT],
    /// `posed_from_first` of each joint, as [`Pose::transforms_from`] gives it.
    pub moved: [Isometry3<f64>; JOINT_COUNT],
}

impl Posing {
    pub fn new(skeleton: &Skeleton, first: &Pose) -> Self {
        let identity = [Isometry3::identity(); JOINT_COUNT];
        let mut posing = Self { skeleton: skeleton.clone(), first: identity, frames: identity, moved: identity };
        posing.set(first);
        posing.first = posing.frames.map(|f| f.inverse());
        posing.moved = identity;
        posing
    }

    /// Takes over a pose, which [`check`] accepted.
    pub fn set(&mut self, pose: &Pose) {
        for (k, joint) in JOINTS.into_iter().enumerate() {
            self.frames[k] = match joint.parent() {
                None => Translation3::from(self.skeleton.position(joint).coords + pose.translation) * pose.rotations[k],
                Some(parent) => self.of_child(joint, parent, pose),
            };
            self.moved[k] = self.frames[k] * self.first[k];
        }
    }

    fn of_child(&self, joint: Joint, parent: Joint, pose: &Pose) -> Isometry3<f64> {
        let local = Translation3::from(self.skeleton.offset(joint)) * pose.rotation(joint);
        self.frames[parent.index()] * local
    }
}

/// Writes the pose a `share` of the way between two of equal length into `out`, as [`Pose::interpolated`] gives it.
pub(super) fn between(from: &Pose, to: &Pose, share: f64, out: &mut Pose) {
    out.translation = from.translation.lerp(&to.translation, share);
    for (out, (a, b)) in out.rotations.iter_mut().zip(from.rotations.iter().zip(&to.rotations)) {
        *out = rotation_between(a, b, share);
    }
}

/// Refuses what is no pose.
pub(super) fn check(pose: &Pose) -> Result<(), AnimationError> {
    let wrong = |reason: String| Err(AnimationError::Motion(reason));
    if pose.rotations.len() != JOINT_COUNT {
        return wrong(format!(
            "a pose has {} rotations; it needs one for each of {JOINT_COUNT} joints",
            pose.rotations.len()
        ));
    }
    let is_finite = |k: usize| pose.rotations[k].coords.iter().all(|c| c.is_finite());
    if let Some(joint) = JOINTS.into_iter().find(|j| !is_finite(j.index())) {
        return wrong(format!("the rotation of {} is not finite", joint.name()));
    }
    if !pose.translation.iter().all(|c| c.is_finite()) {
        return wrong("the place of the hips is not finite".into());
    }
    Ok(())
}
