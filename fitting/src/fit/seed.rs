//! The seed's own fit: argmin over θ and β of Σ ‖M(θ, β) − Y‖, without priors (Hu et al. 2017, eq. 4).
//!
//! The paper does not say how its search begins; here it begins at the heading whose coarse fit is nearest to the scan.

use std::f64::consts::TAU;

use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use toile_character::BodyModel;
use toile_geometry::Mesh;

use super::{
    guides::Guides,
    placement::{Extent, Placement},
    resolution::{Resolutions, Sampled},
    starts::Start,
};
use crate::{
    FitSettings, FittingError,
    solve::{Columns, Descent, Norm, PointToPoint, State, body_joints, descend, main_joints},
};

/// The start whose coarse fit is nearest to the scan. `ups` are the rotations that may turn the scan upright.
///
/// # Errors
/// [`FittingError`] where the scan has no surface or leaves the pose undetermined.
pub(crate) fn seed_start(
    model: &BodyModel,
    scan: &Mesh,
    trust: &[f32],
    ups: &[UnitQuaternion<f64>],
    settings: &FitSettings,
) -> Result<Start, FittingError> {
    let coarse = Resolutions::new(settings).coarse;
    let sampled = Sampled::new(model, scan, trust, &Guides::default(), coarse)?;
    let columns = Columns::new(main_joints(), sampled.components);
    let problem = problem(&sampled, columns);
    let turns: Vec<(usize, usize)> =
        (0..ups.len()).flat_map(|up| (0..settings.headings).map(move |h| (up, h))).collect();
    let coarse_fit = |(up, h): (usize, usize)| -> Result<Start, FittingError> {
        let heading = TAU * h as f64 / settings.headings as f64;
        let place = Placement::new(model, scan, &ups[up], sampled.components, Extent::Whole);
        let state = place.state(model, heading, 0.0, &ups[up]);
        let end = descend(&problem, state, coarse.iterations)?;
        Ok(Start {
            misfit: problem.mean_distance(&end.state),
            state: end.state,
            up: ups[up],
            iterations: end.iterations,
            is_usual: true,
        })
    };
    let all = turns.into_par_iter().map(coarse_fit).collect::<Result<Vec<_>, _>>()?;
    let best = all.into_iter().reduce(|a, b| if b.misfit < a.misfit { b } else { a });
    best.ok_or(FittingError::Singular { what: "the heading" })
}

/// The fit of all body joints and components, from a state near the scan.
///
/// # Errors
/// As [`seed_start`].
pub(crate) fn seed_fit(
    model: &BodyModel,
    scan: &Mesh,
    trust: &[f32],
    settings: &FitSettings,
    state: State,
) -> Result<Descent, FittingError> {
    let fine = Resolutions::new(settings).fine;
    let sampled = Sampled::new(model, scan, trust, &Guides::default(), fine)?;
    let columns = Columns::new(body_joints(), sampled.components);
    descend(&problem(&sampled, columns), state.with_components(sampled.components), fine.iterations)
}

fn problem(sampled: &Sampled, columns: Columns) -> PointToPoint<'_> {
    PointToPoint { body: &sampled.body, scan: &sampled.scan, columns, norm: Norm::Plain, inside: false }
}
