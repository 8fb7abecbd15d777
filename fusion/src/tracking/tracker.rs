//! Where a frame is: known, the first, tracked from where it is expected, or found again.

use toile_capture::{Frame, Sensor};
use toile_geometry::Rigid;

use super::{
    approach::track,
    axis::Axis,
    kept::Past,
    motion::{MotionModel, TimedPose},
    open_directions::DEGENERATE,
    pictures::Pictures,
    relocalise::{PATIENCE, search_about, try_known_places},
    starts::{FIRST_TURNS, best_of, turned},
    tracked::{Located, Tracked},
    trust::trusted,
    views::place_view,
};
use crate::{
    drop_reason::DropReason,
    frame::DepthView,
    settings::{FusionSettings, KNOWN_POSE_WITHIN_NS, KnownPose, Prior},
    timings::Stopwatch,
};

/// Largest residual of a candidate, as a multiple of the usual one: false places fit three times worse.
const CANDIDATE: f64 = 1.5;
/// A prediction is only believed when the model holds more frames than this.
const SETTLED: usize = 4;

/// The state since the subject was last where it was expected.
#[derive(Debug, Clone, Default)]
struct Lost {
    /// Frames in a row without a trusted pose.
    frames: usize,
    /// The last frame, found elsewhere and not yet confirmed.
    candidate: Option<TimedPose>,
}

/// Finds the pose of one frame after the other.
pub(crate) struct Tracker {
    prior: Prior,
    known: Option<Vec<KnownPose>>,
    /// Pose of the first frame.
    first: Rigid,
    motion: MotionModel,
    lost: Lost,
    pictures: Pictures,
    /// The take is a set of a few views on a turntable, in steps of any width.
    has_few_views: bool,
}

impl Tracker {
    /// A tracker that gives the first frame this pose.
    pub(crate) fn new(settings: &FusionSettings, sensor: &Sensor, first: Rigid) -> Self {
        Self {
            prior: settings.prior,
            known: settings.poses.clone(),
            first,
            motion: MotionModel::new(settings.prior),
            lost: Lost::default(),
            pictures: Pictures::new(sensor),
            has_few_views: false,
        }
    }

    /// Expects wide and uneven steps from now on, where there is a turntable.
    pub(crate) fn expect_few_views(&mut self) {
        self.has_few_views = self.prior == Prior::Turntable;
    }

    /// Frames in a row without a trusted pose.
    pub(crate) fn lost_frames(&self) -> usize {
        self.lost.frames
    }

    /// Remembers the pose of a frame that is in the model now.
    pub(crate) fn follow(&mut self, frame: &Frame, model_from_camera: Rigid) {
        self.motion.push(TimedPose { time_ns: frame.device_time_ns, model_from_camera });
    }

    /// The pose of a frame.
    ///
    /// # Errors
    /// Why it has none that can be trusted.
    pub(crate) fn locate(
        &mut self,
        frame: &Frame,
        view: &DepthView,
        past: Past<'_>,
        clock: &mut Stopwatch,
    ) -> Result<Located, DropReason> {
        if let Some(known) = &self.known {
            return nearest_known(known, frame.device_time_ns);
        }
        if past.kept.is_empty() {
            return Ok(Located { model_from_camera: self.first, tracked: None });
        }
        let candidate = self.lost.candidate.take();
        let predicted = match &candidate {
            Some(at) => self.motion.predict_from(at, frame.device_time_ns),
            None => self.motion.predict(frame.device_time_ns),
        };
        // Before the rate is known a turntable may have turned either way.
        let is_first_turn = !self.motion.knows_rate() && self.prior == Prior::Turntable;
        let starts = if is_first_turn { turned(&predicted, &FIRST_TURNS) } else { vec![predicted] };
        let by_shape = if is_first_turn {
            clock.time("first turn", || best_of(past.field, view, &starts))
        } else {
            clock.time("track", || track(past.field, view, &predicted))
        };
        let tracked = self.decide_open_direction(by_shape, frame, view, past, &starts, clock);
        match trusted(view, &tracked, past.field.truncation(), self.expected(past, &predicted)) {
            Ok(()) => {
                candidate.into_iter().for_each(|confirmed| self.motion.push(confirmed));
                Ok(self.found(tracked))
            }
            Err(reason) => self.find_again(reason, frame, view, past, &predicted, clock),
        }
    }

    /// Lets colours decide where the shape leaves a direction open.
    fn decide_open_direction(
        &mut self,
        by_shape: Tracked,
        frame: &Frame,
        view: &DepthView,
        past: Past<'_>,
        starts: &[Rigid],
        clock: &mut Stopwatch,
    ) -> Tracked {
        if by_shape.conditioning >= DEGENERATE {
            return by_shape;
        }
        let Some(picture) = self.pictures.picture_of(frame) else { return by_shape };
        let compared = self.pictures.compare(picture, past, &starts[0]);
        clock.time("track by colour", || compared.track(view, starts)).unwrap_or(by_shape)
    }

    /// Tries places where the subject may be that was not where it was expected, and counts how long it has been lost.
    fn find_again(
        &mut self,
        reason: DropReason,
        frame: &Frame,
        view: &DepthView,
        past: Past<'_>,
        predicted: &Rigid,
        clock: &mut Stopwatch,
    ) -> Result<Located, DropReason> {
        if self.has_few_views
            && let Some(other) = past.kept.frames.last()
        {
            let tracked = clock.time("search", || place_view(past, view, &other.model_from_camera))?;
            return Ok(self.found(tracked));
        }
        if let Some(tracked) = self.stopped_or_back(frame, view, past, clock) {
            return Ok(self.found(tracked));
        }
        let axis = self.motion.axis();
        // Without an axis there is nothing to search about.
        if self.lost.frames <= PATIENCE || axis.is_none() {
            let tracked = clock.time("relocalise", || try_known_places(past, view, predicted, self.prior));
            if trusted(view, &tracked, past.field.truncation(), self.expected(past, predicted)).is_ok() {
                return Ok(self.found(tracked));
            }
        }
        if self.lost.frames > PATIENCE
            && let Some(axis) = axis
        {
            self.lost.candidate = self.search(&axis, frame.device_time_ns, view, past, clock);
        }
        self.lost.frames += 1;
        Err(if self.lost.candidate.is_some() { DropReason::Unconfirmed } else { reason })
    }

    /// The pose of a frame whose disk has stopped or turned back since the last one, where it can be trusted.
    fn stopped_or_back(
        &self,
        frame: &Frame,
        view: &DepthView,
        past: Past<'_>,
        clock: &mut Stopwatch,
    ) -> Option<Tracked> {
        if self.lost.frames > 0 {
            return None;
        }
        self.motion.stopped_or_back(frame.device_time_ns).into_iter().find_map(|start| {
            let tracked = clock.time("turned back", || track(past.field, view, &start));
            let usual = tracked.residual < CANDIDATE * past.kept.usual_residual();
            (usual && trusted(view, &tracked, past.field.truncation(), Some(&start)).is_ok()).then_some(tracked)
        })
    }

    /// Searches the next turns about the axis for a candidate.
    fn search(
        &self,
        axis: &Axis,
        time_ns: i64,
        view: &DepthView,
        past: Past<'_>,
        clock: &mut Stopwatch,
    ) -> Option<TimedPose> {
        let predicted = self.motion.predict(time_ns);
        let lost = self.lost.frames;
        let found = clock.time("search", || search_about(axis, past.field, view, &predicted, lost));
        let fits = found.residual < CANDIDATE * past.kept.usual_residual()
            && trusted(view, &found, past.field.truncation(), None).is_ok();
        fits.then_some(TimedPose { time_ns, model_from_camera: found.model_from_camera })
    }

    /// Where a turntable must have brought the frame, once the model has settled.
    fn expected<'a>(&self, past: Past<'_>, predicted: &'a Rigid) -> Option<&'a Rigid> {
        (self.prior == Prior::Turntable && past.kept.len() > SETTLED).then_some(predicted)
    }

    fn found(&mut self, tracked: Tracked) -> Located {
        self.lost.frames = 0;
        Located { model_from_camera: tracked.model_from_camera, tracked: Some(tracked) }
    }
}

/// The known pose of the nearest time.
fn nearest_known(known: &[KnownPose], time_ns: i64) -> Result<Located, DropReason> {
    let off = |k: &&KnownPose| (k.device_time_ns - time_ns).abs();
    let nearest = known.iter().min_by_key(off).filter(|k| off(k) <= KNOWN_POSE_WITHIN_NS);
    // The scan comes out in the frame of the known poses: the model's.
    nearest.map(|k| Located { model_from_camera: k.scan_from_camera, tracked: None }).ok_or(DropReason::NoKnownPose)
}
