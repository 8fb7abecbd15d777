//! The stage: frames in, scan out.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_capture::{ColorImage, Frame, Rig, Sensor, Source};
use toile_geometry::{Mesh, Rigid, camera::PinholeCamera};

use crate::{
    FusionError, FusionSettings, Prior, Scan, TrackedFrame, Volume,
    clean_up::clean_up,
    closing::close,
    depth_filter::drop_edges,
    integrate::integrate,
    motion::{Axis, MotionModel, find_axis, total_turn},
    noise::depth_noise,
    normals::window_for,
    report::{DroppedFrame, FusionReport, Stopwatch, VolumeReport},
    surface::extract_surface,
    track::{Tracked, register, samples, track},
    tsdf::Tsdf,
    view::{CutDepth, View, decode_color, is_measured, rectified_depth},
    volume::{SURVEY_FRAMES, SubjectVolume, find_volume},
};

/// Least measured pixels of a frame that is used.
const LEAST_PIXELS: usize = 500;
/// Least overlap, inliers and largest residual (share of the truncation) of a trusted pose.
const TRUST: (f64, f64, f64) = (0.4, 0.5, 0.4);
/// A trusted pose departs at most so far from a turntable's prediction: metres at the axis, radians.
const DEPARTURE: (f64, f64) = (0.06, 0.12);
/// First guesses of the turn between the first two frames, degrees.
const FIRST_TURNS: [f64; 11] = [0.0, 1.5, -1.5, 3.5, -3.5, 6.0, -6.0, 9.0, -9.0, 13.0, -13.0];
/// The band is at least this many standard deviations of the noise.
const NOISE_BAND: f64 = 4.5;
/// A turn of this many degrees is a full one.
const FULL_TURN_DEG: f64 = 340.0;
/// Most frames in the joint optimisation; of more, evenly spaced ones.
const MOST_KEY_FRAMES: usize = 150;
/// Frames in which a voxel must have been seen well, in weight units, to be surface.
const LEAST_WEIGHT: u16 = 6;

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
struct Kept {
    index: u64,
    device_time_ns: i64,
    depth: CutDepth,
    color: Option<ColorImage>,
    scan_from_camera: Rigid,
    tracked: Option<Tracked>,
}

/// The stage as an object that takes frames one by one. It never waits for anything.
pub struct Fuser {
    settings: FusionSettings,
    sensor: Sensor,
    volume: Option<SubjectVolume>,
    model: Tsdf,
    noise: f64,
    window: usize,
    motion: MotionModel,
    kept: Vec<Kept>,
    dropped: Vec<DroppedFrame>,
    seen: usize,
    touched: usize,
    clock: Stopwatch,
}

/// Fuses a whole take: surveys it for the subject's volume, pushes every frame, finishes.
///
/// # Errors
/// Where there is nothing to make a scan of: no depth, nobody who turns, no frames that fit together; and where the
/// source fails altogether. Frames that cannot be read or tracked are dropped and reported.
pub fn fuse(
    source: &mut dyn Source,
    settings: &FusionSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Scan, FusionError> {
    let rig = source.rig().clone();
    let (frames, unreadable) = read_all(source, progress)?;
    let volume = match settings.volume {
        Volume::All => None,
        Volume::Auto => Some(survey(&rig, &frames, settings)?),
    };
    let mut fuser = Fuser::new(&rig, volume, settings.clone())?;
    fuser.seen += unreadable.len();
    fuser.dropped.extend(unreadable);
    let count = frames.len().max(1) as f32;
    for (i, frame) in frames.into_iter().enumerate() {
        fuser.push(&frame)?;
        progress(0.1 + 0.4 * (i + 1) as f32 / count);
    }
    fuser.finish(&|x| progress(0.5 + 0.5 * x))
}

/// All frames of the first sensor, and those that could not be read.
fn read_all(
    source: &mut dyn Source,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<(Vec<Frame>, Vec<DroppedFrame>), FusionError> {
    let total = source.frame_count();
    let (mut frames, mut unreadable) = (Vec::new(), Vec::new());
    let mut failures = 0;
    loop {
        match source.next_frame() {
            Ok(Some(frame)) if frame.sensor == 0 => frames.push(frame),
            Ok(Some(_)) => {}
            Ok(None) => break,
            Err(error) => {
                failures += 1;
                if failures > 20 && failures > frames.len() {
                    return Err(error.into());
                }
                let index = (frames.len() + unreadable.len()) as u64;
                unreadable.push(DroppedFrame { index, device_time_ns: 0, reason: error.to_string() });
            }
        }
        if let Some(total) = total {
            progress(0.1 * (frames.len() as f32 / total.max(1) as f32).min(1.0));
        }
    }
    if !frames.iter().any(|f| f.depth.is_some()) {
        return Err(FusionError::NoDepth { frames: frames.len() });
    }
    Ok((frames, unreadable))
}

/// Finds the subject's volume in frames spread over the take.
///
/// # Errors
/// [`FusionError::NobodyInIt`], or a calibration that cannot be used.
pub fn survey(rig: &Rig, frames: &[Frame], settings: &FusionSettings) -> Result<SubjectVolume, FusionError> {
    let sensor = first_sensor(rig)?;
    let with_depth: Vec<&Frame> = frames.iter().filter(|f| f.depth.is_some()).collect();
    let step = with_depth.len().div_ceil(SURVEY_FRAMES).max(1);
    let chosen: Vec<&Frame> = with_depth.into_iter().step_by(step).collect();
    let depths: Vec<Vec<f32>> =
        chosen.par_iter().filter_map(|f| filtered(f, sensor, settings)).map(|(_, depth)| depth).collect();
    let mut ideal = sensor.depth;
    ideal.distortion = [0.0; 5];
    find_volume(&ideal, &depths)
}

fn first_sensor(rig: &Rig) -> Result<&Sensor, FusionError> {
    let wrong = |reason: &str| FusionError::Calibration { sensor: 0, reason: reason.into() };
    let sensor = rig.sensors.first().ok_or_else(|| wrong("the source names no sensor"))?;
    if !sensor.depth.is_valid() || !(sensor.depth_scale > 0.0) {
        return Err(wrong("image size, focal length or depth scale is not positive"));
    }
    Ok(sensor)
}

/// Rectified depth in metres without edges; `None` without depth or with a foreign size.
fn filtered(frame: &Frame, sensor: &Sensor, settings: &FusionSettings) -> Option<(PinholeCamera, Vec<f32>)> {
    let image = frame.depth.as_ref()?;
    if image.width != sensor.depth.width || image.height != sensor.depth.height {
        return None;
    }
    let (camera, depth) = rectified_depth(image, sensor, settings.max_depth);
    let depth = drop_edges(&camera, &depth, settings.jump_slope);
    Some((camera, depth))
}

impl Fuser {
    /// A fuser for the first sensor of a rig. `volume` as [`survey`] finds it, or `None` for everything.
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
            settings,
            sensor,
            volume,
            kept: Vec::new(),
            dropped: Vec::new(),
            seen: 0,
            touched: 0,
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

    /// Takes the depth noise from the first frame: noisy depth needs wider normals and a wider band.
    fn adapt(&mut self, first: &CutDepth) {
        let depth = first.meters();
        self.noise = depth_noise(&first.camera, &depth).unwrap_or(0.0);
        let (sum, count) =
            depth.iter().filter(|d| is_measured(**d)).fold((0.0, 0), |(s, n), d| (s + f64::from(*d), n + 1));
        self.window = window_for(&first.camera, self.noise, sum / f64::from(count.max(1)));
        self.model = self.empty_field(false);
    }

    fn empty_field(&self, with_color: bool) -> Tsdf {
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
        let (sensor, settings) = (&self.sensor, &self.settings);
        let (camera, depth) = self
            .clock
            .time("filter", || filtered(frame, sensor, settings))
            .ok_or("no depth image of the sensor's size")?;
        let depth = match &self.volume {
            Some(volume) => self.clock.time("cut", || volume.cut(&camera, &depth)),
            None => depth,
        };
        let cut = CutDepth::new(&camera, &depth, self.sensor.depth_scale as f32);
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
                .ok_or_else(|| "no known pose within 5 ms".into());
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
        if let Err(reason) = self.trusted(&tracked, &predicted) {
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
        self.trusted(&tracked, &near).map_err(|_| reason)?;
        Ok((tracked.scan_from_camera, Some(tracked)))
    }

    fn trusted(&self, tracked: &Tracked, predicted: &Rigid) -> Result<(), String> {
        let (overlap, inliers, residual) = TRUST;
        let limit = residual * f64::from(self.model.truncation());
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

    /// Closes the turn, fuses everything again and makes the scan.
    ///
    /// # Errors
    /// [`FusionError::NotTracked`] where fewer than three frames were fused.
    pub fn finish(mut self, progress: &(dyn Fn(f32) + Sync)) -> Result<Scan, FusionError> {
        let least = if self.seen < 3 { 1 } else { 3 };
        if self.kept.len() < least {
            let reason = self.dropped.first().map_or_else(|| "too few frames".into(), |d| d.reason.clone());
            return Err(FusionError::NotTracked { reason, tracked: self.kept.len(), frames: self.seen });
        }
        let mut report = FusionReport { settings: self.settings.clone(), ..FusionReport::default() };
        report.settings.poses = None;
        if self.settings.poses.is_none() {
            self.close_turn(&mut report);
            progress(0.3);
            for round in 0..self.settings.refine_rounds {
                self.refine()?;
                progress(0.3 + 0.2 * (round + 1) as f32 / self.settings.refine_rounds as f32);
            }
        }
        let field = self.fuse_again(true)?;
        progress(0.7);
        let raw = self.clock.time("extract", || extract_surface(&field, LEAST_WEIGHT));
        report.triangles_raw = raw.triangles.len();
        let placed = self.place(&raw, &mut report);
        let mesh = raw.transformed(&placed);
        let (settings, on_floor) = (&self.settings, self.volume.as_ref().is_some_and(|v| v.floor.is_some()));
        let (mesh, cleaned) = self.clock.time("clean up", || clean_up(mesh, settings, on_floor));
        report.triangles = mesh.triangles.len();
        report.holes_filled = cleaned.holes;
        report.filled_percent = cleaned.filled_percent;
        report.watertight = cleaned.watertight;
        progress(1.0);
        Ok(self.scan(mesh, &field, &placed, report))
    }

    fn views(&self, indices: &[usize]) -> Vec<View> {
        indices.par_iter().map(|&i| self.kept[i].depth.view(self.window)).collect()
    }

    /// Joint optimisation over key frames; frames between follow their neighbours.
    fn close_turn(&mut self, report: &mut FusionReport) {
        if self.settings.closing_rounds == 0 {
            return;
        }
        let step = self.kept.len().div_ceil(MOST_KEY_FRAMES).max(1);
        let keys: Vec<usize> = (0..self.kept.len()).step_by(step).collect();
        let views = self.views(&keys);
        let mut poses: Vec<Rigid> = keys.iter().map(|&i| self.kept[i].scan_from_camera).collect();
        let rounds = self.settings.closing_rounds;
        let closing = self.clock.time("close", || close(&views, &mut poses, rounds));
        report.closing_pairs = closing.pairs;
        report.seam_pairs = closing.seam_pairs;
        report.seam_before_mm = closing.seam_before * 1e3;
        report.seam_after_mm = closing.seam_after * 1e3;
        let corrections: Vec<Rigid> =
            keys.iter().zip(&poses).map(|(&i, pose)| pose * self.kept[i].scan_from_camera.inverse()).collect();
        for (i, kept) in self.kept.iter_mut().enumerate() {
            let (k, share) = (i / step, (i % step) as f64 / step as f64);
            let next = corrections.get(k + 1).unwrap_or(&corrections[k]);
            kept.scan_from_camera = between(&corrections[k], next, share) * kept.scan_from_camera;
        }
    }

    /// Fuses all frames and registers each of them to the whole.
    fn refine(&mut self) -> Result<(), FusionError> {
        let field = self.fuse_again(false)?;
        let (kept, window) = (&self.kept, self.window);
        let poses: Vec<Rigid> = self.clock.time("refine", || {
            kept.par_iter()
                .map(|k| {
                    let view = k.depth.view(window);
                    let tracked = register(&field, &samples(&view, 6000), &k.scan_from_camera);
                    if tracked.overlap > 0.5 { tracked.scan_from_camera } else { k.scan_from_camera }
                })
                .collect()
        });
        let back = self.kept[0].scan_from_camera * poses[0].inverse();
        self.kept.iter_mut().zip(poses).for_each(|(k, pose)| k.scan_from_camera = back * pose);
        Ok(())
    }

    fn fuse_again(&mut self, with_color: bool) -> Result<Tsdf, FusionError> {
        let with_color = with_color && self.kept.iter().any(|k| k.color.is_some());
        let mut field = self.empty_field(with_color);
        let window = self.window;
        let (kept, sensor) = (&self.kept, &self.sensor);
        self.clock.time("fuse again", || {
            for group in kept.chunks(16) {
                let views: Vec<View> = group.par_iter().map(|k| colored_view(k, sensor, window, with_color)).collect();
                for (k, view) in group.iter().zip(&views) {
                    integrate(&mut field, view, &k.scan_from_camera)?;
                }
            }
            Ok::<(), FusionError>(())
        })?;
        Ok(field)
    }

    /// The transform from the model's frame to the scan's, and what it tells about the turn.
    fn place(&self, raw: &Mesh, report: &mut FusionReport) -> Rigid {
        let poses: Vec<Rigid> = self.kept.iter().map(|k| k.scan_from_camera).collect();
        if self.settings.prior == Prior::None && self.volume.is_none() || self.settings.poses.is_some() {
            return Rigid::identity();
        }
        let axis = find_axis(&poses);
        let turned = axis.map_or(0.0, |a| total_turn(&a, &poses));
        report.turned_deg = turned.abs().to_degrees();
        report.full_turn = report.turned_deg >= FULL_TURN_DEG;
        let span = self.kept.last().map_or(0, |k| k.device_time_ns) - self.kept[0].device_time_ns;
        report.rate_deg_per_s = report.turned_deg / (span as f64 * 1e-9).max(1e-6);
        let upright = Axis { point: Point3::origin(), direction: Vector3::y() };
        let axis = match axis {
            Some(mut a) if turned.abs() > 0.5 => {
                if a.direction.y < 0.0 {
                    a.direction = -a.direction;
                }
                if self.volume.as_ref().is_some_and(|v| v.floor.is_some()) {
                    report.axis_tilt_deg = Some(a.direction.angle(&Vector3::y()).to_degrees());
                }
                a
            }
            _ => upright,
        };
        let has_floor = self.volume.as_ref().is_some_and(|v| v.floor.is_some());
        let lowest = raw.positions.iter().map(|p| p.coords.cast::<f64>().dot(&axis.direction));
        let ground = if has_floor { None } else { lowest.min_by(f64::total_cmp) };
        scan_frame(&axis, &poses[0], ground)
    }

    fn scan(self, mesh: Mesh, field: &Tsdf, placed: &Rigid, mut report: FusionReport) -> Scan {
        report.frames_seen = self.seen;
        report.frames_fused = self.kept.len();
        report.dropped = self.dropped;
        report.volume = self.volume.as_ref().map(|v| VolumeReport {
            radius_m: v.radius,
            floor_found: v.floor.is_some(),
            disk_height_m: v.floor.as_ref().map_or(0.0, |f| f.disk_height),
            bottom_m: v.bottom.unwrap_or(0.0),
            axis_distance_m: v.scan_from_camera.translation.vector.xz().norm(),
        });
        report.noise_mm = self.noise * 1e3;
        report.truncation_mm = f64::from(field.truncation()) * 1e3;
        let mut residuals: Vec<f64> = self.kept.iter().filter_map(|k| k.tracked.map(|t| t.residual * 1e3)).collect();
        residuals.sort_unstable_by(f64::total_cmp);
        report.residual_mm = residuals.get(residuals.len() / 2).copied().unwrap_or(0.0);
        report.residual_max_mm = residuals.last().copied().unwrap_or(0.0);
        report.warnings = warnings(&report);
        let mut timings = self.clock.timings();
        timings.blocks = field.block_count();
        timings.voxels = field.block_count() * crate::tsdf::VOXELS;
        timings.voxels_updated_per_frame = self.touched * crate::tsdf::VOXELS / self.kept.len().max(1);
        timings.field_bytes = field.bytes();
        let trajectory = self
            .kept
            .into_iter()
            .map(|k| TrackedFrame {
                index: k.index,
                device_time_ns: k.device_time_ns,
                scan_from_camera: placed * k.scan_from_camera,
                tracked: k.tracked,
            })
            .collect();
        Scan { mesh, trajectory, report, timings }
    }
}

fn warnings(report: &FusionReport) -> Vec<String> {
    let mut list = Vec::new();
    if report.volume.is_some() && !report.full_turn && report.turned_deg > 0.0 {
        list.push(format!("no full turn: {:.0}° of 360°; the far side is filled, not seen", report.turned_deg));
    }
    let lost = report.frames_seen.saturating_sub(report.frames_fused);
    if lost * 20 > report.frames_seen {
        list.push(format!("{lost} of {} frames could not be used", report.frames_seen));
    }
    if report.seam_after_mm > 5.0 {
        list.push(format!("the turn closes only to {:.1} mm: the subject moved", report.seam_after_mm));
    }
    list
}

fn colored_view(kept: &Kept, sensor: &Sensor, window: usize, with_color: bool) -> View {
    let mut view = kept.depth.view(window);
    if let Some(image) = decode_color(kept.color.as_ref(), kept.index).filter(|_| with_color) {
        let image: Arc<_> = image;
        view.add_colors(&image, sensor);
    }
    view
}

/// The pose that fits best among registrations from several starts.
fn best_of(model: &Tsdf, view: &View, guesses: &[Rigid]) -> Tracked {
    let few = samples(view, 1500);
    let score = |t: &Tracked| t.overlap * t.inliers / (t.residual + 1e-3);
    let rough: Vec<Tracked> = guesses
        .par_iter()
        .map(|g| {
            let seen = crate::raycast::ray_cast(model, &view.camera, g, 6);
            register(model, &few, &crate::track::approach(&seen, g, &few, g))
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

/// The scan's frame from the axis, the first camera and the ground's height along the axis (`None`: where the
/// model's own level zero meets the axis).
fn scan_frame(axis: &Axis, first: &Rigid, ground: Option<f64>) -> Rigid {
    let y = axis.direction;
    let along = match ground {
        Some(g) => g - axis.point.coords.dot(&y),
        None => -axis.point.y / y.y.max(0.1),
    };
    let origin = axis.point + y * along;
    let toward = Point3::from(first.translation.vector) - origin;
    let z = (toward - y * y.dot(&toward)).try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let rows = Rotation3::from_basis_unchecked(&[y.cross(&z), y, z]).transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&rows);
    Isometry3::from_parts(Translation3::from(-(rotation * origin.coords)), rotation)
}

/// The motion a share of the way from one to another.
fn between(a: &Rigid, b: &Rigid, share: f64) -> Rigid {
    let step = (a.rotation.inverse() * b.rotation).scaled_axis() * share;
    let rotation = a.rotation * UnitQuaternion::from_scaled_axis(step);
    Isometry3::from_parts(Translation3::from(a.translation.vector.lerp(&b.translation.vector, share)), rotation)
}
