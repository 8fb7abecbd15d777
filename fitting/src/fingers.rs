//! Wrists and fingers, once the body stands: a few hundred vertices, thirty-two joints.

use toile_character::{BodyModel, Joint, Region};
use toile_geometry::Mesh;

use crate::{
    FitSettings, FittingError,
    articulated::{Articulated, Columns, State},
    cloud::{Cloud, Samples},
    correspond::Gate,
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

/// Turns wrists and fingers to the scan; everything else stays. Hands that the scan does not show keep their pose.
pub(crate) fn fit_fingers(
    model: &BodyModel,
    scan: &Mesh,
    trust: &[f32],
    settings: &FitSettings,
    state: State,
) -> Result<State, FittingError> {
    let mesh = Mesh::new(model.mean.clone(), model.triangles.clone());
    let is_hand = |v: usize| matches!(model.regions[v], Region::LeftHand | Region::RightHand);
    let picked = Thinned::new(&mesh, &mesh.vertex_normals(), CELL, |v| is_hand(v) && !model.inner[v]);
    let body = Articulated::of_model(model, &picked, state.beta.len());
    let posed = body.pose(&state);
    let Some((cloud, reverse)) = around(&posed.points, scan, trust) else { return Ok(state) };
    let near = |p: &nalgebra::Point3<f32>| cloud.distance(p) < 0.5 * NEAR;
    let seen: f32 = posed.points.iter().zip(&body.areas).filter(|(p, _)| near(p)).map(|(_, a)| a).sum();
    if seen < LEAST_SEEN * body.areas.iter().sum::<f32>() {
        return Ok(state);
    }
    let gate = Gate { distance: 0.02, slip: 0.008, min_cos: 0.4, kernel: 0.005, noise: 0.015 };
    let joint = |j: &Joint| j.is_finger() || matches!(j, Joint::LeftHand | Joint::RightHand);
    let joints = toile_character::joint::JOINTS.into_iter().filter(joint).collect();
    let level = Level {
        body: &body,
        scan: &cloud,
        reverse: &reverse,
        gate,
        columns: Columns::new(joints, 0),
        iterations: 8,
        shape_sigma: settings.shape_sigma,
        rooted: true,
    };
    Ok(level.run(state, &JointPrior::standing(&model.mean_skeleton))?.state)
}

/// Scan samples near the hands, as the cloud and as what is looked up in the other direction.
fn around(hands: &[nalgebra::Point3<f32>], scan: &Mesh, trust: &[f32]) -> Option<(Cloud, Samples)> {
    let tree = Cloud::new(Samples { points: hands.to_vec(), ..Samples::default() })?;
    let (lo, hi) = hands.iter().fold((hands[0], hands[0]), |(lo, hi), p| (lo.inf(p), hi.sup(p)));
    let inside = |p: &nalgebra::Point3<f32>| (0..3).all(|k| p[k] > lo[k] - NEAR && p[k] < hi[k] + NEAR);
    let is_near: Vec<bool> = scan.positions.iter().map(|p| inside(p) && tree.distance(p) < NEAR).collect();
    let (part, old) = scan.filter_triangles(|t| scan.triangles[t].iter().any(|&v| is_near[v as usize]));
    let trust: Vec<f32> = old.iter().map(|&v| trust[v as usize]).collect();
    let samples = Samples::of_mesh(&part, &part.normals, &trust, CELL);
    let reverse = samples.clone();
    Some((Cloud::new(samples)?, reverse))
}
