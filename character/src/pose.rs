//! How the joints of a skeleton are turned.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::{
    joint::{JOINT_COUNT, JOINTS, Joint},
    skeleton::Skeleton,
};

/// Joint rotations relative to the rest pose, and where the hips are.
///
/// The rotation of a joint is expressed in its parent's frame; all rest frames are parallel to the subject frame.
/// The identity pose leaves the rest mesh where it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Displacement of the hips from their rest position, metres.
    pub translation: Vector3<f64>,
    /// Local rotation of each joint, by [`Joint::index`]; the hips' one turns the whole body about the hips.
    pub rotations: Vec<UnitQuaternion<f64>>,
}

impl Default for Pose {
    fn default() -> Self {
        Self::identity()
    }
}

impl Pose {
    /// The rest pose.
    pub fn identity() -> Self {
        Self { translation: Vector3::zeros(), rotations: vec![UnitQuaternion::identity(); JOINT_COUNT] }
    }

    /// Local rotation of `joint`.
    pub fn rotation(&self, joint: Joint) -> UnitQuaternion<f64> {
        self.rotations[joint.index()]
    }

    /// Local rotation of `joint`, to be changed.
    pub fn rotation_mut(&mut self, joint: Joint) -> &mut UnitQuaternion<f64> {
        &mut self.rotations[joint.index()]
    }

    /// `frame_from_joint` of every joint: orientation and position of the posed joints.
    pub fn joint_frames(&self, skeleton: &Skeleton) -> Vec<Isometry3<f64>> {
        let mut frames: Vec<Isometry3<f64>> = Vec::with_capacity(JOINT_COUNT);
        for joint in JOINTS {
            let local = match joint.parent() {
                None => Translation3::from(skeleton.position(joint).coords + self.translation) * self.rotation(joint),
                Some(_) => Translation3::from(skeleton.offset(joint)) * self.rotation(joint),
            };
            frames.push(match joint.parent() {
                None => local,
                Some(parent) => frames[parent.index()] * local,
            });
        }
        frames
    }

    /// `posed_from_rest` of every joint: the R_j(θ) of Hu et al. 2017, eq. 3.
    pub fn skinning_transforms(&self, skeleton: &Skeleton) -> Vec<Isometry3<f64>> {
        let frames = self.joint_frames(skeleton);
        JOINTS.iter().map(|&j| frames[j.index()] * Translation3::from(-skeleton.position(j).coords)).collect()
    }

    /// `posed_from_start` of every joint: what moves a mesh that is in pose `start` into this one.
    pub fn transforms_from(&self, start: &Self, skeleton: &Skeleton) -> Vec<Isometry3<f64>> {
        let frames = self.joint_frames(skeleton).into_iter().zip(start.joint_frames(skeleton));
        frames.map(|(to, from)| to * from.inverse()).collect()
    }

    /// Positions of the posed joints.
    pub fn joint_positions(&self, skeleton: &Skeleton) -> Vec<Point3<f64>> {
        self.joint_frames(skeleton).iter().map(|f| Point3::from(f.translation.vector)).collect()
    }

    /// The same body pose moved as a whole: `a_from_b` applied after this pose.
    pub fn moved(&self, a_from_b: &Isometry3<f64>, skeleton: &Skeleton) -> Self {
        let hips = skeleton.position(Joint::Hips);
        let mut moved = self.clone();
        moved.translation = a_from_b * (hips + self.translation) - hips;
        moved.rotations[0] = a_from_b.rotation * self.rotations[0];
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn skeleton() -> Skeleton {
        let mut rest = [Point3::origin(); JOINT_COUNT];
        for (i, p) in rest.iter_mut().enumerate() {
            let t = i as f64;
            *p = Point3::new((t * 0.9).sin(), 1.0 + (t * 0.4).cos(), (t * 1.7).sin());
        }
        Skeleton { rest }
    }

    #[test]
    fn identity_moves_nothing() {
        for t in Pose::identity().skinning_transforms(&skeleton()) {
            assert!((t.to_homogeneous() - nalgebra::Matrix4::identity()).norm() < 1e-12);
        }
    }

    #[test]
    fn moving_a_pose_moves_every_transform() {
        let s = skeleton();
        let mut pose = Pose::identity();
        *pose.rotation_mut(Joint::LeftUpperArm) = UnitQuaternion::from_euler_angles(0.3, -0.2, 0.9);
        pose.translation = Vector3::new(0.1, 0.0, -0.2);
        let a_from_b = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.1, 0.7, -0.4));
        let before = pose.skinning_transforms(&s);
        for (after, before) in pose.moved(&a_from_b, &s).skinning_transforms(&s).iter().zip(&before) {
            assert!((after.to_homogeneous() - (a_from_b * before).to_homogeneous()).norm() < 1e-9);
        }
    }
}
