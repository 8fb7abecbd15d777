//! Hands, once the body stands: wrists and fingers, or wrists and arms in a later take; a few hundred vertices.

use nalgebra::Point3;
use toile_character::{BodyModel, Joint, Pose, Region, SkinnedMesh, joint::JOINTS};
use toile_geometry::{Mesh, mesh::vertex_normals};

use super::problem::BodyProblem;
use crate::{
    FittingError,
    solve::{Articulated, Columns, Gate, JointPrior, State, descend},
    surface::{Cloud, Nearby, Samples, Thinned},
};

/// Sampling of hands and scan, metres: a third of a finger's width.
const CELL: f32 = 0.004;
/// Scan farther than this from every hand vertex is left out, metres.
const NEAR: f32 = 0.03;
/// Share of the hands' area that must have scan near it; below, the fingers stay at rest.
const SEEN_SHARE: f32 = 0.3;
/// Gauss–Newton steps at most.
const ITERATIONS: usize = 8;
/// The conditions for pairs of hand and scan: within a finger's thickness and on the same side of it.
const GATE: Gate = Gate { distance: 0.02, slip: 0.008, min_cos: 0.4, kernel: 0.005, noise: FIRST_NOISE, cloth: None };
/// Standard deviation of the scan's fingers in the first take, metres. Fingers melt together in a scan, so that it counts
/// little against the resting hand.
const FIRST_NOISE: f32 = 0.015;
/// The same of wrists and palms in a later take, metres.
const AGAIN_NOISE: f32 = 0.004;
const WRISTS: [Joint; 2] = [Joint::LeftHand, Joint::RightHand];
const ARMS: [(Region, [Joint; 2]); 2] = [
    (Region::LeftArm, [Joint::LeftUpperArm, Joint::LeftLowerArm]),
    (Region::RightArm, [Joint::RightUpperArm, Joint::RightLowerArm]),
];
/// An arm is hidden where less than this share of it lies within [`ON_SCAN`] (metres) of the scan.
const ARM_SEEN: f64 = 0.5;
const ON_SCAN: f32 = 0.004;
/// Sampling of the scan for that, metres.
const ARM_CELL: f32 = 0.008;
/// Standard deviation of the turn of arms and wrists that is left to find in the next take, radians (3.4°).
const AGAIN_SIGMA: f64 = 0.06;

/// Turns wrists and fingers of the statistical body to the scan; everything else stays. Hands that the scan does not
/// show keep their pose. Shape coefficients do not change.
pub(crate) fn fit_fingers(model: &BodyModel, scan: &Mesh, trust: &[f32], state: State) -> Result<State, FittingError> {
    let mesh = Mesh::new(model.mean.clone(), model.triangles.clone());
    let body = Articulated::of_model(model, &hands(model, &mesh), state.beta.len());
    let Some(around) = ScanAround::new(&body, &state, scan, trust) else { return Ok(state) };
    let prior = JointPrior::standing(&model.mean_skeleton);
    let joints = JOINTS.into_iter().filter(|j| j.is_finger() || WRISTS.contains(j)).collect();
    let problem = around.problem(&body, &prior, joints, FIRST_NOISE);
    let end = descend(&problem, state.clone(), ITERATIONS)?.state;
    Ok(if problem.misfit(&end) <= problem.misfit(&state) { end } else { state })
}

/// The same for a body whose own shape is known (template topology), from a pose that is nearly right: wrists turn, and
/// arms that sleeves hide bring the hands to where they are seen. The trunk and arms that are seen stay, and so do
/// fingers, whose motion since is finer than a scan in which they often melt together. A pose that agrees less with
/// the scan is not taken.
pub(crate) fn fit_hands_again(
    model: &BodyModel,
    body: &SkinnedMesh,
    scan: &Mesh,
    trust: &[f32],
    pose: &Pose,
) -> Result<Pose, FittingError> {
    let mut joints = WRISTS.to_vec();
    joints.extend(hidden_arms(model, body, scan, trust, pose));
    let prior = JointPrior::around(pose.clone(), AGAIN_SIGMA, &body.skeleton);
    let body = Articulated::of_skinned(body, &hands(model, &body.mesh));
    let state = State { pose: pose.clone(), beta: Vec::new() };
    let Some(around) = ScanAround::new(&body, &state, scan, trust) else { return Ok(state.pose) };
    let problem = around.problem(&body, &prior, joints, AGAIN_NOISE);
    let end = descend(&problem, state.clone(), ITERATIONS)?.state;
    Ok(if problem.misfit(&end) <= problem.misfit(&state) { end.pose } else { state.pose })
}

/// Joints of the arms that the scan does not show.
fn hidden_arms(model: &BodyModel, body: &SkinnedMesh, scan: &Mesh, trust: &[f32], pose: &Pose) -> Vec<Joint> {
    let Some(cloud) = Cloud::new(Samples::of_mesh(scan, &scan.normals, trust, ARM_CELL)) else { return Vec::new() };
    let points = body.posed(pose);
    let normals = vertex_normals(&points, &body.mesh.triangles);
    let on_scan = |v: &usize| {
        let near = cloud.nearest(&points[*v], &normals[*v], 2.0 * ARM_CELL, 0.5).map(|q| q as usize);
        near.is_some_and(|q| (points[*v] - cloud.samples.points[q]).dot(&cloud.samples.normals[q]).abs() < ON_SCAN)
    };
    let is_hidden = |region: Region| {
        let of_arm: Vec<usize> = (0..points.len()).filter(|&v| model.regions[v] == region).collect();
        let seen = of_arm.iter().filter(|v| on_scan(v)).count();
        (seen as f64) < ARM_SEEN * of_arm.len() as f64
    };
    ARMS.iter().filter(|arm| is_hidden(arm.0)).flat_map(|arm| arm.1).collect()
}

/// Samples of both hands' skin.
fn hands(model: &BodyModel, mesh: &Mesh) -> Thinned {
    let is_hand = |v: usize| matches!(model.regions[v], Region::LeftHand | Region::RightHand);
    Thinned::new(mesh, &mesh.vertex_normals(), CELL, |v| is_hand(v) && !model.inner[v])
}

/// The scan's samples around the hands, as the cloud and as what is looked up in the other direction.
struct ScanAround {
    cloud: Cloud,
    reverse: Samples,
}

impl ScanAround {
    /// `None` where too little of the hands was scanned.
    fn new(body: &Articulated, state: &State, scan: &Mesh, trust: &[f32]) -> Option<Self> {
        let hands = body.pose(state).points;
        let around = Self::near(&hands, scan, trust)?;
        let samples = Nearby::new(around.reverse.points.iter().copied())?;
        let near = |p: &Point3<f32>| samples.distance(p) < 0.5 * NEAR;
        let seen: f32 = hands.iter().zip(&body.areas).filter(|(p, _)| near(p)).map(|(_, a)| a).sum();
        (seen >= SEEN_SHARE * body.areas.iter().sum::<f32>()).then_some(around)
    }

    fn near(hands: &[Point3<f32>], scan: &Mesh, trust: &[f32]) -> Option<Self> {
        let tree = Nearby::new(hands.iter().copied())?;
        let (lo, hi) = hands.iter().fold((hands[0], hands[0]), |(lo, hi), p| (lo.inf(p), hi.sup(p)));
        let inside = |p: &Point3<f32>| (0..3).all(|k| p[k] > lo[k] - NEAR && p[k] < hi[k] + NEAR);
        let is_near: Vec<bool> = scan.positions.iter().map(|p| inside(p) && tree.distance(p) < NEAR).collect();
        let (part, old) = scan.filter_triangles(|t| scan.triangles[t].iter().any(|&v| is_near[v as usize]));
        let trust: Vec<f32> = old.iter().map(|&v| trust[v as usize]).collect();
        let reverse = Samples::of_mesh(&part, &part.normals, &trust, CELL);
        Some(Self { cloud: Cloud::new(reverse.clone())?, reverse })
    }

    fn problem<'a>(
        &'a self,
        body: &'a Articulated,
        prior: &'a JointPrior,
        joints: Vec<Joint>,
        noise: f32,
    ) -> BodyProblem<'a> {
        BodyProblem {
            body,
            scan: &self.cloud,
            reverse: &self.reverse,
            gate: Gate { noise, ..GATE },
            columns: Columns::new(joints, 0),
            prior,
            guide: None,
            shape_sigma: 1.0, // no coefficient is free
            is_rooted: true,
            rest: 0.0,
        }
    }
}
