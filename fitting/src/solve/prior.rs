//! Priors of shape and pose: β is unit normal, joints stay near a pose and within human limits.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use toile_character::{Joint, JointLimit, Pose, Skeleton, joint_limits, limits::rotation_vector};

use super::{
    Columns, NormalEquations, State,
    state::{left_jacobian_inverse, parent_rotation},
};

/// Standard deviation of what lies beyond a joint's limit, radians (1.1°): how exactly the limits are known.
const LIMIT_SIGMA: f64 = 0.02;

/// Smallest standard deviation of a joint, radians: keeps the equations finite.
const SMALLEST_SIGMA: f64 = 1e-6;

/// Priors of the joints: the pose they are drawn to and how strongly.
pub(crate) struct JointPrior {
    /// The pose that joints are drawn to.
    pub center: Pose,
    /// Standard deviation of each joint's rotation, radians, by [`Joint::index`].
    pub sigma: Vec<f64>,
    /// Limits of the human joints, which hold whatever the centre is.
    limits: Vec<JointLimit>,
}

impl JointPrior {
    /// The prior of someone standing more or less in the A-pose that the model rests in.
    pub fn standing(skeleton: &Skeleton) -> Self {
        let sigma = toile_character::joint::JOINTS.iter().map(|&j| standing_sigma(j).to_radians()).collect();
        Self { center: Pose::identity(), sigma, limits: joint_limits(skeleton) }
    }

    /// The prior of someone who stands in any way: limbs go where their joints let them, trunk and head bend a little.
    pub fn roaming(skeleton: &Skeleton) -> Self {
        let sigma = toile_character::joint::JOINTS.iter().map(|&j| roaming_sigma(j).to_radians()).collect();
        Self { center: Pose::identity(), sigma, limits: joint_limits(skeleton) }
    }

    /// Drawn to `center`: body joints with standard deviation `sigma` (radians), toes with half of it, fingers with a tenth.
    pub fn around(center: Pose, sigma: f64, skeleton: &Skeleton) -> Self {
        use Joint::*;
        let of = |j: &Joint| match j {
            j if j.is_finger() => 0.1 * sigma,
            LeftToes | RightToes => 0.5 * sigma,
            _ => sigma,
        };
        Self { center, sigma: toile_character::joint::JOINTS.iter().map(of).collect(), limits: joint_limits(skeleton) }
    }

    /// Adds the joints' part of the cost.
    pub fn add(&self, equations: &mut NormalEquations, state: &State, frames: &[Isometry3<f64>], columns: &Columns) {
        for &joint in columns.joints.iter().filter(|&&j| j != Joint::Hips) {
            let sigma = self.sigma[joint.index()].max(SMALLEST_SIGMA);
            Self::hold(joint, &self.center.rotation(joint), sigma, equations, state, frames, columns);
            for limit in self.limits.iter().filter(|l| l.joint == joint) {
                add_limit(limit, equations, state, frames, columns);
            }
        }
    }

    /// Adds the cost of a joint's turn away from `center`, with standard deviation `sigma` (radians).
    pub fn hold(
        joint: Joint,
        center: &UnitQuaternion<f64>,
        sigma: f64,
        equations: &mut NormalEquations,
        state: &State,
        frames: &[Isometry3<f64>],
        columns: &Columns,
    ) {
        let Some(at) = columns.of(joint) else { return };
        let v = rotation_vector(&(state.pose.rotation(joint) * center.inverse()));
        let inverse_sigma = 1.0 / sigma;
        let jacobian = left_jacobian_inverse(&v) * to_local(joint, frames) * inverse_sigma;
        equations.add_triple(at, &(v * inverse_sigma), &jacobian);
    }
}

/// Takes a turn about the world's axes to the frame that the joint's rotation is expressed in.
fn to_local(joint: Joint, frames: &[Isometry3<f64>]) -> Matrix3<f64> {
    parent_rotation(joint, frames).inverse().to_rotation_matrix().into_inner()
}

fn add_limit(
    limit: &JointLimit,
    equations: &mut NormalEquations,
    state: &State,
    frames: &[Isometry3<f64>],
    columns: &Columns,
) {
    let Some(at) = columns.of(limit.joint) else { return };
    let rotation = &state.pose.rotation(limit.joint);
    let beyond = limit.beyond(rotation);
    if beyond == 0.0 {
        return;
    }
    let to_local = to_local(limit.joint, frames);
    let row = limit.axis.transpose() * left_jacobian_inverse(&rotation_vector(rotation)) * to_local / LIMIT_SIGMA;
    let mut jacobian = Matrix3::zeros();
    jacobian.set_row(0, &row);
    equations.add_triple(at, &Vector3::new(beyond / LIMIT_SIGMA, 0.0, 0.0), &jacobian);
}

/// β is unit normal by the model's scaling.
pub(crate) fn add_shape_prior(equations: &mut NormalEquations, state: &State, columns: &Columns, sigma: f64) {
    for (b, &value) in state.beta.iter().take(columns.betas).enumerate() {
        equations.add_single(columns.first_beta() + b, value, sigma);
    }
}

/// Standard deviation of a joint's rotation about the A-pose in someone standing on a turntable, degrees.
#[expect(clippy::match_same_arms, reason = "a table, in the order of the body")]
fn standing_sigma(joint: Joint) -> f64 {
    use Joint::*;
    match joint {
        Hips => 180.0,
        Spine | Chest | UpperChest => 5.0,
        Neck | Head => 8.0,
        LeftShoulder | RightShoulder => 6.0,
        LeftUpperArm | RightUpperArm => 25.0,
        LeftLowerArm | RightLowerArm => 20.0,
        LeftHand | RightHand => 12.0,
        LeftUpperLeg | RightUpperLeg => 10.0,
        LeftLowerLeg | RightLowerLeg => 8.0,
        LeftFoot | RightFoot => 8.0,
        LeftToes | RightToes => 5.0,
        LeftThumbMetacarpal | RightThumbMetacarpal => 8.0,
        _ => 8.0,
    }
}

/// Standard deviation of a joint's rotation about the A-pose in someone who stands anyhow, degrees: a half of what healthy
/// joints can do (American Academy of Orthopaedic Surgeons, ranges of motion).
#[expect(clippy::match_same_arms, reason = "a table, in the order of the body")]
fn roaming_sigma(joint: Joint) -> f64 {
    use Joint::*;
    match joint {
        Hips => 180.0,
        Spine | Chest | UpperChest => 15.0,
        Neck | Head => 20.0,
        LeftShoulder | RightShoulder => 12.0,
        LeftUpperArm | RightUpperArm | LeftLowerArm | RightLowerArm => 75.0,
        LeftUpperLeg | RightUpperLeg | LeftLowerLeg | RightLowerLeg => 60.0,
        LeftHand | RightHand => 30.0,
        LeftFoot | RightFoot => 20.0,
        _ => 10.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{solve::Articulated, surface::Thinned};
    use toile_character::BodyModel;

    #[test]
    fn the_gradient_is_the_costs_derivative() {
        let model = BodyModel::load_default().unwrap();
        let body = Articulated::of_model(&model, &Thinned::of_vertices(vec![0]), 3);
        let mut state = State { pose: Pose::identity(), beta: vec![0.5, -1.0, 2.0] };
        *state.pose.rotation_mut(Joint::LeftLowerLeg) = UnitQuaternion::from_euler_angles(-0.3, 0.5, 0.2);
        *state.pose.rotation_mut(Joint::Hips) = UnitQuaternion::from_euler_angles(0.1, 2.0, 0.0);
        let columns = Columns::new(vec![Joint::Hips, Joint::LeftUpperLeg, Joint::LeftLowerLeg], 3);
        let prior = JointPrior::standing(&model.mean_skeleton);
        let at = |s: &State| {
            let mut e = NormalEquations::zeros(columns.len());
            prior.add(&mut e, s, &body.pose(s).frames, &columns);
            add_shape_prior(&mut e, s, &columns, 1.0);
            e
        };
        let (here, frames) = (at(&state), body.pose(&state).frames);
        for c in 3..columns.len() {
            let cost = |h: f64| {
                let mut delta = vec![0.0; columns.len()];
                delta[c] = h;
                at(&state.stepped(&delta, &columns, &frames)).cost
            };
            let numeric = (cost(1e-6) - cost(-1e-6)) / 2e-6;
            assert!((here.g[c] - numeric).abs() < 1e-3 * (1.0 + numeric.abs()), "{c}: {} against {numeric}", here.g[c]);
        }
    }
}
