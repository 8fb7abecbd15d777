//! A few views with wide and uneven steps between them: where a turntable has stopped, or a hand has turned it. No rate
//! predicts the next one, so that each is searched for over the whole turn.

use nalgebra::{Point3, Vector3};
use toile_geometry::Rigid;

use super::{
    kept::Past,
    starts::{best_of, turned},
    tracked::Tracked,
    trust::fits,
};
use crate::{drop_reason::DropReason, frame::DepthView};

/// A take of at most this many frames is a set of views: a full turn of it has steps of 9° and more.
pub(crate) const MAX_VIEWS: usize = 40;
/// Turns that are searched, degrees apart: the approach comes near from half of that.
const STEP: f64 = 7.5;
/// Smallest overlap of a trusted view: of two views 50° apart a third of the surface is seen in both.
const OVERLAP: f64 = 0.25;
/// Largest residual, as a multiple of the usual one: false places fit three times worse.
const RESIDUAL: f64 = 1.5;
/// A disk turns about its axis alone: largest tilt (radians), and largest shift of the axis as it is known so far (metres).
const TILT: f64 = 0.12;
const SHIFT: f64 = 0.10;

/// The pose of a view somewhere about the axis (the model's +Y), from that of any other view.
///
/// # Errors
/// Why none can be trusted.
pub(crate) fn place_view(past: Past<'_>, view: &DepthView, other: &Rigid) -> Result<Tracked, DropReason> {
    let turns: Vec<f64> = (0..(360.0 / STEP) as usize).map(|k| k as f64 * STEP).collect();
    let found = best_of(past.field, view, &turned(other, &turns));
    fits(view, &found, past.field.truncation(), OVERLAP)?;
    let usual = RESIDUAL * past.kept.usual_residual();
    if found.residual > usual {
        return Err(DropReason::Disagrees { inliers: found.inliers, residual: found.residual });
    }
    let motion = found.model_from_camera * other.inverse();
    let (angle, shift) = ((motion * Vector3::y()).angle(&Vector3::y()), (motion * Point3::origin()).coords.norm());
    if angle > TILT || shift > SHIFT {
        return Err(DropReason::Departs { shift, angle });
    }
    Ok(found)
}
