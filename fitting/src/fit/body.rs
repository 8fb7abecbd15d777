//! Shape and pose of the statistical body from one scan (Hu et al. 2017, §5.2, eq. 4), then conformation.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use toile_character::{BodyModel, Joint, JointRegressor, Pose, Skeleton, SkinnedMesh, skinning};
use toile_geometry::{Mesh, bvh::Bvh};

use super::{
    astray::Astray,
    choose::best_start,
    fingers::fit_fingers,
    guides::Guides,
    part::{is_believed, is_suspected},
    placement::Extent,
    prepare::{Mend, Prepared, prepare},
    report::{FitReport, Verdict},
    resolution::{Resolutions, Sampled},
    seed::{seed_fit, seed_start},
    starts::{Start, starts},
    verdict::{Asked, judge},
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

/// Misfit of a head with hair, metres: hair of ordinary cut stands 5 to 20 mm off half of it. Where a floor tells the stature this
/// does not matter; where only the upper part of a person is seen, a head that is fitted into its hair makes a giant.
const HAIR: f64 = 0.010;

/// Turns below this are rounding, radians.
const UPRIGHT: f64 = 1e-9;

/// Fits the body model to a scan of one person: shape, pose, own surface, measures.
///
/// `scan`: a triangle mesh of one standing person, any heading; metres and +Y up (millimetres, centimetres and other
/// up axes are mended with a notice, see [`BodyFit::mend`]). The vertex attribute `filled` (1 where nothing was seen)
/// lowers trust. Source: Hu et al. 2017, eq. 4, as Gauss–Newton on robust point-to-plane distances in both directions
/// with analytic derivatives, coarse to fine ([`Method::Toile`]), or as the paper prints it ([`Method::Seed`]).
/// Landmarks that were set by hand drive the pose, too (Magnenat-Thalmann et al. 2004, §3.1). A scan of the upper part of a person
/// (head, shoulders and most of the trunk at least) gives a body whose rest is that of an ordinary person, with
/// [`FitReport::part`] set. Same result for any number of threads.
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
    let fitter = Fitter { model, prepared: &prepared, trust: &trust, lying: &lying, by_hand: &by_hand, settings };
    let whole = fitter.fit(Extent::Whole, progress)?;
    if settings.method == Method::Seed || !is_suspected(&whole.report, &prepared.mesh) {
        return Ok(whole);
    }
    let part = fitter.fit(Extent::FromCrown, &|_| {})?;
    Ok(if is_believed(&part.report) { part } else { whole })
}

/// What a fit starts from.
struct Fitter<'a> {
    model: &'a BodyModel,
    prepared: &'a Prepared,
    trust: &'a [f32],
    /// Over the scan as it lies.
    lying: &'a Bvh,
    by_hand: &'a HandLandmarks,
    settings: &'a FitSettings,
}

impl Fitter<'_> {
    /// The fit to a scan that is taken to show `extent` of a person.
    fn fit(&self, extent: Extent, progress: &(dyn Fn(f32) + Sync)) -> Result<BodyFit, FittingError> {
        let Self { model, trust, .. } = *self;
        let settings = &of_extent(self.settings, extent);
        let best = self.started(extent, progress)?;
        let (scan, state, mend) = stand(self.prepared, model, best.state, best.up);
        let by_hand = turned(self.by_hand, &mend.rotation);
        progress(0.45);
        let mut fine = match settings.method {
            Method::Toile => {
                let guides = Guides::new(model, &by_hand);
                refine(model, (&scan, trust), &guides, settings, state, best.is_usual)?
            }
            Method::Seed => seed_fit(model, &scan, trust, settings, state)?,
        };
        fine.iterations += best.iterations;
        if settings.method == Method::Toile {
            fine.state = fit_fingers(model, &scan, trust, fine.state)?;
        }
        progress(0.7);
        let standing = mend.rotation.angle() > 0.0;
        let standing = standing.then(|| Bvh::new(&scan.positions, &scan.triangles));
        let bvh = standing.as_ref().unwrap_or(self.lying);
        let astray = Astray::of_fit(model, (&scan, trust, bvh), settings, &fine.state)?;
        let landmarks = landmarks(model, &fine.state, &scan, bvh, trust, &by_hand);
        let points = conform(model, &fine.state, &scan, bvh, trust, settings, &landmarks)?;
        progress(0.95);
        let body = at_rest(model, &fine.state, &points);
        let measurements = measured(model, &body, &fine.state.pose);
        let dressed = settings.dressed;
        let asked = Asked { extent, dressed };
        let (mut report, seen) = judge(model, (&scan, trust), &fine, &points, &measurements, &astray, asked);
        report.notices.splice(0..0, notices(self.prepared.notices.clone(), &mend));
        progress(1.0);
        let State { pose, beta } = fine.state;
        let model_mesh = template(model, model.posed(&beta, &pose));
        let skeleton = body.skeleton.clone();
        Ok(BodyFit { beta, pose, skeleton, body, model_mesh, mend, landmarks, measurements, seen, report })
    }

    /// The state from which a scan is fitted finely.
    fn started(&self, extent: Extent, progress: &(dyn Fn(f32) + Sync)) -> Result<Start, FittingError> {
        let Self { model, settings, trust, lying: bvh, .. } = *self;
        let scan = &self.prepared.mesh;
        // a part's longest side need not be its height, and upside down less of the body would be left over
        let upright = [UnitQuaternion::identity()];
        let ups = if extent == Extent::Whole { &self.prepared.ups[..] } else { &upright };
        match settings.method {
            Method::Toile => {
                let (guides, resolutions) = (Guides::new(model, self.by_hand), Resolutions::new(settings));
                let (headings, coarse) = (settings.headings, resolutions.coarse);
                let starts = starts(model, (scan, trust), ups, extent, &guides, headings, coarse)?;
                progress(0.25);
                best_start(model, (scan, trust, bvh), &guides, settings, (starts, extent), &resolutions)
            }
            Method::Seed => seed_start(model, scan, trust, ups, settings),
        }
    }
}

/// The settings for a scan that shows `extent` of a person.
fn of_extent(settings: &FitSettings, extent: Extent) -> FitSettings {
    let noise = if extent == Extent::FromCrown { settings.noise.max(HAIR) } else { settings.noise };
    FitSettings { noise, ..settings.clone() }
}

/// Landmarks in a frame that is turned by `rotation`.
fn turned(landmarks: &HandLandmarks, rotation: &UnitQuaternion<f64>) -> HandLandmarks {
    landmarks.iter().map(|(name, p)| (name.clone(), (rotation * Point3::from(*p)).into())).collect()
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
pub(super) fn at_rest(model: &BodyModel, state: &State, points: &[Point3<f32>]) -> SkinnedMesh {
    let skeleton = model.skeleton_at(&state.beta);
    let rest = skinning::unskin(points, &model.weights, &state.pose.skinning_transforms(&skeleton));
    SkinnedMesh { mesh: template(model, rest), skeleton, weights: model.weights.clone() }
}

/// Cosine of the smallest angle between a hanging arm and the vertical that keeps it clear of the trunk (25°).
const ARM_CLEAR: f64 = 0.906;

/// Stature of the body standing straight, girths as it stood in the scan: skin around hips and armpits keeps its shape
/// there. Arms that hang down would join the section, so that they are lifted to the A-pose first.
pub(super) fn measured(model: &BodyModel, body: &SkinnedMesh, pose: &Pose) -> Measurements {
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
