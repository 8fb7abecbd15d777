//! Shape and pose of the statistical body from one scan (Hu et al. 2017, §5.2, eq. 4), then conformation.

use nalgebra::Point3;
use toile_character::{BodyModel, JointRegressor, Pose, Skeleton, SkinnedMesh, skinning};
use toile_geometry::{Mesh, bvh::Bvh};

use crate::{
    FitSettings, FittingError, Mend, ScanLandmark, Verdict,
    articulated::{Articulated, Columns, State},
    cloud::{Cloud, Samples},
    conform::{Conformed, conform},
    correspond::{Gate, inside},
    fingers::fit_fingers,
    landmarks::{landmarks, mended},
    level::{Level, LevelResult, body_joints},
    measure::{Measurements, measure, stature},
    prepare::{Prepared, prepare},
    prior::JointPrior,
    stance::standing,
    start::{Start, starts},
    thin::Thinned,
    verdict::{FitReport, judge},
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

/// Fits the body model to a scan of one person: shape, pose, own surface, measures.
///
/// `scan`: a triangle mesh of one standing person, any heading; metres and +Y up (millimetres, centimetres and other
/// up axes are mended with a notice, see [`BodyFit::mend`]). The vertex attribute `filled` (1 where nothing was seen)
/// lowers trust. Source: Hu et al. 2017, eq. 4, as Gauss–Newton on robust point-to-plane distances in both directions
/// with analytic derivatives, coarse to fine. Same result for any number of threads.
///
/// # Errors
/// [`FittingError`] where the mesh cannot be a person or leaves the body undetermined. A fit that should not be
/// trusted is no error: read [`BodyFit::verdict`].
pub fn fit_body(
    model: &BodyModel,
    scan: &Mesh,
    settings: &FitSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<BodyFit, FittingError> {
    check(model, settings)?;
    let other;
    let model = if settings.joints == JointRegressor::Affine {
        model
    } else {
        other = model.with_joints_by(settings.joints);
        &other
    };
    progress(0.0);
    let prepared = prepare(scan)?;
    let trust = trust_of(&prepared.mesh);
    let starts = starts(model, &prepared.mesh, &trust, &prepared.ups, settings)?;
    progress(0.25);
    let (state, up, coarse_iterations) = best_start(model, &prepared, &trust, settings, starts)?;
    let (scan, state, mend) = stand(&prepared, model, state, up);
    progress(0.45);
    let fine = refine(model, &scan, &trust, settings, state)?;
    progress(0.7);
    let posed = model.posed(&fine.state.beta, &fine.state.pose);
    let bvh = Bvh::new(&scan.positions, &scan.triangles);
    let by_hand = mended(model, settings, &mend, &bvh)?;
    let landmarks = landmarks(model, &posed, &scan, &bvh, &trust, &by_hand);
    let conformed = conform(model, &fine.state, &scan, &bvh, &trust, settings, &landmarks)?;
    progress(0.95);
    let context = Context { prepared, mend, coarse_iterations, landmarks, dressed: settings.dressed };
    let fit = assemble(model, &scan, fine, conformed, context);
    progress(1.0);
    Ok(fit)
}

fn check(model: &BodyModel, settings: &FitSettings) -> Result<(), FittingError> {
    let bad = |name, reason: &str| Err(FittingError::Setting { name, reason: reason.into() });
    if !(1..=model.component_count()).contains(&settings.components) {
        return bad(
            "components",
            &format!("is {}; the model has 1 to {}", settings.components, model.component_count()),
        );
    }
    if !(settings.noise > 0.0 && settings.shape_sigma > 0.0) {
        return bad("noise", "noise and shape_sigma must be above 0");
    }
    if !(settings.conformation.stiffness_length > 0.0 && settings.conformation.extremity_length > 0.0) {
        return bad("conformation", "its lengths must be above 0");
    }
    Ok(())
}

/// How far each scan vertex is trusted, 0 to 1: what was filled in by fusion was not seen.
pub(crate) fn trust_of(scan: &Mesh) -> Vec<f32> {
    match scan.attributes.get("filled") {
        Some(filled) => filled.iter().map(|f| 1.0 - 0.98 * f.clamp(0.0, 1.0)).collect(),
        None => vec![1.0; scan.positions.len()],
    }
}

/// Takes the two best starts to the middle resolution, where front and back differ clearly.
fn best_start(
    model: &BodyModel,
    prepared: &Prepared,
    trust: &[f32],
    settings: &FitSettings,
    starts: Vec<Start>,
) -> Result<(State, usize, usize), FittingError> {
    let gate = Gate { distance: 0.1, slip: 0.04, min_cos: 0.5, kernel: 0.025, noise: 0.006, inside: inside(settings) };
    let resolution = Resolution { cell: 0.014, body_cell: 0.028, components: 12, iterations: 10, gate };
    let sampled = resolution.sampled(model, &prepared.mesh, trust, settings)?;
    let mut best: Option<(f64, State, usize)> = None;
    let mut iterations = starts.iter().map(|s| s.iterations).sum();
    for start in starts.into_iter().take(2) {
        let result = sampled.run(model, settings, start.state)?;
        iterations += result.iterations;
        if best.as_ref().is_none_or(|b| result.matches.misfit < b.0) {
            best = Some((result.matches.misfit, result.state, start.up));
        }
    }
    let (_, state, up) = best.ok_or(FittingError::Singular { what: "the heading" })?;
    Ok((state, up, iterations))
}

/// Turns scan and state upright.
fn stand(prepared: &Prepared, model: &BodyModel, mut state: State, up: usize) -> (Mesh, State, Mend) {
    let turn = Mend { scale: 1.0, rotation: prepared.ups[up] };
    let skeleton = model.skeleton_at(&state.beta);
    if !turn.is_identity() {
        let turned = nalgebra::Isometry3::from_parts(nalgebra::Translation3::identity(), turn.rotation);
        state.pose = state.pose.moved(&turned, &skeleton);
    }
    (turn.apply(&prepared.mesh), state, Mend { scale: prepared.scale, rotation: turn.rotation })
}

fn refine(
    model: &BodyModel,
    scan: &Mesh,
    trust: &[f32],
    settings: &FitSettings,
    state: State,
) -> Result<LevelResult, FittingError> {
    let gate =
        Gate { distance: 0.05, slip: 0.015, min_cos: 0.6, kernel: 0.010, noise: 0.003, inside: inside(settings) };
    let middle = Resolution { cell: 0.009, body_cell: 0.024, components: settings.components, iterations: 8, gate };
    let first = middle.sampled(model, scan, trust, settings)?.run(model, settings, state)?;
    let gate = Gate { distance: 0.025, slip: 0.01, kernel: 0.006, noise: settings.noise as f32, ..gate };
    let iterations = settings.fine_iterations;
    let fine = Resolution { cell: 0.006, body_cell: 0.010, components: settings.components, iterations, gate };
    let mut last = fine.sampled(model, scan, trust, settings)?.run(model, settings, first.state)?;
    last.iterations += first.iterations;
    last.state = fit_fingers(model, scan, trust, settings, last.state)?;
    Ok(last)
}

/// Cell of the scan's samples that are looked up on the body, as a part of that of the others: they are many enough.
const REVERSE: f32 = 2.5;

/// Sampling and gates of one level.
struct Resolution {
    cell: f32,
    body_cell: f32,
    components: usize,
    iterations: usize,
    gate: Gate,
}

/// Body and scan as one level sees them.
struct Sampled<'a> {
    resolution: &'a Resolution,
    body: Articulated,
    scan: Cloud,
    reverse: Samples,
    components: usize,
}

impl Resolution {
    fn sampled(
        &self,
        model: &BodyModel,
        scan: &Mesh,
        trust: &[f32],
        settings: &FitSettings,
    ) -> Result<Sampled<'_>, FittingError> {
        let empty = || FittingError::Scan("its triangles have no area".into());
        let cloud = Cloud::new(Samples::of_mesh(scan, &scan.normals, trust, self.cell)).ok_or_else(empty)?;
        let reverse = Samples::of_mesh(scan, &scan.normals, trust, REVERSE * self.cell);
        let mesh = Mesh::new(model.mean.clone(), model.triangles.clone());
        let picked = Thinned::new(&mesh, &mesh.vertex_normals(), self.body_cell, |v| !model.inner[v]);
        let components = self.components.min(settings.components).min(model.components.len());
        let body = Articulated::of_model(model, &picked, components);
        Ok(Sampled { resolution: self, body, scan: cloud, reverse, components })
    }
}

impl Sampled<'_> {
    fn run(&self, model: &BodyModel, settings: &FitSettings, mut state: State) -> Result<LevelResult, FittingError> {
        state.beta.resize(self.components, 0.0);
        let level = Level {
            body: &self.body,
            scan: &self.scan,
            reverse: &self.reverse,
            gate: self.resolution.gate,
            columns: Columns::new(body_joints(), self.components),
            iterations: self.resolution.iterations,
            shape_sigma: settings.shape_sigma,
            rooted: false,
        };
        level.run(state, &JointPrior::standing(&model.mean_skeleton))
    }
}

/// Stature of the body standing straight, girths as it stood in the scan: skin around hips and armpits keeps its shape
/// there. Arms that hang down would join the section, so they are lifted to the A-pose first.
fn measured(model: &BodyModel, body: &SkinnedMesh, pose: &Pose) -> Measurements {
    use toile_character::Joint::*;
    let stature = stature(&standing(body), &model.inner);
    let joints = pose.joint_positions(&body.skeleton);
    let mut lifted = pose.clone();
    for (shoulder, elbow) in [(LeftUpperArm, LeftLowerArm), (RightUpperArm, RightLowerArm)] {
        let arm = joints[elbow.index()] - joints[shoulder.index()];
        if -arm.y > ARM_CLEAR * arm.norm() {
            *lifted.rotation_mut(shoulder) = nalgebra::UnitQuaternion::identity();
        }
    }
    measure(&body.posed_mesh(&lifted), &model.inner, stature)
}

/// Cosine of the least angle between a hanging arm and the vertical that keeps it clear of the trunk (25°).
const ARM_CLEAR: f64 = 0.906;

struct Context {
    prepared: Prepared,
    mend: Mend,
    coarse_iterations: usize,
    landmarks: Vec<ScanLandmark>,
    dressed: bool,
}

fn assemble(model: &BodyModel, scan: &Mesh, fine: LevelResult, conformed: Conformed, context: Context) -> BodyFit {
    let State { pose, beta } = fine.state.clone();
    let skeleton = model.skeleton_at(&beta);
    let transforms = pose.skinning_transforms(&skeleton);
    let rest: Vec<Point3<f32>> = skinning::unskin(&conformed.points, &model.weights, &transforms);
    let mut mesh = Mesh::new(rest, model.triangles.clone());
    mesh.recompute_normals();
    let mut model_mesh = Mesh::new(model.posed(&beta, &pose), model.triangles.clone());
    model_mesh.recompute_normals();
    let body = SkinnedMesh { mesh, skeleton: skeleton.clone(), weights: model.weights.clone() };
    let measurements = measured(model, &body, &pose);
    let mut notices = context.prepared.notices;
    if context.mend.rotation.angle() > 1e-9 {
        notices.push("the scan does not stand on +Y; turned upright".into());
    }
    let mut report = judge(model, scan, &fine, &conformed.points, &measurements, notices, context.dressed);
    report.iterations += context.coarse_iterations;
    let (mend, landmarks) = (context.mend, context.landmarks);
    BodyFit { beta, pose, skeleton, body, model_mesh, mend, landmarks, measurements, report }
}
