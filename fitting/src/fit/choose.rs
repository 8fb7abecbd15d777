//! Which start is taken: the best of the usual ones, or, where it leaves too much astray, the best of a search for any pose.

use nalgebra::{UnitQuaternion, Vector3};
use toile_character::BodyModel;
use toile_geometry::{Mesh, bvh::Bvh};

use super::{
    astray::Astray,
    guides::Guides,
    hands::turned_hands,
    placement::Extent,
    problem::BodyProblem,
    resolution::{Resolutions, Sampled},
    search::{Depths, Search, searched},
    starts::Start,
};
use crate::{
    FitSettings, FittingError,
    solve::{JointPrior, descend},
};

/// Number of coarse starts that are taken to the middle resolution: the right heading and the one it is confused with.
const HEADINGS_COMPARED: usize = 2;
/// The same of the poses that a search found.
const FOUND_COMPARED: usize = 5;
/// Height over longest side of a scan from which on it is taken to stand on +Y, as documented, whatever its pose.
const STANDS: f32 = 0.5;

/// Takes the best starts to the resolution at which front and back differ, and keeps the one that agrees best. Limbs are not
/// searched under clothes, nor where a scan shows only a part of a person.
///
/// # Errors
/// [`FittingError`] where the scan has no surface or leaves the pose undetermined.
pub(crate) fn best_start(
    model: &BodyModel,
    (scan, trust, bvh): (&Mesh, &[f32], &Bvh),
    guides: &Guides,
    settings: &FitSettings,
    (starts, extent): (Vec<Start>, Extent),
    resolutions: &Resolutions,
) -> Result<Start, FittingError> {
    let sampled = Sampled::new(model, scan, trust, guides, resolutions.heading)?;
    let prior = JointPrior::standing(&model.mean_skeleton);
    let problem = sampled.problem(&prior, settings.shape_sigma);
    let iterations: usize = starts.iter().map(|s| s.iterations).sum();
    let mut best = compared(&sampled, &problem, starts, HEADINGS_COMPARED)?;
    best.iterations += iterations;
    let astray = Astray::new(model, &sampled, &problem, bvh, &best.state);
    // clothes stand off everywhere, which is no limb in another place
    if settings.dressed || extent == Extent::FromCrown || !astray.is_wrong() {
        best.state = turned_hands(model, &sampled, best.state);
        return Ok(best);
    }
    let mut best = search_any_pose(model, (scan, trust, bvh), &sampled, settings, best, resolutions)?;
    best.state = turned_hands(model, &sampled, best.state);
    Ok(best)
}

/// The best pose of a search, where it agrees better than `usual`; the latter otherwise.
fn search_any_pose(
    model: &BodyModel,
    (scan, trust, bvh): (&Mesh, &[f32], &Bvh),
    sampled: &Sampled,
    settings: &FitSettings,
    usual: Start,
    resolutions: &Resolutions,
) -> Result<Start, FittingError> {
    let Some(depths) = Depths::new(scan, bvh) else { return Ok(usual) };
    let found = searched(model, (scan, trust), &depths, &usual, &likely_up(scan, &usual), resolutions.coarse)?;
    if found.is_empty() {
        return Ok(usual);
    }
    let mut iterations = usual.iterations + found.iter().map(|s| s.iterations).sum::<usize>();
    let roaming = JointPrior::roaming(&model.mean_skeleton);
    let problem = sampled.problem(&roaming, settings.shape_sigma);
    let mut best = compared(sampled, &problem, found, FOUND_COMPARED)?;
    iterations += best.iterations;
    if Astray::new(model, sampled, &problem, bvh, &best.state).is_wrong() {
        let again = Search { problem: &problem, depths: &depths }.with_limbs(best.state.clone(), best.up, true)?;
        iterations += again.iterations;
        best = if again.misfit < best.misfit { again } else { best };
    }
    best = if best.misfit < usual.misfit { best } else { usual };
    Ok(Start { iterations, ..best })
}

/// The best of the first `count` starts, each descended.
fn compared(sampled: &Sampled, problem: &BodyProblem, starts: Vec<Start>, count: usize) -> Result<Start, FittingError> {
    let mut best: Option<Start> = None;
    let mut iterations = 0;
    for start in starts.into_iter().take(count) {
        let steps = sampled.resolution.iterations;
        let end = descend(problem, start.state.with_components(sampled.components), steps)?;
        iterations += end.iterations;
        let misfit = problem.misfit(&end.state);
        if best.as_ref().is_none_or(|b| misfit < b.misfit) {
            best = Some(Start { state: end.state, misfit, ..start });
        }
    }
    best.map(|b| Start { iterations, ..b }).ok_or(FittingError::Singular { what: "the heading" })
}

/// The scan's own +Y where it is tall enough to stand on it, else the way that the usual start stands.
fn likely_up(scan: &Mesh, usual: &Start) -> UnitQuaternion<f64> {
    let size = scan.bounds().map_or_else(Vector3::zeros, |(low, high)| high - low);
    if size.y >= STANDS * size.max() { UnitQuaternion::identity() } else { usual.up }
}
