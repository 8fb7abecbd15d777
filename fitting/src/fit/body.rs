//! Shape and pose of the statistical body from one scan (Hu et al. 2017, §5.2, eq. 4), then conformation.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use toile_character::{BodyModel, Joint, JointRegressor, Pose, Skeleton, SkinnedMesh, skinning};
use toile_geometry::{Mesh, bvh::Bvh};

use super::{
    astray::Astray,
    choose::best_start,
    fingers::fit_fingers,
    guides::Guides,
    prepare::{Mend, Prepared, prepare},
    report::{FitReport, Verdict},
    resolution::{Resolutions, Sampled},
    seed::{seed_fit, seed_start},
    starts::{Start, starts},
    verdict::judge,
};
use crate::{
    FitSettings, FittingError, HandLandmarks, Method, ScanLandmark,
    conform::{conform, landmarks, set_by_hand},
    measure::extremes::{Measurements, measure_extremes, stature},
    solve::{Descent, JointPrior, State, descend},
    stance::standing,
    surface::trust_of,
};

/// The body of one scan.
#[derive(Debug, Clone)]
pub struct BodyFit {
    /// Shape coefficients, in standard deviations.
    pub beta: Vec<f64>,
    /// Joint angles θ relative to the A-pose rest, in the (mended) scan's frame.
    pub pose: Pose,
    /// Joints of this body at rest (A-pose).
    pub skeleton: Skeleton,
    /// The conformed body at rest: `body.posed(&pose)` lies on the scan; closed, template topology.
    pub body: SkinnedMesh,
    /// The statistical model alone, posed in the scan's frame.
    pub model_mesh: Mesh,
    /// How the input was brought to metres and upright; the identity for a scan as it should be.
    pub mend: Mend,
    /// The model's landmarks on the scan, in its (mended) frame.
    pub landmarks: Vec<ScanLandmark>,
    /// Stature and girths of the conformed body.
    pub measurements: Measurements,
    /// Of each vertex of the template, whether the scan shows it.
    pub seen: Vec<bool>,
    /// Residuals, coverage, iterations, notices.
    pub report: FitReport,
}

impl BodyFit {
    /// Whether the fit is to be trusted.
    pub fn verdict(&self) -> Verdict {
        self.report.verdict
    }

    /// The conformed body in the scan's pose and frame.
    pub fn posed_body(&self) -> Mesh {
        self.body.posed_mesh(&self.pose)
    }
}

/// Turns below this are rounding, radians.
const UPRIGHT: f64 = 1e-9;

/// Fits the body model to a scan of one person: shape, pose, own surface, measures.
///
/// `scan`: a triangle mesh of one standing person, any heading; metres and +Y up (millimetres, centimetres and other
/// up axes are mended with a notice, see [`BodyFit::mend`]). The vertex attribute `filled` (1 where nothing was seen)
/// lowers trust. Source: Hu et al. 2017, eq. 4, as Gauss–Newton on robust point-to-plane distances in both directions
/// with analytic derivatives, coarse to fine ([`Method::Toile`]), or as the paper prints it ([`Method::Seed`]).
/// Landmarks that were set by hand drive the pose, too (Magnenat-Thalmann et al. 2004, §3.1). Same result for any number of threads.
///
/// # Errors
/// [`FittingError`] where the mesh cannot be a person or leaves the body undetermined. A fit that should not be
/// trusted is not an error: read [`BodyFit::verdict`].
pub fn fit_body(
    model: &BodyModel,
    scan: &Mesh,
    settings: &FitSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<BodyFit, FittingError> {
    settings.check(model.component_count())?;
    let other = (settings.joints != JointRegressor::Affine).then(|| model.with_joints_by(settings.joints));
    let model = other.as_ref().unwrap_or(model);
    progress(0.0);
    let prepared = prepare(scan)?;
    let trust = trust_of(&prepared.mesh);
    let by_hand = set_by_hand(model, settings, prepared.scale, &prepared.mesh)?;
    let lying = Bvh::new(&prepared.mesh.positions, &prepared.mesh.triangles);
    let best = started(model, &prepared, (&trust, &lying), &Guides::new(model, &by_hand), settings, progress)?;
    let (scan, state, mend) = stand(&prepared, model, best.state, best.up);
    let by_hand = turned(by_hand, &mend.rotation);
    progress(0.45);
    let mut fine = match settings.method {
        Method::Toile => {
            let guides = Guides::new(model, &by_hand);
            refine(model, (&scan, &trust), &guides, settings, state, best.is_usual)?
        }
        Method::Seed => seed_fit(model, &scan, &trust, settings, state)?,
    };
    fine.iterations += best.iterations;
    if settings.method == Method::Toile {
        fine.state = fit_fingers(model, &scan, &trust, fine.state)?;
    }
    progress(0.7);
    let is_upright = mend.rotation == UnitQuaternion::identity();
    let bvh = if is_upright { lying } else { Bvh::new(&scan.positions, &scan.triangles) };
    let astray = Astray::of_fit(model, (&scan, &trust, &bvh), settings, &fine.state)?;
    let landmarks = landmarks(model, &fine.state, &scan, &bvh, &trust, &by_hand);
    let points = conform(model, &fine.state, &scan, &bvh, &trust, settings, &landmarks)?;
    progress(0.95);
    let body = at_rest(model, &fine.state, &points);
    let measurements = measured(model, &body, &fine.state.pose);
    let (mut report, seen) = judge(model, (&scan, &trust), &fine, &points, &measurements, &astray, settings.dressed);
    report.notices.splice(0..0, notices(prepared.notices, &mend));
    progress(1.0);
    let State { pose, beta } = fine.state;
    let model_mesh = template(model, model.posed(&beta, &pose));
    let skeleton = body.skeleton.clone();
    Ok(BodyFit { beta, pose, skeleton, body, model_mesh, mend, landmarks, measurements, seen, report })
}

/// The state from which a scan is fitted finely.
fn started(
    model: &BodyModel,
    prepared: &Prepared,
    (trust, bvh): (&[f32], &Bvh),
    guides: &Guides,
    settings: &FitSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Start, FittingError> {
    let (scan, ups) = (&prepared.mesh, &prepared.ups);
    match settings.method {
        Method::Toile => {
            let resolutions = Resolutions::new(settings);
            let starts = starts(model, scan, trust, ups, guides, settings.headings, resolutions.coarse)?;
            progress(0.25);
            best_start(model, (scan, trust, bvh), guides, settings, starts, &resolutions)
        }
        Method::Seed => seed_start(model, scan, trust, ups, settings),
    }
}

/// Landmarks in a frame that is turned by `rotation`.
fn turned(landmarks: HandLandmarks, rotation: &UnitQuaternion<f64>) -> HandLandmarks {
    landmarks.into_iter().map(|(name, p)| (name, (rotation * Point3::from(p)).into())).collect()
}

/// Turns scan and state upright.
fn stand(prepared: &Prepared, model: &BodyModel, mut state: State, up: UnitQuaternion<f64>) -> (Mesh, State, Mend) {
    let turn = Mend { scale: 1.0, rotation: up };
    if !turn.is_identity() {
        let turned = Isometry3::from_parts(Translation3::identity(), turn.rotation);
        state.pose = state.pose.moved(&turned, &model.skeleton_at(&state.beta));
    }
    (turn.apply(&prepared.mesh), state, Mend { scale: prepared.scale, rotation: turn.rotation })
}

/// Descends at one resolution after the other.
fn refine(
    model: &BodyModel,
    (scan, trust): (&Mesh, &[f32]),
    guides: &Guides,
    settings: &FitSettings,
    state: State,
    is_usual: bool,
) -> Result<Descent, FittingError> {
    let skeleton = &model.mean_skeleton;
    let prior = if is_usual { JointPrior::standing(skeleton) } else { JointPrior::roaming(skeleton) };
    let mut end = Descent { state, iterations: 0, converged: false };
    let resolutions = Resolutions::new(settings);
    for resolution in [resolutions.middle, resolutions.fine] {
        let sampled = Sampled::new(model, scan, trust, guides, resolution)?;
        let problem = sampled.problem(&prior, settings.shape_sigma);
        let next = descend(&problem, end.state.with_components(sampled.components), resolution.iterations)?;
        end = Descent { iterations: end.iterations + next.iterations, ..next };
    }
    Ok(end)
}

/// The template with its vertices at `points`.
fn template(model: &BodyModel, points: Vec<Point3<f32>>) -> Mesh {
    let mut mesh = Mesh::new(points, model.triangles.clone());
    mesh.recompute_normals();
    mesh
}

/// The body whose skin lies at `points` in the scan's pose, taken back to rest.
fn at_rest(model: &BodyModel, state: &State, points: &[Point3<f32>]) -> SkinnedMesh {
    let skeleton = model.skeleton_at(&state.beta);
    let rest = skinning::unskin(points, &model.weights, &state.pose.skinning_transforms(&skeleton));
    SkinnedMesh { mesh: template(model, rest), skeleton, weights: model.weights.clone() }
}

/// Cosine of the smallest angle between a hanging arm and the vertical that keeps it clear of the trunk (25°).
const ARM_CLEAR: f64 = 0.906;

/// Stature of the body standing straight, girths as it stood in the scan: skin around hips and armpits keeps its shape
/// there. Arms that hang down would join the section, so that they are lifted to the A-pose first.
fn measured(model: &BodyModel, body: &SkinnedMesh, pose: &Pose) -> Measurements {
    use Joint::*;
    let stature = stature(&standing(body), &model.inner);
    let joints = pose.joint_positions(&body.skeleton);
    let mut lifted = pose.clone();
    for (shoulder, elbow) in [(LeftUpperArm, LeftLowerArm), (RightUpperArm, RightLowerArm)] {
        let arm = joints[elbow.index()] - joints[shoulder.index()];
        if -arm.y > ARM_CLEAR * arm.norm() {
            *lifted.rotation_mut(shoulder) = UnitQuaternion::identity();
        }
    }
    measure_extremes(model, &body.posed_mesh(&lifted), stature)
}

/// The repairs of the scan, in words.
fn notices(mut notices: Vec<String>, mend: &Mend) -> Vec<String> {
    if mend.rotation.angle() > UPRIGHT {
        notices.push("the scan does not stand on +Y: it was turned upright".into());
    }
    notices
}
