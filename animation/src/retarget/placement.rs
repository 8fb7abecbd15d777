//! Where a motion's source stands in the subject's frame: its size, its axes and its legs.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_character::{Joint, Pose, Skeleton, joint::JOINTS};
use toile_geometry::direction::{align, unit_or};

use super::constants::Constants;
use crate::{AnimationError, Bvh, skeleton::Source};

/// Target metres per file unit, by the length of the legs: files are in metres, centimetres, inches and units of
/// their own, and nothing in them says which.
pub(super) fn scale(bvh: &Bvh, source: &Source, target: &Skeleton) -> Result<f64, AnimationError> {
    use Joint::*;
    let world = bvh.joint_frames(0);
    let (mut from, mut to) = (0.0, 0.0);
    for (upper, lower, foot) in [(LeftUpperLeg, LeftLowerLeg, LeftFoot), (RightUpperLeg, RightLowerLeg, RightFoot)] {
        let (hip, knee) = (source.position(upper, &world), source.position(lower, &world));
        from += (knee - hip).norm() + (source.ankle(lower, bvh, &world) - knee).norm();
        to += target.offset(lower).norm() + target.offset(foot).norm();
    }
    if from < 1e-9 || to < 1e-9 {
        return Err(AnimationError::Motion("the legs of the file's skeleton, or of the target, have no length".into()));
    }
    Ok(to / from)
}

/// The source's axes turned to +Y up and, where `face_front` is set, so that the hips look along +Z in frame `first`.
pub(super) fn subject_from_source(
    bvh: &Bvh,
    source: &Source,
    reference: &Constants,
    first: usize,
    face_front: bool,
) -> UnitQuaternion<f64> {
    let hips = bvh.joint_frames(first)[source.pelvis].rotation * reference.pelvis;
    let forward = if face_front { hips * Vector3::z() } else { reference.up.yzx() };
    let level = forward - reference.up * reference.up.dot(&forward);
    // Someone who lies on the back or the belly has no level front: the direction of the head serves then.
    let front = unit_or(&level, &(hips * Vector3::y()));
    align([&reference.up, &front], [&Vector3::y(), &Vector3::z()])
}

/// The middle between the joints of the upper legs.
pub(super) fn mid_legs(source: &Source, world: &[Isometry3<f64>]) -> Point3<f64> {
    nalgebra::center(&source.position(Joint::LeftUpperLeg, world), &source.position(Joint::RightUpperLeg, world))
}

/// The pose with these world rotations whose upper legs start about the point `legs`.
pub(super) fn pose_of(target: &Skeleton, rotations: &[UnitQuaternion<f64>], legs: &Vector3<f64>) -> Pose {
    let mut pose = Pose::identity();
    for joint in JOINTS {
        let parent = joint.parent().map_or_else(UnitQuaternion::identity, |p| rotations[p.index()]);
        *pose.rotation_mut(joint) = parent.inverse() * rotations[joint.index()];
    }
    let hips = target.position(Joint::Hips);
    let middle = nalgebra::center(&target.position(Joint::LeftUpperLeg), &target.position(Joint::RightUpperLeg));
    pose.translation = legs - rotations[0] * (middle - hips) - hips.coords;
    pose
}
