//! Where a fit begins: the scan's front, up and arm angles are unknown, so that several starts compete.

use std::f64::consts::TAU;

use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use toile_character::BodyModel;
use toile_geometry::Mesh;

use super::{
    arms::found_arms,
    guides::Guides,
    placement::{Extent, Placement},
    problem::BodyProblem,
    resolution::{Resolution, Sampled},
};
use crate::{
    FittingError,
    solve::{Descent, JointPrior, State, descend},
};

/// Turns of the upper arms away from the A-pose that are tried, degrees; positive raises the arms.
const ARM_TURNS: [f64; 3] = [0.0, -25.0, 35.0];
/// Number of starts that are refined.
const REFINED: usize = 4;
/// Standard deviation that the coarse shape is held to, in those of β: height and girth of nearly everybody.
pub(crate) const COARSE_SHAPE_SIGMA: f64 = 1.0;

/// A coarse fit of one start.
pub(crate) struct Start {
    pub state: State,
    /// The rotation that turns the scan upright.
    pub up: UnitQuaternion<f64>,
    /// Coarse misfit, 0–1.
    pub misfit: f64,
    pub iterations: usize,
    /// Found from the usual stances, not by searching any pose.
    pub is_usual: bool,
}

/// The best coarse fits to a scan that shows `extent` of a person, best first. `ups` are the rotations that may turn the scan
/// upright.
///
/// # Errors
/// [`FittingError`] where the scan has no surface or leaves the pose undetermined.
pub(crate) fn starts(
    model: &BodyModel,
    (scan, trust): (&Mesh, &[f32]),
    ups: &[UnitQuaternion<f64>],
    extent: Extent,
    guides: &Guides,
    headings: usize,
    coarse: Resolution,
) -> Result<Vec<Start>, FittingError> {
    let sampled = Sampled::new(model, scan, trust, guides, coarse)?;
    let prior = JointPrior::standing(&model.mean_skeleton);
    let problem = sampled.problem(&prior, COARSE_SHAPE_SIGMA);
    let coarse_fit = |start: Start| -> Result<Start, FittingError> {
        let first = ended(&problem, start.up, descend(&problem, start.state, coarse.iterations)?);
        let Some(state) = found_arms(&problem, &first.state) else { return Ok(first) };
        let mut again = ended(&problem, start.up, descend(&problem, state, coarse.iterations)?);
        again.iterations += first.iterations;
        Ok(if again.misfit < first.misfit { again } else { first })
    };
    let candidates = candidates(model, (scan, extent), &problem, ups, headings)?;
    let mut refined = candidates.into_par_iter().map(coarse_fit).collect::<Result<Vec<_>, _>>()?;
    refined.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    Ok(refined)
}

fn ended(problem: &BodyProblem, up: UnitQuaternion<f64>, end: Descent) -> Start {
    Start { misfit: problem.misfit(&end.state), state: end.state, up, iterations: end.iterations, is_usual: true }
}

/// All starts, driven by landmarks where some were set by hand and judged without moving them further: the best arms for
/// each heading and up, of these the most promising few.
fn candidates(
    model: &BodyModel,
    (scan, extent): (&Mesh, Extent),
    problem: &BodyProblem,
    ups: &[UnitQuaternion<f64>],
    headings: usize,
) -> Result<Vec<Start>, FittingError> {
    let components = problem.columns.betas;
    let places: Vec<Placement> = ups.iter().map(|up| Placement::new(model, scan, up, components, extent)).collect();
    let turns: Vec<(usize, usize)> = (0..ups.len()).flat_map(|u| (0..headings).map(move |h| (u, h))).collect();
    let judged = |(up, h): (usize, usize)| -> Result<Start, FittingError> {
        let heading = TAU * h as f64 / headings as f64;
        let [first, others @ ..] = ARM_TURNS.map(|arms| {
            let state = places[up].state(model, heading, arms.to_radians(), &ups[up]);
            let state = problem.guide.map_or(Ok(state.clone()), |guide| guide.drive(&state))?;
            Ok::<_, FittingError>(Start {
                misfit: problem.misfit(&state),
                state,
                up: ups[up],
                iterations: 0,
                is_usual: true,
            })
        });
        others.into_iter().try_fold(first?, |a, b| b.map(|b| if b.misfit < a.misfit { b } else { a }))
    };
    let mut best = turns.into_par_iter().map(judged).collect::<Result<Vec<_>, _>>()?;
    best.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    best.truncate(REFINED);
    Ok(best)
}
