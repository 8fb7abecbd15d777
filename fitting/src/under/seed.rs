//! The seed's own pose under clothes: articulated ICP on chosen joints (Hu et al. 2017, eq. 5), the mesh kept inside the
//! scan (eq. 6).

use toile_character::Joint;

use super::problem::Sampled;
use crate::{
    FittingError, UnderSettings,
    solve::{Columns, Descent, Norm, PointToPoint, State, descend},
};

/// Steps of the whole mesh before its joints turn.
const RIGID_STEPS: usize = 12;

/// The pose from the one of `starts` on that the whole mesh fits best; they stand near the scan's middle. The paper does
/// not say how its search begins.
///
/// # Errors
/// [`FittingError::Singular`] where the scan leaves a joint undetermined.
pub(crate) fn seed_pose(
    sampled: &Sampled,
    starts: impl IntoIterator<Item = State>,
    settings: &UnderSettings,
) -> Result<Descent, FittingError> {
    let over = |joints: Vec<Joint>, inside: bool| PointToPoint {
        body: &sampled.body,
        scan: &sampled.scan,
        columns: Columns::new(joints, 0),
        norm: Norm::Squared,
        inside,
    };
    let whole = over(vec![Joint::Hips], false);
    let mut best: Option<(f64, Descent)> = None;
    for start in starts {
        let rigid = descend(&whole, start, RIGID_STEPS)?;
        let off = whole.mean_distance(&rigid.state);
        if best.as_ref().is_none_or(|b| off < b.0) {
            best = Some((off, rigid));
        }
    }
    let (_, rigid) = best.ok_or(FittingError::Singular { what: "the heading" })?;
    let chosen = [Joint::Hips].into_iter().chain(settings.joints.iter().copied().filter(|j| *j != Joint::Hips));
    let end = descend(&over(chosen.collect(), settings.inside), rigid.state, settings.fine_iterations)?;
    Ok(Descent { iterations: rigid.iterations + end.iterations, ..end })
}
