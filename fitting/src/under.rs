//! Any skinned mesh posed inside a more dressed scan (Hu et al. 2017, §6.1, eq. 5 and 6; articulated ICP after
//! Tagliasacchi et al. 2015).
//!
//! Vertices that stay uncovered match the scan; vertices that new cloth covers only have to stay inside it. Which is
//! which is decided anew in every step: by the distance outward, by colour, and by the trust the caller gives.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use serde::Serialize;
use toile_character::{Joint, Pose, Skeleton, SkinnedMesh};
use toile_geometry::Mesh;

use crate::{
    FittingError, UnderSettings, Verdict,
    articulated::State,
    level::body_joints,
    prior::JointPrior,
    under_stage::{COARSE, End, FINE, MIDDLE, Source, Stage, Target},
};

/// Pose of a mesh under a scan.
#[derive(Debug, Clone)]
pub struct UnderFit {
    /// The pose in the scan's frame.
    pub pose: Pose,
    /// For each vertex of the mesh: how surely it is uncovered skin or cloth of before, 0–1.
    pub uncovered: Vec<f32>,
    /// What was decided and how good it is.
    pub report: UnderReport,
}

/// What a fit under a scan decided.
#[derive(Debug, Clone, Serialize)]
pub struct UnderReport {
    /// Whether to trust it.
    pub verdict: Verdict,
    /// Why not, in words.
    pub reasons: Vec<String>,
    /// Gauss–Newton steps over all starts.
    pub iterations: usize,
    /// Whether the finest level came to rest.
    pub converged: bool,
    /// Turn of the whole mesh against the initial pose about the vertical, degrees.
    pub heading_deg: f64,
    /// Part of the mesh's area that stayed uncovered, 0–1.
    pub uncovered: f64,
    /// Root mean square distance of uncovered vertices from the scan, millimetres.
    pub uncovered_rms_mm: f64,
    /// Part of the mesh's area that lies more than 2 mm outside the scan, 0–1.
    pub outside: f64,
}

/// Poses `dressed` (the body, or the scan of the take before, rigged) inside `scan`, which shows one layer more.
///
/// `trust`: how surely each vertex of `dressed` is seen unchanged in the scan, 0–1; empty where nothing is known.
/// `initial`: its pose in the take before; joints may turn a few degrees from it, the whole may stand anywhere near the
/// scan's middle at any heading. The scan is in metres, +Y up. Same result for any number of threads.
///
/// # Errors
/// [`FittingError`] where a mesh is empty or broken, or lengths differ. A poor fit is a verdict in the report.
pub fn pose_under(
    dressed: &SkinnedMesh,
    trust: &[f32],
    initial: &Pose,
    scan: &Mesh,
    settings: &UnderSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<UnderFit, FittingError> {
    check(dressed, trust, scan, settings)?;
    progress(0.0);
    let source = Source::new(dressed, trust);
    let target = Target::new(scan);
    let coarse = Stage::new(&source, &target, &COARSE, settings)?;
    let starts = headings(&coarse, dressed, initial, settings);
    progress(0.2);
    let middle = Stage::new(&source, &target, &MIDDLE, settings)?;
    let (mut state, mut iterations) = best_heading(&middle, starts, &dressed.skeleton, settings)?;
    progress(0.6);
    let fine = Stage::new(&source, &target, &FINE, settings)?;
    let prior = JointPrior::around(state.initial.clone(), settings.joint_sigma, &dressed.skeleton);
    let end = fine.run(state.now.clone(), &prior, body_joints(), settings.fine_iterations, true)?;
    iterations += end.iterations;
    state.now = end.state;
    progress(0.95);
    let fit = fine.finish(dressed, &source, state.now, initial, End { iterations, converged: end.converged });
    progress(1.0);
    Ok(fit)
}

fn check(dressed: &SkinnedMesh, trust: &[f32], scan: &Mesh, settings: &UnderSettings) -> Result<(), FittingError> {
    dressed.mesh.validate().map_err(|e| FittingError::Mesh(e.to_string()))?;
    scan.validate().map_err(|e| FittingError::Scan(e.to_string()))?;
    let count = dressed.mesh.positions.len();
    if !trust.is_empty() && trust.len() != count {
        return Err(FittingError::Mesh(format!("{count} vertices but trust for {}", trust.len())));
    }
    if dressed.mesh.is_empty() {
        return Err(FittingError::Mesh("it has no triangles".into()));
    }
    if scan.is_empty() {
        return Err(FittingError::Scan("it has no triangles; scan the take again".into()));
    }
    let positive = [settings.joint_sigma, settings.cloth, settings.stand_off, settings.inside_sigma];
    if !positive.iter().all(|s| *s > 0.0) {
        let reason = "joint_sigma, cloth, stand_off and inside_sigma must be above 0".into();
        return Err(FittingError::Setting { name: "joint_sigma", reason });
    }
    Ok(())
}

struct Candidate {
    /// The pose to which joints are drawn, at this heading.
    initial: Pose,
    now: State,
}

/// The initial pose turned about the vertical through the scan's middle, the most promising headings first.
fn headings(stage: &Stage, dressed: &SkinnedMesh, initial: &Pose, settings: &UnderSettings) -> Vec<Candidate> {
    let from =
        middle_of(&stage.body.pose(&State { pose: initial.clone(), beta: Vec::new() }).points, &stage.body.areas);
    let to = middle_of(&stage.scan.samples.points, &stage.scan.samples.areas);
    let count = settings.headings.max(1);
    let mut judged: Vec<(f64, Candidate)> = (0..count)
        .into_par_iter()
        .map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / count as f64;
            let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
            let mut shift = to - turn * from;
            shift.y = 0.0;
            let moved = initial.moved(&Isometry3::from_parts(Translation3::from(shift), turn), &dressed.skeleton);
            let now = State { pose: moved.clone(), beta: Vec::new() };
            (stage.misfit(&now), Candidate { initial: moved, now })
        })
        .collect();
    judged.sort_by(|a, b| a.0.total_cmp(&b.0));
    judged.into_iter().take(4).map(|j| j.1).collect()
}

fn middle_of(points: &[Point3<f32>], areas: &[f32]) -> Vector3<f64> {
    let total: f64 = areas.iter().map(|&a| f64::from(a)).sum::<f64>().max(1e-12);
    points.iter().zip(areas).map(|(p, &a)| p.coords.cast::<f64>() * f64::from(a)).sum::<Vector3<f64>>() / total
}

/// Moves each candidate as a whole, then its limbs; keeps the one that agrees best with the scan.
fn best_heading(
    stage: &Stage,
    candidates: Vec<Candidate>,
    skeleton: &Skeleton,
    settings: &UnderSettings,
) -> Result<(Candidate, usize), FittingError> {
    let run = |mut c: Candidate| -> Result<(f64, usize, Candidate), FittingError> {
        let prior = JointPrior::around(c.initial.clone(), settings.joint_sigma, skeleton);
        let rigid = stage.run(c.now, &prior, vec![Joint::Hips], 12, false)?;
        let bent = stage.run(rigid.state, &prior, body_joints(), 8, true)?;
        c.now = bent.state;
        Ok((stage.misfit(&c.now), rigid.iterations + bent.iterations, c))
    };
    let ends = candidates.into_par_iter().map(run).collect::<Result<Vec<_>, _>>()?;
    let iterations = ends.iter().map(|e| e.1).sum();
    let best = ends.into_iter().reduce(|a, b| if b.0 < a.0 { b } else { a });
    best.map(|b| (b.2, iterations)).ok_or(FittingError::Singular { what: "the heading" })
}

impl UnderReport {
    pub(crate) fn decide(&mut self) {
        if self.uncovered < 0.1 {
            self.verdict = Verdict::Doubtful;
            self.reasons.push(format!(
                "only {:.0} % of the mesh is seen again in the scan: hands, head or feet should stay uncovered",
                100.0 * self.uncovered
            ));
        }
        if self.outside > 0.1 {
            let failed = self.outside > 0.3;
            self.verdict = if failed { Verdict::Failed } else { Verdict::Doubtful };
            self.reasons.push(format!(
                "{:.0} % of the mesh lies outside the scan: is it the same person, wearing one layer more?",
                100.0 * self.outside
            ));
        }
    }
}
