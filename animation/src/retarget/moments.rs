//! Moments of a motion, and lines of the source's body in them.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_character::Joint;
use toile_geometry::direction::{align, nearest_axis, unit_or};

use crate::{Bvh, skeleton::Source};

/// Frames looked at when something is read off the whole motion.
pub(super) fn sampled(bvh: &Bvh) -> impl Iterator<Item = usize> {
    const SAMPLES: usize = 240;
    let step = bvh.frames.len().div_ceil(SAMPLES).max(1);
    (0..bvh.frames.len()).step_by(step)
}

fn middle(source: &Source, left: Joint, world: &[Isometry3<f64>]) -> Point3<f64> {
    nalgebra::center(&source.position(left, world), &source.position(left.mirrored(), world))
}

/// From right to left across the joint pair.
pub(super) fn leftward(source: &Source, left: Joint, world: &[Isometry3<f64>]) -> Vector3<f64> {
    source.position(left, world) - source.position(left.mirrored(), world)
}

/// From the middle of the hips to the middle of the shoulders.
pub(super) fn torso(source: &Source, world: &[Isometry3<f64>]) -> Vector3<f64> {
    middle(source, Joint::LeftUpperArm, world) - middle(source, Joint::LeftUpperLeg, world)
}

/// The coordinate axis that people stand along during the motion.
pub(super) fn motion_up(bvh: &Bvh, source: &Source) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for frame in sampled(bvh) {
        let world = bvh.joint_frames(frame);
        let ankles = nalgebra::center(
            &source.ankle(Joint::LeftLowerLeg, bvh, &world),
            &source.ankle(Joint::RightLowerLeg, bvh, &world),
        );
        sum += unit_or(&(middle(source, Joint::LeftUpperArm, &world) - ankles), &Vector3::zeros());
    }
    nearest_axis(&sum)
}

/// The body frame (left, up, front as x, y, z) of a zero pose, where it is the pose of a standing person.
pub(super) fn standing_body(source: &Source, bvh: &Bvh, rest: &[Isometry3<f64>]) -> Option<UnitQuaternion<f64>> {
    use Joint::*;
    let up = unit_or(&torso(source, rest), &Vector3::zeros());
    let (hips, shoulders) = (leftward(source, LeftUpperLeg, rest), leftward(source, LeftUpperArm, rest));
    let across = |v: &Vector3<f64>| unit_or(&(v - up * up.dot(v)), &Vector3::zeros());
    let left = unit_or(&(across(&hips) + across(&shoulders)), &Vector3::zeros());
    let mut sane = across(&hips).dot(&across(&shoulders)) > 0.7 && unit_or(&hips, &up).dot(&up).abs() < 0.5;
    for (upper, lower, side) in [(LeftUpperLeg, LeftLowerLeg, 1.0), (RightUpperLeg, RightLowerLeg, -1.0)] {
        let leg = unit_or(&(source.ankle(lower, bvh, rest) - source.position(upper, rest)), &up);
        let (arm, elbow) = if side > 0.0 { (LeftUpperArm, LeftLowerArm) } else { (RightUpperArm, RightLowerArm) };
        let arm = unit_or(&(source.position(elbow, rest) - source.position(arm, rest)), &up);
        sane &= leg.dot(&up) < -0.7 && arm.dot(&left) * side > -0.3 && arm.dot(&up) < 0.7;
    }
    let snap = |v: Vector3<f64>| if v.dot(&nearest_axis(&v)) > 0.9 { nearest_axis(&v) } else { v };
    sane.then(|| align([&Vector3::y(), &Vector3::x()], [&snap(up), &snap(left)]))
}

/// The frame in which trunk and legs are straightest and nearest to upright.
pub(super) fn most_upright_frame(bvh: &Bvh, source: &Source, up: &Vector3<f64>) -> usize {
    use Joint::*;
    let bend = |frame: usize| {
        let world = bvh.joint_frames(frame);
        let mut sum = torso(source, &world).angle(up);
        for (upper, lower) in [(LeftUpperLeg, LeftLowerLeg), (RightUpperLeg, RightLowerLeg)] {
            let (hip, knee) = (source.position(upper, &world), source.position(lower, &world));
            sum += (hip - knee).angle(up) + (knee - source.ankle(lower, bvh, &world)).angle(up);
        }
        sum
    };
    sampled(bvh).min_by(|a, b| bend(*a).total_cmp(&bend(*b))).unwrap_or(0)
}
