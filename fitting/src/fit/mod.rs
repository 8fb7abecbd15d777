//! Shape and pose of one scan: prepared, started from several headings, refined, judged.

mod arms;
mod astray;
mod bare;
mod body;
mod choose;
mod evidence;
mod fingers;
mod guides;
mod hands;
mod matches;
mod part;
mod placement;
mod prepare;
mod problem;
mod report;
mod resolution;
mod rules;
mod search;
mod seed;
mod starts;
mod upright;
mod verdict;

pub(crate) use fingers::fit_hands_again;
pub(crate) use problem::BodyProblem;
pub(crate) use search::{Depths, Search};
pub use {
    bare::take_on_bare_skin,
    body::{BodyFit, fit_body},
    prepare::Mend,
    report::{DistanceStats, FitReport, PartShown, Verdict},
    upright::find_upright,
};
