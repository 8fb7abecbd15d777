//! Finding the subject again.
//!
//! A frame that does not fit where it is expected is first tried at key frames and a little turned. A foreign frame
//! ends there. Where the next frames do not fit either, the subject has moved unseen: it is searched for about the axis,
//! nearest turns first, a slice a frame, so that no push takes long. What is found is only a candidate: it is not
//! fused, and the next frame must be tracked from it. At most [`PATIENCE`] + [`SLICES`] + 1 frames are left out.

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Rigid, statistics::median};

use crate::{
    Prior,
    fuser::{Fuser, Lost},
    raycast::ray_cast,
    track::{Tracked, approach, register, samples},
    tsdf::Tsdf,
    view::View,
};

/// Lost frames in a row before the subject is searched for.
pub(crate) const PATIENCE: usize = 1;
/// Turns that are searched, degrees apart.
const SEARCH_STEP: f64 = 7.5;
/// Turns tried with a frame.
const SLICE: usize = 12;
/// Frames after which the whole turn has been searched.
pub(crate) const SLICES: usize = 4;
/// Largest residual of a candidate, as a multiple of the usual one: false places fit three times worse.
const CANDIDATE: f64 = 1.5;
/// Frames whose residual says what is usual.
const USUAL: usize = 31;
/// First guesses of the turn between two frames, degrees.
pub(crate) const FIRST_TURNS: [f64; 11] = [0.0, 1.5, -1.5, 3.5, -3.5, 6.0, -6.0, 9.0, -9.0, 13.0, -13.0];

impl Fuser {
    /// Tries the key poses and turned predictions; the original reason where none is trusted.
    pub(crate) fn relocalise(
        &mut self,
        view: &View,
        predicted: &Rigid,
        reason: String,
    ) -> Result<(Rigid, Option<Tracked>), String> {
        let step = (self.kept.len() / 12).max(1);
        let mut guesses: Vec<Rigid> = self.kept.iter().rev().step_by(step).map(|k| k.scan_from_camera).collect();
        if self.settings.prior == Prior::Turntable {
            guesses.extend(turned_guesses(predicted, &FIRST_TURNS));
        }
        let model = &self.model;
        let tracked = self.clock.time("relocalise", || best_of(model, view, &guesses));
        let near = if self.settings.prior == Prior::Turntable { *predicted } else { tracked.scan_from_camera };
        self.trusted(view, &tracked, &near).map_err(|_| reason)?;
        Ok((tracked.scan_from_camera, Some(tracked)))
    }

    /// Searches the next turns about the axis for a candidate.
    pub(crate) fn search(&mut self, time_ns: i64, view: &View, predicted: &Rigid) -> Option<(i64, Rigid)> {
        let axis = self.motion.axis()?;
        let slice = (self.lost.frames - PATIENCE - 1) % SLICES;
        let turn = |k: usize| {
            let size = k.div_ceil(2) as f64 * SEARCH_STEP.to_radians();
            axis.turn(if k % 2 == 1 { size } else { -size }) * predicted
        };
        let guesses: Vec<Rigid> = (slice * SLICE..(slice + 1) * SLICE).map(turn).collect();
        let model = &self.model;
        let found = self.clock.time("search", || best_of(model, view, &guesses));
        let usual = self.usual_residual();
        let fits = found.residual < CANDIDATE * usual;
        (fits && self.trusted(view, &found, &found.scan_from_camera).is_ok())
            .then_some((time_ns, found.scan_from_camera))
    }

    /// Median residual of the last frames, metres.
    fn usual_residual(&self) -> f64 {
        let mut last: Vec<f64> =
            self.kept.iter().rev().take(USUAL).filter_map(|k| k.tracked.map(|t| t.residual)).collect();
        median(&mut last).unwrap_or(f64::INFINITY)
    }
}

impl Lost {
    /// A frame without a trusted pose: why, for people.
    pub(crate) fn count(&mut self, reason: String) -> String {
        self.frames += 1;
        match self.candidate {
            Some(_) => "lost: it fits elsewhere; the next frame must confirm that".into(),
            None => reason,
        }
    }
}

/// The pose that fits best among registrations from several starts.
pub(crate) fn best_of(model: &Tsdf, view: &View, guesses: &[Rigid]) -> Tracked {
    let few = samples(view, 1500);
    let score = |t: &Tracked| t.overlap * t.inliers / (t.residual + 1e-3);
    let rough: Vec<Tracked> = guesses
        .par_iter()
        .map(|g| {
            let seen = ray_cast(model, &view.camera, g, 6);
            register(model, &few, &approach(&seen, g, &few, g))
        })
        .collect();
    let best = rough.iter().max_by(|a, b| score(a).total_cmp(&score(b)));
    let start = best.map_or_else(Rigid::identity, |t| t.scan_from_camera);
    register(model, &samples(view, 6000), &start)
}

/// A pose turned about the first scan frame's axis by several angles (degrees).
pub(crate) fn turned_guesses(pose: &Rigid, degrees: &[f64]) -> Vec<Rigid> {
    degrees.iter().map(|d| Isometry3::rotation(Vector3::y() * d.to_radians()) * pose).collect()
}
