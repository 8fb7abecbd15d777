//! The pose of somebody who stands in an unusual way: arms behind the back, a step, a bow, a leg lifted.
//!
//! Closest points find a pose only from nearby. Where the usual starts leave scan or body unexplained, the trunk is looked
//! for first: it is the thickest part of the scan, whatever the limbs do. From each place that it may have, limbs are
//! laid in the directions that agree best with what the rest of the body leaves over, one after the other, and the whole
//! is fitted; this is repeated while limbs find better places. Nothing in it is learnt: directions cover what joints can do.

mod depths;
mod directions;
mod limbs;
mod trunk;

use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use toile_character::BodyModel;
use toile_geometry::Mesh;

use super::{
    guides::Guides,
    problem::BodyProblem,
    resolution::{Resolution, Sampled},
    starts::{COARSE_SHAPE_SIGMA, Start},
};
use crate::{
    FittingError,
    solve::{JointPrior, State, descend},
};
pub(crate) use depths::Depths;
use trunk::placed_trunks;

/// Number of places of the trunk from which limbs are laid.
const TRUNKS: usize = 10;
/// Rounds in which limbs are laid again.
const ROUNDS: usize = 3;
/// Gauss–Newton steps after each.
const STEPS: usize = 8;

/// The poses found, best first: from the trunk's places, and from `usual` with its limbs moved. `up` is the rotation that
/// turns the scan upright.
///
/// # Errors
/// [`FittingError`] where the scan has no surface or leaves the pose undetermined.
pub(crate) fn searched(
    model: &BodyModel,
    (scan, trust): (&Mesh, &[f32]),
    depths: &Depths,
    usual: &Start,
    up: &UnitQuaternion<f64>,
    coarse: Resolution,
) -> Result<Vec<Start>, FittingError> {
    let sampled = Sampled::new(model, scan, trust, &Guides::default(), coarse)?;
    let prior = JointPrior::roaming(&model.mean_skeleton);
    let problem = sampled.problem(&prior, COARSE_SHAPE_SIGMA);
    let Some(thick) = depths.thick_part() else { return Ok(Vec::new()) };
    let mut trunks = placed_trunks(model, (scan, trust), &thick, up, &prior, coarse)?;
    trunks.truncate(TRUNKS);
    let search = Search { problem: &problem, depths };
    let as_usual = usual.state.clone().with_components(sampled.components);
    let seeds: Vec<(State, UnitQuaternion<f64>, bool)> = std::iter::once((as_usual, usual.up, true))
        .chain(trunks.into_iter().map(|trunk| (trunk, *up, false)))
        .collect();
    let ends = seeds.into_par_iter().map(|(state, up, has_limbs)| search.with_limbs(state, up, has_limbs));
    let mut found = ends.collect::<Result<Vec<_>, _>>()?;
    found.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    Ok(found)
}

/// What limbs are laid against.
pub(crate) struct Search<'a> {
    pub problem: &'a BodyProblem<'a>,
    pub depths: &'a Depths,
}

impl Search<'_> {
    /// Lays the limbs of a body whose trunk is placed (where it has none yet), fits, and lays those again that find a better
    /// place.
    ///
    /// # Errors
    /// [`FittingError::Singular`] where the scan leaves the pose undetermined.
    pub fn with_limbs(&self, state: State, up: UnitQuaternion<f64>, has_limbs: bool) -> Result<Start, FittingError> {
        let mut iterations = 0;
        let mut fitted = |state: State| -> Result<(State, f64), FittingError> {
            let end = descend(self.problem, state, STEPS)?;
            iterations += end.iterations;
            Ok((end.state.clone(), self.problem.misfit(&end.state)))
        };
        let mut best = fitted(if has_limbs { state } else { self.laid(&state) })?;
        for _ in 0..ROUNDS {
            let Some(state) = self.moved(&best.0) else { break };
            let next = fitted(state)?;
            if next.1 >= best.1 {
                break;
            }
            best = next;
        }
        let (state, misfit) = best;
        Ok(Start { state, up, misfit, iterations, is_usual: false })
    }
}
