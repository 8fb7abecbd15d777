//! One resolution of the fit: Gauss–Newton steps with fresh closest points (articulated ICP).

use toile_character::Joint;

use crate::{
    FittingError,
    articulated::{Articulated, Columns, Posed, State},
    cloud::{Cloud, Samples},
    correspond::{Gate, Matches, matches},
    equations::NormalEquations,
    prior::{JointPrior, add_shape_prior},
};

/// Largest turn of a joint in one step, radians.
const LARGEST_TURN: f64 = 0.25;
/// A step below these (radians and metres; β) ends a level.
const SMALL_MOVE: f64 = 4e-4;
const SMALL_BETA: f64 = 0.02;

/// Everything a level needs.
pub(crate) struct Level<'a> {
    pub body: &'a Articulated,
    pub scan: &'a Cloud,
    pub reverse: &'a Samples,
    pub gate: Gate,
    pub columns: Columns,
    pub iterations: usize,
    pub shape_sigma: f64,
    /// The translation stays as it is: only joints turn.
    pub rooted: bool,
}

/// Where a level ended.
pub(crate) struct LevelResult {
    pub state: State,
    pub matches: Matches,
    pub iterations: usize,
    pub converged: bool,
}

impl Level<'_> {
    /// Steps from `state` until the steps are small or the iterations are used up.
    pub fn run(&self, mut state: State, prior: &JointPrior) -> Result<LevelResult, FittingError> {
        let (mut converged, mut done) = (false, 0);
        while done < self.iterations && !converged {
            let posed = self.body.pose(&state);
            let found = matches(self.body, &posed, self.scan, self.reverse, &self.gate);
            let delta = self.step(&state, &posed, &found, prior)?;
            converged = self.is_small(&delta);
            state = state.stepped(&delta, &self.columns, &posed.frames);
            done += 1;
        }
        let posed = self.body.pose(&state);
        let matches = matches(self.body, &posed, self.scan, self.reverse, &self.gate);
        Ok(LevelResult { state, matches, iterations: done, converged })
    }

    fn step(
        &self,
        state: &State,
        posed: &Posed,
        found: &Matches,
        prior: &JointPrior,
    ) -> Result<Vec<f64>, FittingError> {
        let mut equations = NormalEquations::sum(&found.residuals, self.body, posed, &self.columns);
        prior.add(&mut equations, state, posed, &self.columns);
        add_shape_prior(&mut equations, state, &self.columns, self.shape_sigma);
        if self.rooted {
            (0..3).for_each(|axis| equations.add_single(axis, 0.0, 1e-7));
        }
        let delta = equations.step(1e-4).ok_or(FittingError::Singular { what: "the pose" })?;
        Ok(clamped(delta.as_slice(), &self.columns))
    }

    fn is_small(&self, delta: &[f64]) -> bool {
        let (moves, betas) = delta.split_at(self.columns.first_beta());
        moves.iter().all(|d| d.abs() < SMALL_MOVE) && betas.iter().all(|d| d.abs() < SMALL_BETA)
    }
}

/// The whole step made shorter where a joint would turn too far.
pub(crate) fn clamped(delta: &[f64], columns: &Columns) -> Vec<f64> {
    let turns = &delta[3..columns.first_beta()];
    let largest = turns.iter().fold(0.0f64, |m, d| m.max(d.abs()));
    let scale = if largest > LARGEST_TURN { LARGEST_TURN / largest } else { 1.0 };
    delta.iter().map(|d| d * scale).collect()
}

/// The joints that coarse levels turn.
pub(crate) fn main_joints() -> Vec<Joint> {
    use Joint::*;
    vec![
        Hips,
        Spine,
        LeftUpperArm,
        RightUpperArm,
        LeftLowerArm,
        RightLowerArm,
        LeftUpperLeg,
        RightUpperLeg,
        LeftLowerLeg,
        RightLowerLeg,
    ]
}

/// All joints but those of the fingers.
pub(crate) fn body_joints() -> Vec<Joint> {
    toile_character::joint::JOINTS.into_iter().filter(|j| !j.is_finger()).collect()
}
