//! Hands, once the body stands: wrists and fingers, or wrists and arms in a later take; a few hundred vertices.

use nalgebra::Point3;
use toile_character::{BodyModel, Joint, Pose, Region, SkinnedMesh, joint::JOINTS};
use toile_geometry::{Mesh, mesh::vertex_normals};

use crate::{
    FitSettings, FittingError,
    articulated::{Articulated, Columns, State},
    cloud::{Cloud, Nearby, Samples},
    correspond::{Gate, matches},
    level::Level,
    prior::JointPrior,
    thin::Thinned,
};

/// Sampling of hands and scan, metres.
const CELL: f32 = 0.004;
/// Scan farther than this from any hand vertex is left out, metres.
const NEAR: f32 = 0.03;
/// Least part of the hands' area with scan near it; below, the fingers stay at rest.
const LEAST_SEEN: f32 = 0.3;
const WRISTS: [Joint; 2] = [Joint::LeftHand, Joint::RightHand];
const ARMS: [(Region, [Joint; 2]); 2] = [
    (Region::LeftArm, [Joint::LeftUpperArm, Joint::LeftLowerArm]),
    (Region::RightArm, [Joint::RightUpperArm, Joint::RightLowerArm]),
];
/// An arm is hidden where less than this part of it lies within [`ON_SCAN`] (metres) of the scan.
const ARM_SEEN: f64 = 0.5;
const ON_SCAN: f32 = 0.004;
/// Sampling of the scan for that, metres.
const ARM_CELL: f32 = 0.008;
/// Standard deviation of the turn of arms and wrists that is left to find in the next take, radians (3.4°).
const AGAIN_SIGMA: f64 = 0.06;

/// Turns wrists and fingers of the statistical body to the scan; everything else stays. Hands that the scan does not
/// show keep their pose.
pub(crate) fn fit_fingers(
    model: &BodyModel,
    scan: &Mesh,
    trust: &[f32],
    settings: &FitSettings,
    state: State,
) -> Result<State, FittingError> {
    let mesh = Mesh::new(model.mean.clone(), model.triangles.clone());
    let body = Articulated::of_model(model, &hands(model, &mesh), state.beta.len());
    // fingers have hardly been seen yet: what the scan says of them counts little against the resting hand
    let prior = JointPrior::standing(&model.mean_skeleton);
    let joints = JOINTS.into_iter().filter(|j| j.is_finger() || WRISTS.contains(j)).collect();
    turned(&body, scan, trust, &prior, Turn { joints, noise: 0.015, shape_sigma: settings.shape_sigma }, state)
}

/// The same for a body whose own shape is known (template topology), from a pose that is nearly right: wrists turn, and arms that
/// sleeves hide bring the hands where they are seen. The trunk and arms that are seen stay. A pose that agrees less with the
/// scan is not taken.
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
    // fingers stay: how they moved since is finer than a scan in which they often melt together
    let turn = Turn { joints, noise: 0.004, shape_sigma: 1.0 };
    Ok(turned(&body, scan, trust, &prior, turn, state)?.pose)
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

/// Which joints turn, and how much the scan counts (metres, as [`Gate::noise`]).
struct Turn {
    joints: Vec<Joint>,
    noise: f32,
    shape_sigma: f64,
}

fn turned(
    body: &Articulated,
    scan: &Mesh,
    trust: &[f32],
    prior: &JointPrior,
    turn: Turn,
    state: State,
) -> Result<State, FittingError> {
    let posed = body.pose(&state);
    let Some((cloud, reverse)) = around(&posed.points, scan, trust) else { return Ok(state) };
    let Some(samples) = Nearby::new(reverse.points.iter().copied()) else { return Ok(state) };
    let near = |p: &Point3<f32>| samples.distance(p) < 0.5 * NEAR;
    let seen: f32 = posed.points.iter().zip(&body.areas).filter(|(p, _)| near(p)).map(|(_, a)| a).sum();
    if seen < LEAST_SEEN * body.areas.iter().sum::<f32>() {
        return Ok(state);
    }
    let gate = Gate { distance: 0.02, slip: 0.008, min_cos: 0.4, kernel: 0.005, noise: turn.noise, inside: 1.0 };
    let level = Level {
        body,
        scan: &cloud,
        reverse: &reverse,
        gate,
        columns: Columns::new(turn.joints, 0),
        iterations: 8,
        shape_sigma: turn.shape_sigma,
        rooted: true,
    };
    let before = matches(body, &posed, &cloud, &reverse, &gate).misfit;
    let end = level.run(state.clone(), prior)?;
    Ok(if end.matches.misfit <= before { end.state } else { state })
}

/// Scan samples near the hands, as the cloud and as what is looked up in the other direction.
fn around(hands: &[Point3<f32>], scan: &Mesh, trust: &[f32]) -> Option<(Cloud, Samples)> {
    let tree = Nearby::new(hands.iter().copied())?;
    let (lo, hi) = hands.iter().fold((hands[0], hands[0]), |(lo, hi), p| (lo.inf(p), hi.sup(p)));
    let inside = |p: &Point3<f32>| (0..3).all(|k| p[k] > lo[k] - NEAR && p[k] < hi[k] + NEAR);
    let is_near: Vec<bool> = scan.positions.iter().map(|p| inside(p) && tree.distance(p) < NEAR).collect();
    let (part, old) = scan.filter_triangles(|t| scan.triangles[t].iter().any(|&v| is_near[v as usize]));
    let trust: Vec<f32> = old.iter().map(|&v| trust[v as usize]).collect();
    let samples = Samples::of_mesh(&part, &part.normals, &trust, CELL);
    let reverse = samples.clone();
    Some((Cloud::new(samples)?, reverse))
}
