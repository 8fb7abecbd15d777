//! The frames of the model, kept to be compared with and to be fused again.

use toile_capture::{ColorImage, Frame};
use toile_geometry::{Rigid, statistics::median};

use super::tracked::{Located, Tracked};
use crate::{
    field::Tsdf,
    frame::{CutDepth, DepthView},
};

/// An earlier frame that looks from within this angle shows the same surface, radians.
const SAME_VIEW: f64 = 0.5;
/// Frames whose residual says what is usual.
const USUAL: usize = 31;
/// Frames whose colours are used at most.
const MAX_COLORED: usize = 200;

/// A frame of the model.
pub(crate) struct KeptFrame {
    /// Which sensor of the rig saw it.
    pub sensor: usize,
    pub index: u64,
    pub device_time_ns: i64,
    /// Time by the clock that all sensors of the rig are brought to, nanoseconds.
    pub time_ns: i64,
    /// Empty where a live take has forgotten it.
    pub depth: CutDepth,
    /// Half width of the averaging of its normals, pixels.
    pub window: usize,
    pub color: Option<ColorImage>,
    pub model_from_camera: Rigid,
    /// `None` for known poses and the first frame.
    pub tracked: Option<Tracked>,
}

/// The frames of the model: those of the leading sensor, then those of each other one, each in the order of time.
#[derive(Default)]
pub(crate) struct Kept {
    pub frames: Vec<KeptFrame>,
}

/// The reference of a new frame: the model's field and the frames in it.
#[derive(Clone, Copy)]
pub(crate) struct Past<'a> {
    pub field: &'a Tsdf,
    pub kept: &'a Kept,
}

impl KeptFrame {
    /// A frame with its prepared depth and its pose.
    pub(crate) fn new(frame: &Frame, depth: CutDepth, window: usize, located: &Located) -> Self {
        Self {
            sensor: frame.sensor,
            index: frame.index,
            device_time_ns: frame.device_time_ns,
            time_ns: frame.device_time_ns,
            depth,
            window,
            color: frame.color.clone(),
            model_from_camera: located.model_from_camera,
            tracked: located.tracked,
        }
    }

    /// Its surface elements, without colour.
    pub(crate) fn view(&self) -> DepthView {
        self.depth.view(self.window)
    }

    /// True where it has colours of what a camera at this pose sees.
    fn shows(&self, model_from_camera: &Rigid, angle: f64) -> bool {
        self.color.is_some() && self.model_from_camera.rotation.angle_to(&model_from_camera.rotation) < angle
    }
}

impl Kept {
    pub(crate) fn len(&self) -> usize {
        self.frames.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// The frames of the leading sensor.
    pub(crate) fn leading(&self) -> &[KeptFrame] {
        self.groups().next().unwrap_or_default()
    }

    /// The frames of each sensor.
    pub(crate) fn groups(&self) -> impl Iterator<Item = &[KeptFrame]> {
        self.frames.chunk_by(|a, b| a.sensor == b.sensor)
    }

    /// True where any frame has colours.
    pub(crate) fn has_color(&self) -> bool {
        self.frames.iter().any(|k| k.color.is_some())
    }

    /// The frames whose colours a frame at this pose is compared with: the last one, and the first one that looked from
    /// about there: the turn closes on it.
    pub(crate) fn color_anchors(&self, pose: &Rigid) -> Vec<usize> {
        let last = self.len() - 1;
        let mut anchors = vec![last];
        anchors.extend(self.frames.iter().position(|k| k.shows(pose, SAME_VIEW)).filter(|i| *i != last));
        anchors
    }

    /// Forgets what only finishing needs of the frame before the last: its depth, and its colours where those of an
    /// earlier frame do.
    pub(crate) fn forget(&mut self) {
        if let [before @ .., forgotten, _] = &mut self.frames[..] {
            forgotten.depth.values = Vec::new();
            if before.iter().any(|earlier| earlier.shows(&forgotten.model_from_camera, 0.5 * SAME_VIEW)) {
                forgotten.color = None;
            }
        }
    }

    /// Median residual of the last frames, metres; infinite where none was tracked.
    pub(crate) fn usual_residual(&self) -> f64 {
        let last = self.frames.iter().rev().take(USUAL);
        let mut residuals: Vec<f64> = last.filter_map(|k| k.tracked.map(|t| t.residual)).collect();
        median(&mut residuals).unwrap_or(f64::INFINITY)
    }

    /// One in this many frames gives its colours.
    pub(crate) fn colored_step(&self) -> usize {
        self.len().div_ceil(MAX_COLORED).max(1)
    }

    /// At most this many frames (and one more for each further sensor), evenly spaced from each sensor's first on.
    pub(crate) fn key_frames(&self, most: usize) -> Vec<usize> {
        let step = self.len().div_ceil(most).max(1);
        let mut first = 0;
        let mut keys = Vec::new();
        for group in self.groups() {
            keys.extend((first..first + group.len()).step_by(step));
            first += group.len();
        }
        keys
    }
}
