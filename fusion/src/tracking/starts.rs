//! Registration from several starts, where it is not known well enough where the subject is.

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;
use toile_geometry::Rigid;

use super::{approach::approach, registration::register, samples::samples, tracked::Tracked};
use crate::{
    field::{Tsdf, ray_cast},
    frame::DepthView,
};

/// First guesses of the turn between two frames, degrees.
pub(crate) const FIRST_TURNS: [f64; 11] = [0.0, 1.5, -1.5, 3.5, -3.5, 6.0, -6.0, 9.0, -9.0, 13.0, -13.0];
/// Points of a trial, and of the registration that follows the best one.
const TRIAL_POINTS: usize = 1500;
const POINTS: usize = 6000;
/// Pixels between rays of a trial.
const TRIAL_STRIDE: usize = 6;

/// The pose that fits best among registrations from several starts.
pub(crate) fn best_of(field: &Tsdf, view: &DepthView, starts: &[Rigid]) -> Tracked {
    let few = samples(view, TRIAL_POINTS);
    let score = |t: &Tracked| t.overlap * t.inliers / (t.residual + 1e-3);
    let rough: Vec<Tracked> = starts
        .par_iter()
        .map(|g| {
            let seen = ray_cast(field, &view.camera, g, TRIAL_STRIDE);
            register(field, &few, &approach(&seen, g, &few, g))
        })
        .collect();
    let best = rough.iter().max_by(|a, b| score(a).total_cmp(&score(b)));
    let start = best.map_or_else(Rigid::identity, |t| t.model_from_camera);
    register(field, &samples(view, POINTS), &start)
}

/// A pose turned about the first model frame's axis by several angles (degrees).
pub(crate) fn turned(pose: &Rigid, degrees: &[f64]) -> Vec<Rigid> {
    degrees.iter().map(|d| Isometry3::rotation(Vector3::y() * d.to_radians()) * pose).collect()
}
