//! The rotations between the joint frames of source and target: one constant for each joint.
//!
//! Two skeletons agree on nothing but the body that they describe: rest poses are T, A, arms down or, where bones
//! lie along their own axes, no pose at all. They are compared in a moment in which both are known to do the same, the
//! *reference*: the source's zero pose where its geometry shows a standing person, else the most upright frame of
//! the motion. There the target is turned until its limbs point like the source's, with the smallest turn from its
//! own rest; the rotations between the joint frames that remain hold for the whole motion.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use toile_character::{JOINT_COUNT, Joint, Skeleton};
use toile_geometry::direction::{align, swing, unit_or};

use super::{
    constants::{Constants, bone},
    flat_foot,
    moments::{leftward, most_upright_frame, motion_up, sampled, standing_body, torso},
};
use crate::{Bvh, skeleton::Source};

/// Where the target's trunk is turned to in the reference, in source coordinates.
struct Trunk {
    pelvis: UnitQuaternion<f64>,
    chest: UnitQuaternion<f64>,
    head: UnitQuaternion<f64>,
    /// Up of the reference pose.
    up: Vector3<f64>,
}

/// Finds the constant rotations between the joint frames of `source` and of `target`.
pub(super) fn find_reference(bvh: &Bvh, source: &Source, target: &Skeleton) -> Constants {
    let up = motion_up(bvh, source);
    let rest = bvh.rest_frames();
    if let Some(body) = standing_body(source, bvh, &rest) {
        let trunk = Trunk { pelvis: body, chest: body, head: body, up: body * Vector3::y() };
        let turned = target_in_reference(bvh, source, target, &rest, &trunk, None);
        return calibrated(source, &rest, &trunk, &turned, up, true);
    }
    let moment = bvh.joint_frames(most_upright_frame(bvh, source, &up));
    let trunk = trunk_of_frame(source, target, &moment, &up);
    let hinges = hinges(bvh, source);
    let turned = target_in_reference(bvh, source, target, &moment, &trunk, Some(&hinges));
    let mut reference = calibrated(source, &moment, &trunk, &turned, up, false);
    for foot in [Joint::LeftFoot, Joint::RightFoot] {
        flat_foot::calibrate_foot(bvh, source, target, foot, &mut reference);
    }
    reference
}

/// Turns the target's trunk like the source's in one frame: same direction of the torso, same line of hips and
/// shoulders, head level.
fn trunk_of_frame(source: &Source, target: &Skeleton, world: &[Isometry3<f64>], up: &Vector3<f64>) -> Trunk {
    use Joint::*;
    let middle = |a: Joint| nalgebra::center(&target.position(a), &target.position(a.mirrored()));
    let target_torso = middle(LeftUpperArm) - middle(LeftUpperLeg);
    let along = torso(source, world);
    let turned = |left: &Vector3<f64>| align([&target_torso, &Vector3::x()], [&along, left]);
    let shoulders = leftward(source, LeftUpperArm, world);
    Trunk {
        pelvis: turned(&leftward(source, LeftUpperLeg, world)),
        chest: turned(&shoulders),
        head: align([&Vector3::y(), &Vector3::x()], [up, &shoulders]),
        up: *up,
    }
}

/// Hinge axes of elbows and knees in the frame of the upper bone's joint, by the upper joint: the mean of upper ×
/// lower bone over the motion. `None` where the joint rarely bends.
fn hinges(bvh: &Bvh, source: &Source) -> Vec<Option<Vector3<f64>>> {
    const MIN_BEND: f64 = 0.1; // mean sine of the angle between the bones
    use Joint::*;
    let mut out = vec![None; JOINT_COUNT];
    for (upper, lower) in [
        (LeftUpperArm, LeftLowerArm),
        (RightUpperArm, RightLowerArm),
        (LeftUpperLeg, LeftLowerLeg),
        (RightUpperLeg, RightLowerLeg),
    ] {
        let (mut sum, mut count) = (Vector3::zeros(), 0.0);
        let Some(joint) = source.limb(upper) else { continue };
        for frame in sampled(bvh) {
            let world = bvh.joint_frames(frame);
            let (a, b) = (source.position(upper, &world), source.position(lower, &world));
            let Some(c) = source.tip(lower, bvh, &world) else { continue };
            let axis = unit_or(&(b - a), &Vector3::zeros()).cross(&unit_or(&(c - b), &Vector3::zeros()));
            sum += world[joint].rotation.inverse() * axis;
            count += 1.0;
        }
        if sum.norm() > MIN_BEND * count {
            out[upper.index()] = Some(sum.normalize());
        }
    }
    out
}

/// World rotations of the target's limb joints in the reference, in source coordinates.
fn target_in_reference(
    bvh: &Bvh,
    source: &Source,
    target: &Skeleton,
    world: &[Isometry3<f64>],
    trunk: &Trunk,
    hinges: Option<&[Option<Vector3<f64>>]>,
) -> Vec<UnitQuaternion<f64>> {
    let mut turned = vec![trunk.chest; JOINT_COUNT];
    for joint in toile_character::joint::JOINTS {
        let parent = match joint {
            Joint::LeftUpperLeg | Joint::RightUpperLeg => trunk.pelvis,
            Joint::LeftShoulder | Joint::RightShoulder => trunk.chest,
            _ => joint.parent().map_or(trunk.pelvis, |p| turned[p.index()]),
        };
        turned[joint.index()] = match (source.limb(joint), bone(target, joint)) {
            (Some(_), Some(rest_bone)) => {
                let hinge = hinges.and_then(|h| hinge_of(joint, source, world, h));
                let at = source.position(joint, world);
                let bone = source.tip(joint, bvh, world).map(|tip| tip - at);
                match (bone, hinge) {
                    (None, _) => parent,
                    (Some(bone), _) if is_foot(joint) => heading(&rest_bone, &bone, trunk),
                    (Some(bone), None) => swing(&(parent * rest_bone), &bone) * parent,
                    (Some(bone), Some(hinge)) => align([&rest_bone, &rest_hinge(target, joint)], [&bone, &hinge]),
                }
            }
            _ => parent,
        };
    }
    turned
}

fn is_foot(joint: Joint) -> bool {
    matches!(joint, Joint::LeftFoot | Joint::RightFoot)
}

/// A foot is flat on the ground in both skeletons wherever their joints sit: only its heading is copied.
fn heading(rest_bone: &Vector3<f64>, bone: &Vector3<f64>, trunk: &Trunk) -> UnitQuaternion<f64> {
    let upright = align([&Vector3::y(), &Vector3::x()], [&trunk.up, &(trunk.pelvis * Vector3::x())]);
    let level = |v: Vector3<f64>| v - trunk.up * trunk.up.dot(&v);
    swing(&level(upright * rest_bone), &level(*bone)) * upright
}

/// Hinge of the elbow or knee that `joint` is part of, in source coordinates at the reference.
fn hinge_of(
    joint: Joint,
    source: &Source,
    world: &[Isometry3<f64>],
    hinges: &[Option<Vector3<f64>>],
) -> Option<Vector3<f64>> {
    use Joint::*;
    let upper = match joint {
        LeftLowerArm | RightLowerArm | LeftLowerLeg | RightLowerLeg => joint.parent()?,
        _ => joint,
    };
    let axis = hinges[upper.index()]?;
    Some(world[source.limb(upper)?].rotation * axis)
}

/// Hinge of elbow or knee in the target's rest pose: elbows bend to the front, knees to the back.
fn rest_hinge(target: &Skeleton, joint: Joint) -> Vector3<f64> {
    use Joint::*;
    let leg = matches!(joint, LeftUpperLeg | RightUpperLeg | LeftLowerLeg | RightLowerLeg);
    let towards = if leg { -Vector3::z() } else { Vector3::z() };
    bone(target, joint).unwrap_or_else(Vector3::x).cross(&towards)
}

/// Constants from the world rotations of both skeletons in the reference.
fn calibrated(
    source: &Source,
    world: &[Isometry3<f64>],
    trunk: &Trunk,
    turned: &[UnitQuaternion<f64>],
    up: Vector3<f64>,
    from_rest: bool,
) -> Constants {
    let between = |joint: usize, turned: &UnitQuaternion<f64>| world[joint].rotation.inverse() * turned;
    let count = source.spine.len() as f64;
    let spine = |k: usize| trunk.pelvis.slerp(&trunk.chest, (k + 1) as f64 / count);
    Constants {
        up,
        from_rest,
        pelvis: between(source.pelvis, &trunk.pelvis),
        spine: source.spine.iter().enumerate().map(|(k, &j)| between(j, &spine(k))).collect(),
        neck: source.neck.iter().map(|&j| between(j, &trunk.head)).collect(),
        head: source.head.map_or_else(UnitQuaternion::identity, |j| between(j, &trunk.head)),
        limbs: toile_character::joint::JOINTS
            .iter()
            .map(|&j| source.limb(j).map_or_else(UnitQuaternion::identity, |s| between(s, &turned[j.index()])))
            .collect(),
    }
}
