//! Limbs that the person holds in another way than in the take before: lower arms, a hand on the hip, a step.
//!
//! Skin under clothes lies inside the scan. Where much of the mesh lies far outside it although the trunk is placed, limbs
//! are laid anew as in a fit of any pose, and the pose found becomes the one that joints are drawn to.

use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use toile_character::{Joint, Pose, joint::JOINTS};
use toile_geometry::Mesh;

use super::{inside::Inside, problem::Sampled};
use crate::{
    FittingError,
    fit::{BodyProblem, Depths, Search},
    solve::{Columns, Gate, JointPrior, State, main_joints},
    surface::{Cloud, Samples, Thinned, trust_of},
};

/// Farther outside than this is no noise, metres: five standard deviations of a scan's.
const FAR: f32 = 0.010;
/// Share of the mesh far outside from which on limbs are laid anew: a hand and a half.
const ASTRAY: f64 = 0.03;
/// Sampling of mesh and scan, metres, and the conditions for pairs of them: limbs may be anywhere.
const MESH_CELL: f32 = 0.05;
const SCAN_CELL: f32 = 0.03;
const REVERSE_CELL: f32 = 0.045;
const GATE: Gate = Gate { distance: 0.25, slip: 0.12, min_cos: 0.3, kernel: 0.06, noise: 0.02, cloth: None };

/// Turn of a joint away from the pose that it is drawn to, in standard deviations, from which on the person stands in another
/// way: 8.6° by default, three times what people turn their joints who step onto the disk again.
const STRAINED: f64 = 3.0;

/// Whether a joint but the hips turned far away from `initial`, where it is held with the standard deviation `sigma` (radians).
pub(super) fn is_strained(initial: &Pose, state: &State, sigma: f64) -> bool {
    let joints = JOINTS.into_iter().filter(|j| *j != Joint::Hips && !j.is_finger());
    joints.map(|j| initial.rotation(j).angle_to(&state.pose.rotation(j))).any(|turn| turn > STRAINED * sigma)
}

/// Whether so much of the mesh lies far outside the scan that a limb is elsewhere.
pub(super) fn is_elsewhere(sampled: &Sampled, inside: &Inside, state: &State) -> bool {
    let points = sampled.body.pose(state).points;
    let far = |v: &usize| inside.is_far_outside(&points[*v], FAR);
    let out: Vec<usize> = (0..points.len()).into_par_iter().with_min_len(64).filter(far).collect();
    let area = |v: usize| f64::from(sampled.body.areas[v]);
    let total: f64 = (0..points.len()).map(area).sum();
    out.into_iter().map(area).sum::<f64>() > ASTRAY * total
}

/// The pose with limbs laid where the scan shows them; `dressed` stands in `state`.
///
/// # Errors
/// [`FittingError::Singular`] where the scan leaves the pose undetermined.
pub(super) fn with_limbs_laid(
    dressed: &toile_character::SkinnedMesh,
    scan: &Mesh,
    inside: &Inside,
    state: &State,
) -> Result<Option<Pose>, FittingError> {
    let (normals, trust) = (scan.vertex_normals(), trust_of(scan));
    let Some(cloud) = Cloud::new(Samples::of_mesh(scan, &normals, &trust, SCAN_CELL)) else { return Ok(None) };
    let reverse = Samples::of_mesh(scan, &normals, &trust, REVERSE_CELL);
    let Some(depths) = Depths::new(scan, inside.bvh()) else { return Ok(None) };
    let picked = Thinned::new(&dressed.mesh, &dressed.mesh.vertex_normals(), MESH_CELL, |_| true);
    let body = crate::solve::Articulated::of_skinned(dressed, &picked);
    let prior = JointPrior::roaming(&dressed.skeleton);
    let problem = BodyProblem {
        body: &body,
        scan: &cloud,
        reverse: &reverse,
        gate: GATE,
        columns: Columns::new(main_joints(), 0),
        prior: &prior,
        guide: None,
        shape_sigma: 1.0, // no coefficient is free
        is_rooted: false,
        rest: 0.0,
    };
    let search = Search { problem: &problem, depths: &depths };
    Ok(Some(search.with_limbs(state.clone(), UnitQuaternion::identity(), true)?.state.pose))
}
