//! The unknowns of a fit: shape coefficients and joint angles, which of them are free, and how a step changes them.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use toile_character::{JOINT_COUNT, Joint, Pose, joint::JOINTS};

/// The unknowns: joint angles θ and shape coefficients β.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub pose: Pose,
    pub beta: Vec<f64>,
}

/// Which unknowns are free: translation (columns 0 to 2), rotations of `joints` (three columns each), then β.
pub(crate) struct Columns {
    pub joints: Vec<Joint>,
    of_joint: [Option<usize>; JOINT_COUNT],
    pub betas: usize,
}

impl Columns {
    pub fn new(joints: Vec<Joint>, betas: usize) -> Self {
        let mut of_joint = [None; JOINT_COUNT];
        for (k, joint) in joints.iter().enumerate() {
            of_joint[joint.index()] = Some(3 + 3 * k);
        }
        Self { joints, of_joint, betas }
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.first_beta() + self.betas
    }

    /// Column of β_0.
    pub fn first_beta(&self) -> usize {
        3 + 3 * self.joints.len()
    }

    /// First of the three columns of `joint`.
    pub fn of(&self, joint: Joint) -> Option<usize> {
        self.of_joint[joint.index()]
    }
}

impl State {
    /// The same with `count` shape coefficients: more are 0, the last ones are dropped.
    pub fn with_components(mut self, count: usize) -> Self {
        self.beta.resize(count, 0.0);
        self
    }

    /// The state after the step `delta` over `columns`: rotations are about the joint, along the world's axes.
    pub fn stepped(&self, delta: &[f64], columns: &Columns, frames: &[Isometry3<f64>]) -> Self {
        let mut next = self.clone();
        next.pose.translation += Vector3::new(delta[0], delta[1], delta[2]);
        for &joint in &columns.joints {
            let Some(c) = columns.of(joint) else { continue };
            let world = Vector3::new(delta[c], delta[c + 1], delta[c + 2]);
            let local = parent_rotation(joint, frames).inverse() * world;
            let rotation = next.pose.rotation_mut(joint);
            *rotation = UnitQuaternion::from_scaled_axis(local) * *rotation;
            rotation.renormalize();
        }
        for (b, d) in next.beta.iter_mut().zip(&delta[columns.first_beta()..]) {
            *b += d;
        }
        next
    }
}

/// World orientation of the frame that `joint`'s local rotation is expressed in.
pub(crate) fn parent_rotation(joint: Joint, frames: &[Isometry3<f64>]) -> UnitQuaternion<f64> {
    joint.parent().map_or_else(UnitQuaternion::identity, |p| frames[p.index()].rotation)
}

/// Inverse of the left Jacobian of SO(3): how a rotation vector changes for a small turn on the left.
pub(crate) fn left_jacobian_inverse(v: &Vector3<f64>) -> Matrix3<f64> {
    let angle = v.norm();
    let cross = v.cross_matrix();
    let factor = if angle < 1e-4 {
        1.0 / 12.0
    } else {
        let half = 0.5 * angle;
        (1.0 - half * half.cos() / half.sin().max(1e-9)) / (angle * angle)
    };
    Matrix3::identity() - cross * 0.5 + cross * cross * factor
}

/// The joints that the coarse resolution turns.
pub(crate) fn main_joints() -> Vec<Joint> {
    use Joint::*;
    vec![
        Hips,
        Spine,
        LeftUpperArm,
        RightUpperArm,
        LeftLowerArm,
        RightLowerArm,
        LeftUpperLeg,
        RightUpperLeg,
        LeftLowerLeg,
        RightLowerLeg,
    ]
}

/// All joints but those of the fingers.
pub(crate) fn body_joints() -> Vec<Joint> {
    JOINTS.into_iter().filter(|j| !j.is_finger()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_jacobian_inverse_agrees_with_finite_differences() {
        let v = Vector3::new(0.4, -0.9, 0.3);
        let turned =
            |d: Vector3<f64>| (UnitQuaternion::from_scaled_axis(d) * UnitQuaternion::from_scaled_axis(v)).scaled_axis();
        let jacobian = left_jacobian_inverse(&v);
        for k in 0..3 {
            let d = Vector3::ith(k, 1e-6);
            let numeric = (turned(d) - turned(-d)) / 2e-6;
            assert!((jacobian.column(k) - numeric).norm() < 1e-7);
        }
    }
}
