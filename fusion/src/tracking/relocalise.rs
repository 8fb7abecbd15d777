//! Finding the subject again.
//!
//! A frame that does not fit where it is expected is first tried at key frames and a little turned. A foreign frame
//! ends there. Where the next frames do not fit either, the subject has moved unseen: it is searched for about the axis,
//! nearest turns first, a slice a frame, so that no push takes long. What is found is only a candidate: it is not
//! fused, and the next frame must be tracked from it. At most [`PATIENCE`] + [`SLICES`] + 1 frames are left out.

use toile_geometry::Rigid;

use super::{
    axis::Axis,
    kept::Past,
    starts::{FIRST_TURNS, best_of, turned},
    tracked::Tracked,
};
use crate::{field::Tsdf, frame::DepthView, settings::Prior};

/// Lost frames in a row before the subject is searched for.
pub(crate) const PATIENCE: usize = 1;
/// Turns that are searched, degrees apart.
const SEARCH_STEP: f64 = 7.5;
/// Turns that are tried with a frame.
const SLICE: usize = 12;
/// Frames after which the whole turn has been searched.
pub(crate) const SLICES: usize = 4;
/// Key poses that are tried.
const PLACES: usize = 12;

/// The best fit at key poses and, on a turntable, at turned predictions.
pub(crate) fn try_known_places(past: Past<'_>, view: &DepthView, predicted: &Rigid, prior: Prior) -> Tracked {
    let frames = &past.kept.frames;
    let step = (frames.len() / PLACES).max(1);
    let mut starts: Vec<Rigid> = frames.iter().rev().step_by(step).map(|k| k.model_from_camera).collect();
    if prior == Prior::Turntable {
        starts.extend(turned(predicted, &FIRST_TURNS));
    }
    best_of(past.field, view, &starts)
}

/// The best fit at the next turns about the axis, when `lost` frames in a row have had no trusted pose.
pub(crate) fn search_about(axis: &Axis, field: &Tsdf, view: &DepthView, predicted: &Rigid, lost: usize) -> Tracked {
    let slice = (lost - PATIENCE - 1) % SLICES;
    let turn = |k: usize| {
        let size = k.div_ceil(2) as f64 * SEARCH_STEP.to_radians();
        axis.turn(if k % 2 == 1 { size } else { -size }) * predicted
    };
    let starts: Vec<Rigid> = (slice * SLICE..(slice + 1) * SLICE).map(turn).collect();
    best_of(field, view, &starts)
}
