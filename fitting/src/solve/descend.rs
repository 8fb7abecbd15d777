//! The Gauss–Newton loop that every fit of a shape or pose runs (Hu et al. 2017, eq. 4 to 6).

use nalgebra::Isometry3;

use super::{Columns, NormalEquations, State, bounds::Bound};
use crate::FittingError;

/// Largest turn of a joint in one step, radians (14°): beyond it the linearised rotation is off by more than 3 %.
const LARGEST_TURN: f64 = 0.25;
/// Levenberg's damping, as a share of each diagonal entry: keeps steps finite along directions that nothing measures.
const DAMPING: f64 = 1e-4;

/// A least-squares problem over the unknowns of a [`State`].
pub(crate) trait Problem {
    /// Which unknowns are free.
    fn columns(&self) -> &Columns;

    /// The problem linearised at `state`, with fresh correspondences.
    fn linearised(&self, state: &State) -> Linearised;

    /// Whether a step over [`Problem::columns`] is too small to go on. `decrement`: twice by how much the step is to lower the
    /// cost ½ Σ (r / σ)² (Newton's decrement, squared).
    fn is_small(&self, step: &[f64], decrement: f64) -> bool;

    /// The unknown that is solved for, as an error names it.
    fn solved_for(&self) -> &'static str;
}

/// A problem linearised at one state.
pub(crate) struct Linearised {
    pub equations: NormalEquations,
    /// World position and orientation of each joint: the step turns joints about these.
    pub frames: Vec<Isometry3<f64>>,
    /// The bounds that the step must keep to.
    pub bounds: Vec<Bound>,
}

/// Where a descent ended.
pub(crate) struct Descent {
    pub state: State,
    /// Steps that were made.
    pub iterations: usize,
    /// Whether the last step was small.
    pub converged: bool,
}

/// Steps from `state` until a step is small or `iterations` steps are made.
///
/// # Errors
/// [`FittingError::Singular`] where the data leave an unknown undetermined.
pub(crate) fn descend(problem: &impl Problem, state: State, iterations: usize) -> Result<Descent, FittingError> {
    let mut end = Descent { state, iterations: 0, converged: false };
    while end.iterations < iterations && !end.converged {
        let Linearised { equations, frames, bounds } = problem.linearised(&end.state);
        let gradient = equations.g.clone();
        let step = equations.step(DAMPING, &bounds).ok_or(FittingError::Singular { what: problem.solved_for() })?;
        end.converged = problem.is_small(step.as_slice(), -gradient.dot(&step));
        end.state = end.state.stepped(&shortened(step.as_slice(), problem.columns()), problem.columns(), &frames);
        end.iterations += 1;
    }
    Ok(end)
}

/// The whole step made shorter where a joint would turn too far.
fn shortened(step: &[f64], columns: &Columns) -> Vec<f64> {
    let turns = &step[3..columns.first_beta()];
    let largest = turns.iter().fold(0.0f64, |m, d| m.max(d.abs()));
    let scale = if largest > LARGEST_TURN { LARGEST_TURN / largest } else { 1.0 };
    step.iter().map(|d| d * scale).collect()
}
