//! Where a resting camera stands by single frames of it.

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;
use toile_geometry::Rigid;

use super::place::Subject;
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
/// Turns of a camera that was pushed, degrees apart, two to each side.
const PUSHED: f64 = 2.0;
/// Smallest overlap of a frame with the model of the sensors before.
const OVERLAP: f64 = 0.3;
/// Single frames agree on a place within this, metres at the subject: what they slip along a smooth surface.
const AGREE: f64 = 0.03;
/// Share of the frames that must agree.
const SHARE: f64 = 0.4;

/// A frame and how the disk stood.
pub(crate) struct Look {
    pub view: DepthView,
    /// `model_from_room`.
    pub turn: Rigid,
}

impl Look {
    /// The frame registered from where a camera at this place sees it, if that fits.
    pub(crate) fn register(&self, field: &Tsdf, place: &Rigid) -> Option<Tracked> {
        let predicted = self.turn * place;
        let tracked = track(field, &self.view, &predicted);
        trusted(&self.view, &tracked, field.truncation(), Some(&predicted)).ok().map(|()| tracked)
    }

    fn place(&self, tracked: &Tracked) -> Rigid {
        self.turn.inverse() * tracked.model_from_camera
    }

    /// The best place of several.
    fn search(&self, field: &Tsdf, places: &[Rigid]) -> Option<Rigid> {
        let starts: Vec<Rigid> = places.iter().map(|place| self.turn * place).collect();
        let tracked = best_of(field, &self.view, &starts);
        fits(&self.view, &tracked, field.truncation(), OVERLAP).ok().map(|()| self.place(&tracked))
    }
}

/// Every so manieth of the frames, about as many as are looked at.
pub(crate) fn few<T>(all: &[T]) -> impl Iterator<Item = &T> {
    all.iter().step_by(all.len().div_ceil(LOOKS).max(1))
}

/// A place that frames agree on, and which ones do.
pub(crate) type Agreed = (Rigid, Vec<usize>);

/// Where a camera stands, from a place that is believed to be near; `None` where its frames do not agree on one.
pub(crate) fn near(field: &Tsdf, looks: &[Look], place: &Rigid, subject: &Subject) -> Option<Agreed> {
    let sight = |l: &Look| l.register(field, place).map(|t| l.place(&t));
    agreed(&looks.par_iter().map(sight).collect::<Vec<_>>(), subject)
}

/// Where a camera stands that may be anywhere about the axis; `upright` is its place but for that turn.
pub(crate) fn anywhere(field: &Tsdf, looks: &[Look], upright: &Rigid, subject: &Subject) -> Option<Agreed> {
    let around = |k: usize| Isometry3::rotation(Vector3::y() * (STEP * k as f64).to_radians()) * upright;
    search(field, looks, &(0..(360.0 / STEP) as usize).map(around).collect::<Vec<_>>(), subject)
}

/// Where a camera stands that was pushed from a place, and may look some degrees past it.
pub(crate) fn pushed(field: &Tsdf, looks: &[Look], place: &Rigid, subject: &Subject) -> Option<Agreed> {
    let turned = |k: usize| {
        let [yaw, pitch] = [k % 5, k / 5].map(|n| (PUSHED * (n as f64 - 2.0)).to_radians());
        place * Isometry3::rotation(Vector3::new(pitch, yaw, 0.0))
    };
    search(field, looks, &(0..25).map(turned).collect::<Vec<_>>(), subject)
}

fn search(field: &Tsdf, looks: &[Look], places: &[Rigid], subject: &Subject) -> Option<Agreed> {
    let step = looks.len().div_ceil(SEARCHED).max(1);
    let some = looks.iter().step_by(step).map(|l| l.search(field, places));
    let (place, near) = agreed(&some.collect::<Vec<_>>(), subject)?;
    Some((place, near.into_iter().map(|i| i * step).collect()))
}

fn agreed(sightings: &[Option<Rigid>], subject: &Subject) -> Option<Agreed> {
    let (seen, places): (Vec<usize>, Vec<Rigid>) =
        sightings.iter().enumerate().filter_map(|(i, s)| s.map(|s| (i, s))).unzip();
    let (place, near) = subject.consensus(&places, AGREE)?;
    let least = (SHARE * sightings.len() as f64).max(if sightings.len() < 3 { 1.0 } else { 2.0 });
    (near.len() as f64 >= least).then(|| (place, near.into_iter().map(|i| seen[i]).collect()))
}
