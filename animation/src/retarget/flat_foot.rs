//! The turn of a foot that stands flat, from the motion where the zero pose does not show it.

use nalgebra::{UnitQuaternion, Vector3};
use toile_character::{Joint, Skeleton};
use toile_geometry::direction::{align, swing};

use super::{
    constants::{Constants, bone},
    moments::sampled,
};
use crate::{Bvh, skeleton::Source};

/// Share of the frames, those with the lowest ankle and toe, that count as standing.
const STANDING_SHARE: f64 = 0.3;

/// Sets the constants of `foot` and its toes so that the target's foot is flat where the source's stands: of the
/// frames with the foot lowest, the one with the median pitch counts as flat, whatever the joints' heights.
pub(super) fn calibrate_foot(bvh: &Bvh, source: &Source, target: &Skeleton, foot: Joint, constants: &mut Constants) {
    let (Some(joint), Some(rest_bone)) = (source.limb(foot), bone(target, foot)) else { return };
    let up = constants.up;
    let mut frames: Vec<(f64, f64, usize)> = Vec::new();
    for frame in sampled(bvh) {
        let world = bvh.joint_frames(frame);
        let Some(tip) = source.tip(foot, bvh, &world) else { return };
        let at = source.position(foot, &world);
        let pitch = (tip - at).angle(&up);
        frames.push(((tip.coords + at.coords).dot(&up), pitch, frame));
    }
    frames.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    let standing = ((frames.len() as f64 * STANDING_SHARE).ceil() as usize).clamp(1, frames.len());
    let lowest = &mut frames[..standing];
    lowest.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.cmp(&b.2)));
    let world = bvh.joint_frames(lowest[standing / 2].2);
    let Some(tip) = source.tip(foot, bvh, &world) else { return };
    let flat = flat_foot(&rest_bone, &(tip - source.position(foot, &world)), &up);
    constants.limbs[foot.index()] = world[joint].rotation.inverse() * flat;
    let toes = if foot == Joint::LeftFoot { Joint::LeftToes } else { Joint::RightToes };
    if let Some(joint) = source.limb(toes) {
        constants.limbs[toes.index()] = world[joint].rotation.inverse() * flat;
    }
}

/// The target's foot flat on the ground with the heading of `bone`.
fn flat_foot(rest_bone: &Vector3<f64>, bone: &Vector3<f64>, up: &Vector3<f64>) -> UnitQuaternion<f64> {
    let level = |v: Vector3<f64>| v - up * up.dot(&v);
    let upright = align([&Vector3::y(), &Vector3::z()], [up, &level(*bone)]);
    swing(&level(upright * rest_bone), &level(*bone)) * upright
}
