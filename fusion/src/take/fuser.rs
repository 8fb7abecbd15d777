//! The stage as an object: frames in one by one, each tracked against the model so far and fused into it.

use toile_capture::{Frame, Rig, Sensor};
use toile_geometry::{Mesh, Rigid};

use super::{
    model::Model,
    preparer::{MIN_PIXELS, Preparer, usable_sensor},
};
use crate::{
    FusionError, FusionSettings,
    drop_reason::DropReason,
    field::extract_surface,
    frame::{CutDepth, DepthView},
    report::DroppedFrame,
    rig::RigFound,
    subject::SubjectVolume,
    timings::Stopwatch,
    tracking::{Kept, KeptFrame, Past, Tracked, Tracker},
};

/// The outcome of a pushed frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// It is in the model.
    Fused {
        /// Its pose in the model's frame: the camera's at the first frame as the volume has it.
        model_from_camera: Rigid,
        /// How well it fitted; `None` for the first frame and known poses.
        tracked: Option<Tracked>,
    },
    /// It is left out.
    Dropped {
        /// Why.
        reason: DropReason,
    },
}

/// The outcomes of the frames that are not in the model.
#[derive(Debug, Default)]
pub(crate) struct Log {
    /// Frames that were pushed or could not be read.
    pub seen: usize,
    pub dropped: Vec<DroppedFrame>,
    /// Those of the leading sensor.
    pub leading_seen: usize,
    /// Names of sensors whose depth is not fused.
    pub sensors_not_used: Vec<String>,
}

/// The stage as an object that takes frames one by one. It never waits for anything, nor looks ahead: a frame's pose
/// and the model with it are there when [`Fuser::push`] returns.
pub struct Fuser {
    pub(crate) settings: FusionSettings,
    /// The sensors of the rig.
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) volume: Option<SubjectVolume>,
    preparer: Preparer,
    tracker: Tracker,
    pub(crate) model: Model,
    pub(crate) kept: Kept,
    pub(crate) log: Log,
    /// Where the other sensors of the rig stand.
    pub(crate) rig: RigFound,
    /// The subject does not turn: sensors all around see it from where they rest.
    pub(crate) stands_still: bool,
    pub(crate) clock: Stopwatch,
}

impl Fuser {
    /// A fuser for the first sensor of a rig. `volume` as [`crate::survey`] finds it, or `None` for everything.
    ///
    /// # Errors
    /// Settings out of range, or a calibration that cannot be used.
    pub fn new(rig: &Rig, volume: Option<SubjectVolume>, settings: FusionSettings) -> Result<Self, FusionError> {
        Self::led_by(rig, 0, volume, settings)
    }

    /// The same for another sensor.
    ///
    /// # Errors
    /// Those of [`Fuser::new`].
    pub(crate) fn led_by(
        rig: &Rig,
        leader: usize,
        volume: Option<SubjectVolume>,
        settings: FusionSettings,
    ) -> Result<Self, FusionError> {
        let sensor = usable_sensor(rig, leader)?;
        settings.check()?;
        let first = volume.as_ref().map_or_else(Rigid::identity, |v| v.model_from_camera);
        Ok(Self {
            preparer: Preparer::new(sensor, &settings, volume.clone()),
            tracker: Tracker::new(&settings, sensor, first),
            model: Model::new(&settings),
            kept: Kept::default(),
            log: Log::default(),
            clock: Stopwatch::new(),
            settings,
            sensors: rig.sensors.clone(),
            rig: RigFound::default(),
            stands_still: false,
            volume,
        })
    }

    /// Tracks one frame and, where its pose can be trusted, fuses it.
    ///
    /// # Errors
    /// [`FusionError::TooLarge`] where the model outgrows its index.
    pub fn push(&mut self, frame: &Frame) -> Result<Outcome, FusionError> {
        self.log.seen += 1;
        let prepared = self.prepare(frame);
        let past = Past { field: &self.model.field, kept: &self.kept };
        let located = prepared.and_then(|(depth, view)| {
            let located = self.tracker.locate(frame, &view, past, &mut self.clock)?;
            Ok((depth, view, located))
        });
        let (depth, view, located) = match located {
            Ok(located) => located,
            Err(reason) => return Ok(self.drop_frame(frame, reason)),
        };
        self.model.integrate(&view, &located.model_from_camera, &mut self.clock)?;
        self.tracker.follow(frame, located.model_from_camera);
        self.kept.frames.push(KeptFrame::new(frame, depth, self.model.window, &located));
        Ok(Outcome::Fused { model_from_camera: located.model_from_camera, tracked: located.tracked })
    }

    /// Expects few frames from now on, in wide and uneven steps of a turntable.
    pub(crate) fn expect_few_views(&mut self) {
        self.tracker.expect_few_views();
    }

    /// Tries dropped frames again, now that the model shows more, until no further one can be placed; then all frames are
    /// in the order of time.
    ///
    /// # Errors
    /// [`FusionError::TooLarge`] where the model outgrows its index.
    pub(crate) fn retry(&mut self, mut dropped: Vec<Frame>) -> Result<(), FusionError> {
        let mut placed = true;
        while std::mem::take(&mut placed) {
            // The turn closes on its first frame: the last ones lie next to what is there.
            for frame in std::mem::take(&mut dropped).into_iter().rev() {
                let log = (self.log.seen, self.log.dropped.len());
                let is_fused = matches!(self.push(&frame)?, Outcome::Fused { .. });
                self.log.seen = log.0;
                self.log.dropped.truncate(log.1);
                if is_fused {
                    self.log.dropped.retain(|d| d.index != frame.index);
                    placed = true;
                } else {
                    dropped.insert(0, frame);
                }
            }
        }
        self.kept.frames.sort_by_key(|k| (k.device_time_ns, k.index));
        Ok(())
    }

    /// True where the frames' poses are found and refined one by one: neither known nor those of resting sensors.
    pub(crate) fn finds_poses(&self) -> bool {
        self.settings.poses.is_none() && !self.stands_still
    }

    /// Frames in a row without a trusted pose; 0 while the subject is followed.
    pub fn lost_frames(&self) -> usize {
        self.tracker.lost_frames()
    }

    /// The model so far, in the frame of the first poses; for a preview.
    pub fn preview(&self) -> Mesh {
        extract_surface(&self.model.field, 1)
    }

    /// The subject's depth in a frame and its surface elements.
    fn prepare(&mut self, frame: &Frame) -> Result<(CutDepth, DepthView), DropReason> {
        let depth = self.preparer.prepare(frame, &mut self.clock)?;
        let is_first = self.kept.is_empty();
        if is_first {
            self.model.adapt(&depth);
        }
        let window = self.model.window;
        let view = self.clock.time("normals", || depth.view(window));
        if is_first && view.count() < MIN_PIXELS {
            return Err(DropReason::TooLittleSurface);
        }
        Ok((depth, view))
    }

    fn drop_frame(&mut self, frame: &Frame, reason: DropReason) -> Outcome {
        tracing::debug!(frame = frame.index, %reason, "frame dropped");
        let dropped = DroppedFrame { index: frame.index, device_time_ns: frame.device_time_ns, reason: reason.clone() };
        self.log.dropped.push(dropped);
        Outcome::Dropped { reason }
    }
}
