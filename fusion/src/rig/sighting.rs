//! Where a resting camera stands by single frames of it.

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;
use toile_geometry::Rigid;

use super::{member::Prepared, place::Subject};
use crate::{
    field::Tsdf,
    frame::DepthView,
    tracking::{Tracked, best_of, fits, track, trusted},
};

/// Frames that are looked at to find a place.
const LOOKS: usize = 16;
/// Of these, the ones that are searched for all around.
const SEARCHED: usize = 6;
/// Turns that are searched, degrees apart.
const STEP: f64 = 7.5;
/// Smallest overlap of a frame with the model of the sensors before.
const OVERLAP: f64 = 0.3;
/// Single frames agree on a place within this, metres at the subject: what they slip along a smooth surface.
const AGREE: f64 = 0.03;
/// Share of the frames that must agree.
const SHARE: f64 = 0.4;

/// A frame and how the disk stood.
pub(crate) struct Look<'a> {
    pub frame: &'a Prepared,
    pub view: DepthView,
    /// `model_from_room`.
    pub turn: Rigid,
}

impl Look<'_> {
    /// The frame registered from where a camera at this place sees it, if that fits.
    pub(crate) fn register(&self, field: &Tsdf, place: &Rigid) -> Option<Tracked> {
        let predicted = self.turn * place;
        let tracked = track(field, &self.view, &predicted);
        trusted(&self.view, &tracked, field.truncation(), Some(&predicted)).ok().map(|()| tracked)
    }

    fn place(&self, tracked: &Tracked) -> Rigid {
        self.turn.inverse() * tracked.model_from_camera
    }

    /// The best place about the axis of the turn, for a camera that stands at `upright` but for a turn.
    fn search(&self, field: &Tsdf, upright: &Rigid) -> Option<Rigid> {
        let around =
            |k: usize| self.turn * Isometry3::rotation(Vector3::y() * (STEP * k as f64).to_radians()) * upright;
        let starts: Vec<Rigid> = (0..(360.0 / STEP) as usize).map(around).collect();
        let tracked = best_of(field, &self.view, &starts);
        fits(&self.view, &tracked, field.truncation(), OVERLAP).ok().map(|()| self.place(&tracked))
    }
}

/// Every so manieth of the frames, about as many as are looked at.
pub(crate) fn few<T>(all: &[T]) -> impl Iterator<Item = &T> {
    all.iter().step_by(all.len().div_ceil(LOOKS).max(1))
}

/// Where a camera stands, from a place that is believed to be near; `None` where its frames do not agree on one.
pub(crate) fn near(field: &Tsdf, looks: &[Look<'_>], place: &Rigid, subject: &Subject) -> Option<Rigid> {
    let sightings: Vec<Rigid> =
        looks.par_iter().filter_map(|l| l.register(field, place).map(|t| l.place(&t))).collect();
    agreed(&sightings, looks.len(), subject)
}

/// Where a camera stands that may be anywhere about the axis; `upright` is its place but for that turn.
pub(crate) fn anywhere(field: &Tsdf, looks: &[Look<'_>], upright: &Rigid, subject: &Subject) -> Option<Rigid> {
    let some: Vec<&Look> = looks.iter().step_by(looks.len().div_ceil(SEARCHED).max(1)).collect();
    let sightings: Vec<Rigid> = some.iter().filter_map(|l| l.search(field, upright)).collect();
    agreed(&sightings, some.len(), subject)
}

fn agreed(sightings: &[Rigid], looks: usize, subject: &Subject) -> Option<Rigid> {
    let (place, near) = subject.consensus(sightings, AGREE)?;
    let least = (SHARE * looks as f64).max(if looks < 3 { 1.0 } else { 2.0 });
    (near.len() as f64 >= least).then_some(place)
}
