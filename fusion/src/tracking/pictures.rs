//! The grey pictures of the frames that colours are compared with, decoded once.

use std::sync::Arc;

use toile_capture::Sensor;
use toile_geometry::Rigid;

use super::{
    color::{EarlierFrame, TrackedByColor, register_with_color},
    grey::Picture,
    kept::{Kept, Past},
    samples::samples,
    tracked::Tracked,
};
use crate::frame::{DepthView, decode_color};

/// Points that are compared by colour.
const POINTS: usize = 2500;

/// Pictures by the number of their frame in the model.
pub(crate) struct Pictures {
    sensor: Sensor,
    decoded: Vec<(usize, Arc<Picture>)>,
}

/// A new frame's picture, and those of earlier frames that it is compared with.
pub(crate) struct Compared<'a> {
    picture: Arc<Picture>,
    earlier: Vec<(Rigid, Arc<Picture>)>,
    past: Past<'a>,
}

impl Pictures {
    pub(crate) fn new(sensor: &Sensor) -> Self {
        Self { sensor: sensor.clone(), decoded: Vec::new() }
    }

    /// Takes the picture of the frame that would be the next in the model, and those of the frames that it is compared with
    /// where it is expected at `pose`.
    pub(crate) fn compare<'a>(&mut self, picture: Picture, past: Past<'a>, pose: &Rigid) -> Compared<'a> {
        let index = past.kept.len();
        // That of a frame that was dropped.
        self.decoded.retain(|p| p.0 < index);
        let anchors = past.kept.color_anchors(pose);
        for &i in &anchors {
            self.decode(i, past.kept);
        }
        self.decoded.retain(|p| anchors.contains(&p.0));
        let of = |i: &usize| {
            let (_, picture) = self.decoded.iter().find(|p| p.0 == *i)?;
            Some((past.kept.frames[*i].model_from_camera, picture.clone()))
        };
        let earlier = anchors.iter().filter_map(of).collect();
        let picture = Arc::new(picture);
        self.decoded.push((index, picture.clone()));
        Compared { picture, earlier, past }
    }

    /// Decodes the colours of a kept frame, if that was not done.
    fn decode(&mut self, index: usize, kept: &Kept) {
        let frame = &kept.frames[index];
        if self.decoded.iter().any(|p| p.0 == index) {
            return;
        }
        if let Some(image) = decode_color(frame.color.as_ref(), frame.index) {
            self.decoded.push((index, Arc::new(Picture::new(&image, &self.sensor))));
        }
    }

    /// The grey picture of a new frame; `None` where it has no colours that can be read.
    pub(crate) fn picture_of(&self, frame: &toile_capture::Frame) -> Option<Picture> {
        let image = decode_color(frame.color.as_ref(), frame.index)?;
        Some(Picture::new(&image, &self.sensor))
    }
}

impl Compared<'_> {
    /// The pose at which shape and colours agree best, of several starts; `None` where nothing can be compared.
    pub(crate) fn track(&self, view: &DepthView, starts: &[Rigid]) -> Option<Tracked> {
        let points = samples(view, POINTS);
        let earlier: Vec<EarlierFrame> =
            self.earlier.iter().map(|(pose, picture)| EarlierFrame { picture, model_from_camera: *pose }).collect();
        let held = |start| register_with_color(self.past.field, &points, &self.picture, &earlier, start);
        let best = starts.iter().filter_map(held);
        let best = best.min_by(|a: &TrackedByColor, b: &TrackedByColor| a.spread.total_cmp(&b.spread));
        best.map(|b| b.tracked)
    }
}
