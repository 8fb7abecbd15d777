//! The stage as an object: frames in one by one, each tracked against the model so far and fused into it.

use std::sync::Arc;

use nalgebra::Point3;
use toile_capture::{ColorImage, Frame, Rig, Sensor};
use toile_geometry::{Mesh, Rigid};

use crate::{
    FusionError, FusionSettings, Prior,
    depth_filter::drop_edges,
    integrate::integrate,
    motion::MotionModel,
    noise::depth_noise,
    normals::window_for,
    photometric::{Held, Picture, Seen, hold},
    relocalise::{FIRST_TURNS, PATIENCE, best_of, turned_guesses},
    report::{DroppedFrame, Stopwatch},
    surface::extract_surface,
    track::{DEGENERATE, Tracked, samples, track},
    tsdf::Tsdf,
    view::{CutDepth, Rectifier, View, decode_color, is_measured},
    volume::SubjectVolume,
};

/// Most pixels of a depth image: their numbers, with the border that a view adds, must be exact as floats.
const MOST_PIXELS: u64 = 16_000_000;
/// Least measured pixels of a frame that is used.
const LEAST_PIXELS: usize = 500;
/// Least overlap, inliers and largest residual (share of the truncation) of a trusted pose.
const TRUST: (f64, f64, f64) = (0.4, 0.5, 0.4);
/// A trusted pose departs at most so far from a turntable's prediction: metres at the axis, radians.
const DEPARTURE: (f64, f64) = (0.06, 0.12);
/// Points that are compared by colour.
const COLOR_POINTS: usize = 2500;
/// An earlier frame that looks from within this angle shows the same surface, radians.
pub(crate) const ANCHOR_ANGLE: f64 = 0.5;
/// A residual of so many standard deviations of the frame's own noise is trusted too: far rooms are noisy.
const NOISE_RESIDUAL: f64 = 2.5;
/// The band is at least this many standard deviations of the noise.
const NOISE_BAND: f64 = 4.5;

/// Why a frame is dropped that none of the known poses belongs to.
pub(crate) const NO_KNOWN_POSE: &str = "no known pose within 5 ms of it";

/// What became of a pushed frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// It is in the model.
    Fused {
        /// Its pose.
        scan_from_camera: Rigid,
        /// How well it fitted; `None` for the first frame and known poses.
        tracked: Option<Tracked>,
    },
    /// It is left out.
    Dropped {
        /// Why.
        reason: String,
    },
}

/// A frame of the model, kept to be fused again.
pub(crate) struct Kept {
    pub index: u64,
    pub device_time_ns: i64,
    pub depth: CutDepth,
    pub color: Option<ColorImage>,
    pub scan_from_camera: Rigid,
    pub tracked: Option<Tracked>,
}

/// What is known since the subject was last where it was expected.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lost {
    /// Frames in a row without a trusted pose.
    pub frames: usize,
    /// Time and pose of the last frame, found elsewhere and not yet confirmed.
    pub candidate: Option<(i64, Rigid)>,
}

/// The stage as an object that takes frames one by one. It never waits for anything, nor looks ahead: a frame's pose
/// and the model with it are there when [`Fuser::push`] returns.
pub struct Fuser {
    pub(crate) settings: FusionSettings,
    pub(crate) sensor: Sensor,
    rectifier: Rectifier,
    pub(crate) volume: Option<SubjectVolume>,
    pub(crate) model: Tsdf,
    pub(crate) noise: f64,
    pub(crate) window: usize,
    pub(crate) motion: MotionModel,
    pub(crate) kept: Vec<Kept>,
    pub(crate) lost: Lost,
    pictures: Vec<(usize, Arc<Picture>)>,
    pub(crate) dropped: Vec<DroppedFrame>,
    /// Names of sensors whose depth is not fused.
    pub(crate) other_sensors: Vec<String>,
    pub(crate) seen: usize,
    pub(crate) touched: usize,
    pub(crate) updated: usize,
    pub(crate) clock: Stopwatch,
}

impl Fuser {
    /// A fuser for the first sensor of a rig. `volume` as [`crate::survey`] finds it, or `None` for everything.
    ///
    /// # Errors
    /// Settings out of range, or a calibration that cannot be used.
    pub fn new(rig: &Rig, volume: Option<SubjectVolume>, settings: FusionSettings) -> Result<Self, FusionError> {
        let sensor = first_sensor(rig)?.clone();
        if !(settings.voxel_size > 1e-4 && settings.voxel_size < 0.2) {
            return Err(FusionError::Settings("voxel_size must be between 0.1 mm and 0.2 m".into()));
        }
        if !(settings.truncation >= 2.0 * settings.voxel_size && settings.truncation < 1.0) {
            return Err(FusionError::Settings("truncation must be at least two voxels".into()));
        }
        Ok(Self {
            model: Tsdf::new(settings.voxel_size, settings.truncation, false),
            noise: 0.0,
            window: 2,
            motion: MotionModel::new(settings.prior),
            rectifier: Rectifier::new(&sensor, settings.max_depth),
            settings,
            sensor,
            volume,
            kept: Vec::new(),
            lost: Lost::default(),
            pictures: Vec::new(),
            dropped: Vec::new(),
            other_sensors: Vec::new(),
            seen: 0,
            touched: 0,
            updated: 0,
            clock: Stopwatch::new(),
        })
    }

    /// Tracks one frame and, where its pose can be trusted, fuses it.
    ///
    /// # Errors
    /// [`FusionError::TooLarge`] where the model outgrows its index.
    pub fn push(&mut self, frame: &Frame) -> Result<Outcome, FusionError> {
        self.seen += 1;
        let prepared = match self.prepare(frame) {
            Ok(depth) => depth,
            Err(reason) => return Ok(self.drop_frame(frame, reason)),
        };
        if self.kept.is_empty() {
            self.adapt(&prepared);
        }
        let window = self.window;
        let view = self.clock.time("normals", || prepared.view(window));
        if self.kept.is_empty() && view.count() < LEAST_PIXELS {
            return Ok(self.drop_frame(frame, "too little surface to begin with".into()));
        }
        let found = match self.locate(frame, &view) {
            Ok(found) => found,
            Err(reason) => return Ok(self.drop_frame(frame, reason)),
        };
        let (scan_from_camera, tracked) = found;
        let model = &mut self.model;
        let touched = self.clock.time("integrate", || integrate(model, &view, &scan_from_camera))?;
        self.touched += touched.voxels;
        self.updated += touched.updated;
        self.motion.push(frame.device_time_ns, scan_from_camera);
        self.kept.push(Kept {
            index: frame.index,
            device_time_ns: frame.device_time_ns,
            depth: prepared,
            color: frame.color.clone(),
            scan_from_camera,
            tracked,
        });
        Ok(Outcome::Fused { scan_from_camera, tracked })
    }

    /// Frames in a row without a trusted pose; 0 while the subject is followed.
    pub fn lost_frames(&self) -> usize {
        self.lost.frames
    }

    /// The model so far, in the frame of the first poses; for a preview.
    pub fn preview(&self) -> Mesh {
        extract_surface(&self.model, 1)
    }

    /// Takes the depth noise from the first frame: noisy depth needs wider normals and a wider band.
    fn adapt(&mut self, first: &CutDepth) {
        let depth = first.meters();
        self.noise = depth_noise(&first.camera, &depth).unwrap_or(0.0);
        let (sum, count) =
            depth.iter().filter(|d| is_measured(**d)).fold((0.0, 0), |(s, n), d| (s + f64::from(*d), n + 1));
        self.window = window_for(&first.camera, self.noise, sum / f64::from(count.max(1)));
        self.model = self.empty_field(false);
    }

    pub(crate) fn empty_field(&self, with_color: bool) -> Tsdf {
        let truncation = self.settings.truncation.max(NOISE_BAND * self.noise).min(3.0 * self.settings.truncation);
        Tsdf::new(self.settings.voxel_size, truncation, with_color)
    }

    fn drop_frame(&mut self, frame: &Frame, reason: String) -> Outcome {
        tracing::debug!(frame = frame.index, reason, "frame dropped");
        self.dropped.push(DroppedFrame {
            index: frame.index,
            device_time_ns: frame.device_time_ns,
            reason: reason.clone(),
        });
        Outcome::Dropped { reason }
    }

    fn prepare(&mut self, frame: &Frame) -> Result<CutDepth, String> {
        let (rectifier, settings) = (&self.rectifier, &self.settings);
        let camera = &rectifier.camera;
        let depth = self
            .clock
            .time("filter", || filtered(frame, rectifier, settings))
            .ok_or("no depth image of the sensor's size")?;
        let (volume, scale) = (&self.volume, self.sensor.depth_scale as f32);
        let cut = self.clock.time("cut", || match volume {
            Some(volume) => CutDepth::new(camera, &volume.cut(camera, &depth), scale),
            None => CutDepth::new(camera, &depth, scale),
        });
        if cut.count() < LEAST_PIXELS {
            return Err(format!("only {} pixels of the subject are seen", cut.count()));
        }
        Ok(cut)
    }

    /// The pose of a frame, or why there is none.
    fn locate(&mut self, frame: &Frame, view: &View) -> Result<(Rigid, Option<Tracked>), String> {
        if let Some(known) = &self.settings.poses {
            let nearest = known.iter().min_by_key(|k| (k.device_time_ns - frame.device_time_ns).abs());
            return nearest
                .filter(|k| (k.device_time_ns - frame.device_time_ns).abs() <= 5_000_000)
                .map(|k| (k.scan_from_camera, None))
                .ok_or_else(|| NO_KNOWN_POSE.into());
        }
        if self.kept.is_empty() {
            return Ok((self.volume.as_ref().map_or_else(Rigid::identity, |v| v.scan_from_camera), None));
        }
        let candidate = self.lost.candidate.take();
        let predicted = match &candidate {
            Some((then, pose)) => self.motion.predict_from(*then, pose, frame.device_time_ns),
            None => self.motion.predict(frame.device_time_ns),
        };
        let tracked = self.track_from(frame, view, &predicted);
        let Err(reason) = self.trusted(view, &tracked, &predicted) else {
            if let Some((then, pose)) = candidate {
                self.motion.push(then, pose);
            }
            self.lost.frames = 0;
            return Ok((tracked.scan_from_camera, Some(tracked)));
        };
        // Without an axis there is nothing to search about.
        if (self.lost.frames <= PATIENCE || self.motion.axis().is_none())
            && let Ok(found) = self.relocalise(view, &predicted, String::new())
        {
            self.lost.frames = 0;
            return Ok(found);
        }
        if self.lost.frames > PATIENCE {
            self.lost.candidate = self.search(frame.device_time_ns, view, &self.motion.predict(frame.device_time_ns));
        }
        Err(self.lost.count(reason))
    }

    /// Registers a frame to the model from where it is expected, with colours where the shape leaves a direction open.
    fn track_from(&mut self, frame: &Frame, view: &View, predicted: &Rigid) -> Tracked {
        let model = &self.model;
        let turns = !self.motion.knows_rate() && self.settings.prior == Prior::Turntable;
        let guesses = if turns { turned_guesses(predicted, &FIRST_TURNS) } else { vec![*predicted] };
        let tracked = if turns {
            self.clock.time("first turn", || best_of(model, view, &guesses))
        } else {
            self.clock.time("track", || track(model, view, predicted))
        };
        if tracked.conditioning >= DEGENERATE || frame.color.is_none() {
            return tracked;
        }
        self.track_by_color(frame, view, &guesses).unwrap_or(tracked)
    }

    /// The pose at which shape and colours agree best, of several starts; `None` where there are no colours.
    fn track_by_color(&mut self, frame: &Frame, view: &View, guesses: &[Rigid]) -> Option<Tracked> {
        let index = self.kept.len();
        let picture = Arc::new(Picture::new(&*decode_color(frame.color.as_ref(), frame.index)?, &self.sensor));
        // Of a frame that was dropped.
        self.pictures.retain(|p| p.0 < index);
        let near = self.color_anchors(&guesses[0]);
        for &i in &near {
            self.remember(i);
        }
        self.pictures.push((index, picture.clone()));
        let pictures: Vec<Seen> = near
            .iter()
            .filter_map(|i| {
                let (_, picture) = self.pictures.iter().find(|p| p.0 == *i)?;
                Some(Seen { picture, scan_from_camera: self.kept[*i].scan_from_camera })
            })
            .collect();
        let (model, points) = (&self.model, samples(view, COLOR_POINTS));
        let best = self.clock.time("track by colour", || {
            let held = guesses.iter().filter_map(|g| hold(model, &points, &picture, &pictures, g));
            held.min_by(|a: &Held, b: &Held| a.spread.total_cmp(&b.spread))
        });
        let last = near.iter().copied().chain([index]).collect::<Vec<_>>();
        self.pictures.retain(|p| last.contains(&p.0));
        best.map(|held| held.tracked)
    }

    /// The last frame, and the first one that looked from about where a pose looks from: the turn closes on it.
    fn color_anchors(&self, pose: &Rigid) -> Vec<usize> {
        let last = self.kept.len() - 1;
        let near = |k: &Kept| k.color.is_some() && k.scan_from_camera.rotation.angle_to(&pose.rotation) < ANCHOR_ANGLE;
        let mut anchors = vec![last];
        anchors.extend(self.kept.iter().position(near).filter(|i| *i != last));
        anchors
    }

    /// Decodes the colours of a kept frame, if that was not done.
    fn remember(&mut self, index: usize) {
        let kept = &self.kept[index];
        if self.pictures.iter().any(|p| p.0 == index) {
            return;
        }
        if let Some(image) = decode_color(kept.color.as_ref(), kept.index) {
            self.pictures.push((index, Arc::new(Picture::new(&image, &self.sensor))));
        }
    }

    pub(crate) fn trusted(&self, view: &View, tracked: &Tracked, predicted: &Rigid) -> Result<(), String> {
        let (overlap, inliers, residual) = TRUST;
        let mut limit = residual * f64::from(self.model.truncation());
        if tracked.residual > limit {
            let depth: Vec<f32> = view.elements[..view.pixels()].iter().map(|e| e.depth()).collect();
            limit = limit.max(NOISE_RESIDUAL * depth_noise(&view.camera, &depth).unwrap_or(0.0));
        }
        if tracked.overlap < overlap {
            return Err(format!("lost: {:.0} % of its points lie on the model", tracked.overlap * 100.0));
        }
        if tracked.inliers < inliers || tracked.residual > limit {
            return Err(format!(
                "lost: {:.0} % of its points agree, {:.1} mm residual",
                tracked.inliers * 100.0,
                tracked.residual * 1e3
            ));
        }
        if self.settings.prior == Prior::Turntable && self.kept.len() > 4 {
            let departure = tracked.scan_from_camera * predicted.inverse();
            let (shift, angle) = ((departure * Point3::origin()).coords.norm(), departure.rotation.angle());
            if shift > DEPARTURE.0 || angle > DEPARTURE.1 {
                return Err(format!(
                    "its pose departs {:.0} mm and {:.1}° from the turn so far",
                    shift * 1e3,
                    angle.to_degrees()
                ));
            }
        }
        Ok(())
    }
}

pub(crate) fn first_sensor(rig: &Rig) -> Result<&Sensor, FusionError> {
    let wrong = |reason: &str| FusionError::Calibration { sensor: 0, reason: reason.into() };
    let sensor = rig.sensors.first().ok_or_else(|| wrong("the source names no sensor"))?;
    if !sensor.depth.is_valid() || sensor.depth_scale.is_nan() || sensor.depth_scale <= 0.0 {
        return Err(wrong("image size, focal length or depth scale is not positive"));
    }
    if u64::from(sensor.depth.width) * u64::from(sensor.depth.height) > MOST_PIXELS {
        return Err(wrong("its depth image has more than 16 million pixels; record at a smaller size"));
    }
    Ok(sensor)
}

/// Rectified depth in metres without edges; `None` without depth or with a foreign size.
pub(crate) fn filtered(frame: &Frame, rectifier: &Rectifier, settings: &FusionSettings) -> Option<Vec<f32>> {
    let camera = &rectifier.camera;
    let image = frame.depth.as_ref().filter(|i| (i.width, i.height) == (camera.width, camera.height))?;
    Some(drop_edges(&rectifier.camera, &rectifier.rectify(image), settings.jump_slope))
}
