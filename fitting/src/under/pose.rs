//! Any skinned mesh posed inside a more dressed scan (Hu et al. 2017, §6.1, eq. 5 and 6; articulated ICP after
//! Tagliasacchi et al. 2015).
//!
//! Vertices that stay uncovered match the scan; vertices that new cloth covers only have to stay inside it. Which is
//! which is decided anew in every step: by the distance outward, by colour, and by the trust the caller gives.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_character::{Joint, Pose, Skeleton, SkinnedMesh};
use toile_geometry::Mesh;

use super::{
    elsewhere::{is_elsewhere, is_strained, with_limbs_laid},
    inside::Inside,
    problem::{COARSE, FINE, MIDDLE, Sampled, Source, Target},
    report::{UnderFit, UnderReport},
    seed::seed_pose,
};
use crate::{
    FittingError, Method, UnderSettings, Verdict,
    solve::{Descent, JointPrior, State, body_joints, descend},
};

/// Number of headings that are refined.
const REFINED: usize = 4;
/// Gauss–Newton steps of the whole mesh, and then of its limbs, for each of them.
const RIGID_STEPS: usize = 12;
const LIMB_STEPS: usize = 8;
/// Standard deviation of a joint of limbs that were laid anew, radians (17°): half of what places tried lie apart; and the
/// Gauss–Newton steps from there.
const LAID_SIGMA: f64 = 0.3;
const LAID_STEPS: usize = 16;

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
    let coarse = Sampled::new(&source, &target, &COARSE, settings)?;
    let starts = headings(&coarse, dressed, initial, settings);
    progress(0.2);
    let middle = Sampled::new(&source, &target, &MIDDLE, settings)?;
    let fine = Sampled::new(&source, &target, &FINE, settings)?;
    let (end, inside) = match settings.method {
        Method::Toile => {
            let inside = Inside::new(scan);
            let best = best_heading(&middle, starts, &dressed.skeleton, settings)?;
            let best = found_elsewhere(&middle, dressed, (scan, &inside), best, settings)?;
            progress(0.6);
            let prior = JointPrior::around(best.initial, settings.joint_sigma, &dressed.skeleton);
            let problem = fine.problem(&prior, body_joints(), true);
            let end = descend(&problem, best.now, settings.fine_iterations)?;
            (Descent { iterations: end.iterations + best.iterations, ..end }, inside)
        }
        Method::Seed => (seed_pose(&middle, starts.into_iter().map(|s| s.now), settings)?, Inside::new(scan)),
    };
    progress(0.95);
    let report = report(&fine, &inside, &end, initial);
    let uncovered = fine.uncovered_vertices(&source, &end.state);
    progress(1.0);
    Ok(UnderFit { pose: end.state.pose, uncovered, report })
}

fn check(dressed: &SkinnedMesh, trust: &[f32], scan: &Mesh, settings: &UnderSettings) -> Result<(), FittingError> {
    dressed.mesh.validate().map_err(|e| FittingError::Mesh(e.to_string()))?;
    scan.validate().map_err(|e| FittingError::Scan(e.to_string()))?;
    let count = dressed.mesh.positions.len();
    if !trust.is_empty() && trust.len() != count {
        return Err(FittingError::Mesh(format!("it has {count} vertices, but trust is given for {}", trust.len())));
    }
    if dressed.mesh.is_empty() {
        return Err(FittingError::Mesh("it has no triangles".into()));
    }
    if scan.is_empty() {
        return Err(FittingError::Scan("it has no triangles: scan the take again".into()));
    }
    settings.check()
}

struct Candidate {
    /// The pose to which joints are drawn, at this heading.
    initial: Pose,
    now: State,
    misfit: f64,
    iterations: usize,
}

/// The initial pose turned about the vertical through the scan's middle, the most promising headings first.
fn headings(coarse: &Sampled, dressed: &SkinnedMesh, initial: &Pose, settings: &UnderSettings) -> Vec<Candidate> {
    let here = coarse.body.pose(&State { pose: initial.clone(), beta: Vec::new() });
    let from = middle_of(&here.points, &coarse.body.areas);
    let to = middle_of(&coarse.scan.samples.points, &coarse.scan.samples.areas);
    let turned = |k: usize| {
        let angle = TAU * k as f64 / settings.headings as f64;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
        let mut shift = to - turn * from;
        shift.y = 0.0;
        let moved = initial.moved(&Isometry3::from_parts(Translation3::from(shift), turn), &dressed.skeleton);
        let now = State { pose: moved.clone(), beta: Vec::new() };
        Candidate { misfit: coarse.misfit(&now), initial: moved, now, iterations: 0 }
    };
    let mut judged: Vec<Candidate> = (0..settings.headings).into_par_iter().map(turned).collect();
    judged.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    judged.truncate(REFINED);
    judged
}

fn middle_of(points: &[Point3<f32>], areas: &[f32]) -> Vector3<f64> {
    let total: f64 = areas.iter().map(|&a| f64::from(a)).sum::<f64>().max(1e-12);
    points.iter().zip(areas).map(|(p, &a)| p.coords.cast::<f64>() * f64::from(a)).sum::<Vector3<f64>>() / total
}

/// Moves each candidate as a whole, then its limbs; keeps the one that agrees best with the scan.
fn best_heading(
    middle: &Sampled,
    candidates: Vec<Candidate>,
    skeleton: &Skeleton,
    settings: &UnderSettings,
) -> Result<Candidate, FittingError> {
    let refined = |c: Candidate| -> Result<Candidate, FittingError> {
        let prior = JointPrior::around(c.initial.clone(), settings.joint_sigma, skeleton);
        let rigid = descend(&middle.problem(&prior, vec![Joint::Hips], false), c.now, RIGID_STEPS)?;
        let bent = descend(&middle.problem(&prior, body_joints(), true), rigid.state, LIMB_STEPS)?;
        let iterations = rigid.iterations + bent.iterations;
        Ok(Candidate { misfit: middle.misfit(&bent.state), now: bent.state, iterations, ..c })
    };
    let ends = candidates.into_par_iter().map(refined).collect::<Result<Vec<_>, _>>()?;
    let iterations = ends.iter().map(|e| e.iterations).sum();
    let best = ends.into_iter().reduce(|a, b| if b.misfit < a.misfit { b } else { a });
    best.map(|b| Candidate { iterations, ..b }).ok_or(FittingError::Singular { what: "the heading" })
}

/// The candidate, or one whose limbs are laid anew where too much of the mesh lies outside the scan and that agrees better.
fn found_elsewhere(
    middle: &Sampled,
    dressed: &SkinnedMesh,
    (scan, inside): (&Mesh, &Inside),
    best: Candidate,
    settings: &UnderSettings,
) -> Result<Candidate, FittingError> {
    if !is_strained(&best.initial, &best.now, settings.joint_sigma) && !is_elsewhere(middle, inside, &best.now) {
        return Ok(best);
    }
    let laid = with_limbs_laid(dressed, scan, inside, &best.now)?;
    let mut best = best;
    for pose in std::iter::once(best.now.pose.clone()).chain(laid) {
        let prior = JointPrior::around(pose.clone(), LAID_SIGMA, &dressed.skeleton);
        let start = State { pose, beta: Vec::new() };
        let end = descend(&middle.problem(&prior, body_joints(), true), start, LAID_STEPS)?;
        let (misfit, iterations) = (middle.misfit(&end.state), best.iterations + end.iterations);
        best = if misfit < best.misfit {
            Candidate { initial: end.state.pose.clone(), now: end.state, misfit, iterations }
        } else {
            Candidate { iterations, ..best }
        };
    }
    Ok(best)
}

fn report(fine: &Sampled, inside: &Inside, end: &Descent, initial: &Pose) -> UnderReport {
    let posed = fine.body.pose(&end.state);
    let relations = fine.relations(&posed);
    let outside = inside.is_outside(&posed.points);
    let (mut total, mut open, mut squares, mut out) = (0.0, 0.0, 0.0, 0.0);
    for (v, &area) in fine.body.areas.iter().enumerate() {
        let area = f64::from(area);
        total += area;
        out += if outside[v] { area } else { 0.0 };
        let Some(r) = relations[v] else { continue };
        open += area * r.uncovered;
        squares += area * r.uncovered * f64::from(r.residual.value).powi(2);
    }
    let total = f64::max(total, 1e-12);
    let turn = end.state.pose.rotation(Joint::Hips) * initial.rotation(Joint::Hips).inverse();
    let front = turn * Vector3::z();
    let mut report = UnderReport {
        verdict: Verdict::Trusted,
        reasons: Vec::new(),
        iterations: end.iterations,
        converged: end.converged,
        heading_deg: front.x.atan2(front.z).to_degrees(),
        uncovered: open / total,
        uncovered_rms_mm: 1e3 * (squares / f64::max(open, 1e-12)).sqrt(),
        outside: out / total,
    };
    report.decide();
    report
}
