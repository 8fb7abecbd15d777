//! Whether a pose that registration found can be trusted.

use nalgebra::Point3;
use toile_geometry::Rigid;

use super::tracked::Tracked;
use crate::{
    drop_reason::DropReason,
    frame::{DepthView, depth_noise},
};

/// Smallest overlap and share of inliers of a trusted pose.
const OVERLAP: f64 = 0.4;
const INLIERS: f64 = 0.5;
/// Largest residual of a trusted pose, as a share of the truncation distance.
const RESIDUAL: f64 = 0.4;
/// A residual of at most this many standard deviations of the frame's own noise is trusted too: far rooms are noisy.
const NOISE_RESIDUAL: f64 = 2.5;
/// A trusted pose departs from a turntable's prediction by at most this: metres at the axis, and radians.
const DEPARTURE: f64 = 0.06;
const DEPARTURE_ANGLE: f64 = 0.12;

/// Checks overlap, inliers and residual, and the departure from the expected pose where one is given.
///
/// # Errors
/// Why the pose cannot be trusted.
pub(crate) fn trusted(
    view: &DepthView,
    tracked: &Tracked,
    truncation: f32,
    expected: Option<&Rigid>,
) -> Result<(), DropReason> {
    fits(view, tracked, truncation, OVERLAP)?;
    let departure = expected.map_or_else(Rigid::identity, |e| tracked.model_from_camera * e.inverse());
    let (shift, angle) = ((departure * Point3::origin()).coords.norm(), departure.rotation.angle());
    if shift > DEPARTURE || angle > DEPARTURE_ANGLE {
        return Err(DropReason::Departs { shift, angle });
    }
    Ok(())
}

/// Checks overlap, inliers and residual.
///
/// # Errors
/// Why the pose cannot be trusted.
pub(crate) fn fits(view: &DepthView, tracked: &Tracked, truncation: f32, min_overlap: f64) -> Result<(), DropReason> {
    let Tracked { overlap, inliers, residual, .. } = *tracked;
    if overlap < min_overlap {
        return Err(DropReason::LittleOverlap { overlap });
    }
    if inliers < INLIERS || residual > residual_limit(view, residual, truncation) {
        return Err(DropReason::Disagrees { inliers, residual });
    }
    Ok(())
}

/// The largest residual that is trusted, metres; the frame's noise is only measured where that decides.
fn residual_limit(view: &DepthView, residual: f64, truncation: f32) -> f64 {
    let limit = RESIDUAL * f64::from(truncation);
    if residual <= limit {
        return limit;
    }
    let depth: Vec<f32> = view.elements[..view.pixels()].iter().map(|e| e.depth()).collect();
    limit.max(NOISE_RESIDUAL * depth_noise(&view.camera, &depth).unwrap_or(0.0))
}
