//! Where the trunk may be: around the thickest part of the scan, turned and shifted along its axis, fitted without limbs.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_character::{BodyModel, Joint, Pose};
use toile_geometry::Mesh;

use super::{super::resolution::Sampled, depths::Thick};
use crate::{
    FittingError,
    fit::{guides::Guides, resolution::Resolution, starts::COARSE_SHAPE_SIGMA},
    solve::{Columns, JointPrior, State, descend},
    surface::Samples,
};

/// Turns about the trunk's axis that are tried.
const ROLLS: usize = 12;
/// Shifts along it, metres: thighs make the thick part longer, a hidden belly shorter.
const SHIFTS: [f64; 3] = [-0.12, 0.0, 0.12];
/// The lowest that the upper end of the trunk may point, as a cosine with up: a deep bow.
const LOWEST: f64 = -0.8;
/// An axis within this cosine of the vertical points up.
const UPRIGHT: f64 = 0.7;
/// Gauss–Newton steps of each.
const STEPS: usize = 10;
/// Two trunks nearer than this are one: metres and radians.
const SAME_PLACE: f64 = 0.06;
const SAME_TURN: f64 = 0.35;

/// Trunks that agree with the scan, best first, none twice; limbs are at rest.
///
/// # Errors
/// [`FittingError`] where the scan has no surface or leaves the trunk undetermined.
pub(super) fn placed_trunks(
    model: &BodyModel,
    (scan, trust): (&Mesh, &[f32]),
    thick: &Thick,
    up: &UnitQuaternion<f64>,
    prior: &JointPrior,
    coarse: Resolution,
) -> Result<Vec<State>, FittingError> {
    let sampled = Sampled::of_part(model, (scan, trust), &Guides::default(), coarse, &is_trunk)?;
    let mut problem = sampled.problem(prior, COARSE_SHAPE_SIGMA);
    let none = Samples::default();
    problem.reverse = &none;
    problem.columns = Columns::new(vec![Joint::Hips, Joint::Spine, Joint::UpperChest, Joint::Neck], sampled.components);
    let fitted = |state: State| -> Result<(State, f64), FittingError> {
        let end = descend(&problem, state, STEPS)?.state;
        let misfit = problem.misfit(&end);
        Ok((end, misfit))
    };
    let starts = starts(model, thick, up, sampled.components);
    let mut ends = starts.into_par_iter().map(fitted).collect::<Result<Vec<_>, _>>()?;
    ends.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut distinct: Vec<State> = Vec::new();
    for (end, _) in ends {
        if !distinct.iter().any(|other| is_same(model, other, &end)) {
            distinct.push(end);
        }
    }
    Ok(distinct)
}

/// Trunk, neck and head.
pub(super) fn is_trunk(joint: Joint) -> bool {
    use Joint::*;
    matches!(joint, Hips | Spine | Chest | UpperChest | Neck | Head | LeftShoulder | RightShoulder)
}

fn starts(model: &BodyModel, thick: &Thick, up: &UnitQuaternion<f64>, components: usize) -> Vec<State> {
    let vertical = up.inverse() * Vector3::y();
    let signed = [thick.axis, -thick.axis].into_iter().filter(|a| {
        let rise = a.dot(&vertical);
        rise > LOWEST && (rise > 0.0 || rise.abs() < UPRIGHT)
    });
    let mut axes: Vec<Vector3<f64>> = signed.collect();
    axes.push(vertical);
    let skeleton = &model.mean_skeleton;
    let middle = nalgebra::center(&skeleton.position(Joint::Hips), &skeleton.position(Joint::UpperChest));
    let mut out = Vec::new();
    for axis in axes {
        let raise = UnitQuaternion::rotation_between(&Vector3::y(), &axis)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        for roll in 0..ROLLS {
            let roll = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), TAU * roll as f64 / ROLLS as f64);
            let turn = raise * roll;
            for shift in SHIFTS {
                let goal: Point3<f64> = thick.middle + axis * shift;
                let stand = Isometry3::from_parts(Translation3::from(goal - turn * middle), turn);
                out.push(State { pose: Pose::identity().moved(&stand, skeleton), beta: vec![0.0; components] });
            }
        }
    }
    out
}

fn is_same(model: &BodyModel, a: &State, b: &State) -> bool {
    let at = |s: &State| s.pose.joint_frames(&model.skeleton_at(&s.beta))[Joint::UpperChest.index()];
    let (a, b) = (at(a), at(b));
    (a.translation.vector - b.translation.vector).norm() < SAME_PLACE && a.rotation.angle_to(&b.rotation) < SAME_TURN
}
