//! The stage as an object: frames in one by one, each tracked against the model so far and fused into it.

use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use toile_capture::{ColorImage, Frame, Rig, Sensor};
use toile_geometry::{Mesh, Rigid};

use crate::{
    FusionError, FusionSettings, Prior,
    depth_filter::drop_edges,
    integrate::integrate,
    motion::MotionModel,
    noise::depth_noise,
    normals::window_for,
    raycast::ray_cast,
    report::{DroppedFrame, Stopwatch},
    surface::extract_surface,
    track::{Tracked, approach, register, samples, track},
    tsdf::Tsdf,
    view::{CutDepth, Rectifier, View, is_measured},
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
/// First guesses of the turn between the first two frames, degrees.
const FIRST_TURNS: [f64; 11] = [0.0, 1.5, -1.5, 3.5, -3.5, 6.0, -6.0, 9.0, -9.0, 13.0, -13.0];
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

/// The stage as an object that takes frames one by one. It never waits for anything.
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
    pub(crate) dropped: Vec<DroppedFrame>,
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
            dropped: Vec::new(),
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
        let found = match self.locate(frame, &view) {
            Ok(found) => found,
            Err(reason) => return Ok(self.drop_frame(frame, reason)),
        };
        let (scan_from_camera, tracked) = found;
        let model = &mut self.model;
        let touched = self.clock.time("integrate", || integrate(model, &view, &scan_from_camera))?;
        self.touched += touched.blocks;
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
        let predicted = self.motion.predict(frame.device_time_ns);
        let model = &self.model;
        let tracked = if self.motion.knows_rate() || self.settings.prior == Prior::None {
            self.clock.time("track", || track(model, view, &predicted))
        } else {
            self.clock.time("first turn", || best_of(model, view, &turned_guesses(&predicted, &FIRST_TURNS)))
        };
        if let Err(reason) = self.trusted(view, &tracked, &predicted) {
            return self.relocalise(view, &predicted, reason);
        }
        Ok((tracked.scan_from_camera, Some(tracked)))
    }

    /// Tries the key poses and turned predictions; the original reason where none is trusted.
    fn relocalise(
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

    fn trusted(&self, view: &View, tracked: &Tracked, predicted: &Rigid) -> Result<(), String> {
        let (overlap, inliers, residual) = TRUST;
        let mut limit = residual * f64::from(self.model.truncation());
        if tracked.residual > limit {
            let depth: Vec<f32> = view.elements.iter().map(|e| e[0]).collect();
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

/// The pose that fits best among registrations from several starts.
fn best_of(model: &Tsdf, view: &View, guesses: &[Rigid]) -> Tracked {
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
fn turned_guesses(pose: &Rigid, degrees: &[f64]) -> Vec<Rigid> {
    degrees.iter().map(|d| Isometry3::rotation(Vector3::y() * d.to_radians()) * pose).collect()
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
