//! The stance that a body is measured in.
//!
//! The model's A-pose is made for skinning: its legs are straightened along the line from hip to ankle, which dents
//! the seat and sinks the crown. A person who stands straight has the knee a little before that line and the legs
//! less far apart, which is also the stance that the template was sculpted in. The A-pose's skinning is undone
//! vertex by vertex, so that no detail is lost.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_character::{JOINT_COUNT, Joint, Pose, Skeleton, SkinnedMesh, joint::JOINTS, skinning};
use toile_geometry::Mesh;

/// Directions of a standing person's left leg bones: degrees outward and forward of plumb.
const THIGH: (f64, f64) = (6.0, 4.5);
const SHANK: (f64, f64) = (4.4, -2.6);

/// The body (at rest in the A-pose) standing naturally, feet level, arms as at rest.
pub(crate) fn standing(body: &SkinnedMesh) -> Mesh {
    let transforms = stance(&body.skeleton).skinning_transforms(&body.skeleton);
    let rest_from_stance: Vec<Isometry3<f64>> = transforms.iter().map(Isometry3::inverse).collect();
    let positions: Vec<Point3<f32>> = skinning::unskin(&body.mesh.positions, &body.weights, &rest_from_stance);
    Mesh::new(positions, body.mesh.triangles.clone())
}

/// The pose that brings the A-pose to the natural stance.
pub(crate) fn stance(skeleton: &Skeleton) -> Pose {
    let mut world = [UnitQuaternion::identity(); JOINT_COUNT];
    let mut pose = Pose::identity();
    for joint in JOINTS {
        let parent = joint.parent().map_or_else(UnitQuaternion::identity, |p| world[p.index()]);
        world[joint.index()] = match goal(joint) {
            Some((child, direction)) => {
                let bone = parent * (skeleton.position(child) - skeleton.position(joint));
                minimum_turn(&bone, &direction) * parent
            }
            None if matches!(joint, Joint::LeftFoot | Joint::RightFoot) => UnitQuaternion::identity(),
            None => parent,
        };
        *pose.rotation_mut(joint) = parent.inverse() * world[joint.index()];
    }
    pose
}

fn goal(joint: Joint) -> Option<(Joint, Vector3<f64>)> {
    use Joint::*;
    let along = |side: f64, (out, forward): (f64, f64)| {
        Vector3::new(side * out.to_radians().tan(), -1.0, forward.to_radians().tan()).normalize()
    };
    match joint {
        LeftUpperLeg => Some((LeftLowerLeg, along(1.0, THIGH))),
        RightUpperLeg => Some((RightLowerLeg, along(-1.0, THIGH))),
        LeftLowerLeg => Some((LeftFoot, along(1.0, SHANK))),
        RightLowerLeg => Some((RightFoot, along(-1.0, SHANK))),
        _ => None,
    }
}

/// Smallest rotation from one direction to another, also where they are (nearly) the same.
fn minimum_turn(from: &Vector3<f64>, to: &Vector3<f64>) -> UnitQuaternion<f64> {
    let (Some(a), Some(b)) = (from.try_normalize(1e-9), to.try_normalize(1e-9)) else {
        return UnitQuaternion::identity();
    };
    let axis = a.cross(&b);
    let sine = axis.norm();
    match axis.try_normalize(1e-12) {
        Some(axis) => UnitQuaternion::from_scaled_axis(axis * sine.atan2(a.dot(&b))),
        None => UnitQuaternion::identity(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toile_character::BodyModel;

    #[test]
    fn standing_turns_the_leg_bones_and_leaves_the_trunk() {
        let model = BodyModel::load_default().unwrap();
        let body = model.skinned(&[]);
        let pose = stance(&body.skeleton);
        let at = pose.joint_positions(&body.skeleton);
        let thigh = at[Joint::LeftLowerLeg.index()] - at[Joint::LeftUpperLeg.index()];
        assert!((thigh.z.atan2(-thigh.y).to_degrees() - THIGH.1).abs() < 1e-6);
        let stood = standing(&body);
        let highest = |m: &Mesh| m.positions.iter().map(|p| p.y).fold(f32::MIN, f32::max);
        assert!((highest(&stood) - highest(&body.mesh)).abs() < 1e-5);
        assert!(stood.positions.iter().all(|p| p.coords.iter().all(|c| c.is_finite())));
    }
}
