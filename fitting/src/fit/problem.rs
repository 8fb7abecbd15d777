//! Shape and pose against a scan at one resolution (Hu et al. 2017, eq. 4): closest points in both directions, priors.

use super::{guides::Guide, matches::matches};
use crate::{
    solve::{Articulated, Columns, Gate, JointPrior, Linearised, NormalEquations, Problem, State, add_shape_prior},
    surface::{Cloud, Samples},
};

/// A step below these ends a resolution: metres and radians (0.4 mm at a metre), and standard deviations of β (some
/// tenths of a millimetre for the strongest component).
const SMALL_MOVE: f64 = 4e-4;
const SMALL_BETA: f64 = 0.02;
/// Standard deviation of a translation that is to stay, metres.
const ROOTED: f64 = 1e-7;

/// The body model against a scan.
pub(crate) struct BodyProblem<'a> {
    pub body: &'a Articulated,
    pub scan: &'a Cloud,
    /// Scan samples that are looked up on the body.
    pub reverse: &'a Samples,
    pub gate: Gate,
    pub columns: Columns,
    pub prior: &'a JointPrior,
    /// Landmarks that were set by hand.
    pub guide: Option<&'a Guide>,
    /// Standard deviation of each shape coefficient.
    pub shape_sigma: f64,
    /// The translation stays as it is: only joints turn.
    pub is_rooted: bool,
    /// The squared Newton decrement below which the descent has come to rest; 0 where only short steps say so.
    pub rest: f64,
}

impl Problem for BodyProblem<'_> {
    fn columns(&self) -> &Columns {
        &self.columns
    }

    fn linearised(&self, state: &State) -> Linearised {
        let posed = self.body.pose(state);
        let found = matches(self.body, &posed, self.scan, self.reverse, &self.gate);
        let mut equations = NormalEquations::accumulate(&found.residuals, self.body, &posed, &self.columns);
        self.prior.add(&mut equations, state, &posed.frames, &self.columns);
        add_shape_prior(&mut equations, state, &self.columns, self.shape_sigma);
        if let Some(guide) = self.guide {
            guide.add(&mut equations, state, &self.columns);
        }
        if self.is_rooted {
            (0..3).for_each(|axis| equations.add_single(axis, 0.0, ROOTED));
        }
        Linearised { equations, frames: posed.frames, bounds: Vec::new() }
    }

    fn is_small(&self, step: &[f64], decrement: f64) -> bool {
        let (moves, betas) = step.split_at(self.columns.first_beta());
        let is_short = moves.iter().all(|d| d.abs() < SMALL_MOVE) && betas.iter().all(|d| d.abs() < SMALL_BETA);
        is_short || decrement < self.rest
    }

    fn solved_for(&self) -> &'static str {
        "the pose"
    }
}

impl BodyProblem<'_> {
    /// How badly body and scan agree at `state`, 0–1; landmarks that were set by hand add as much again.
    pub fn misfit(&self, state: &State) -> f64 {
        let found = matches(self.body, &self.body.pose(state), self.scan, self.reverse, &self.gate);
        found.misfit + self.guide.map_or(0.0, |g| g.misfit(state))
    }
}
