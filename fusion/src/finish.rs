//! The end of a take: the turn is closed, everything is fused again, the surface becomes the scan.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_capture::Sensor;
use toile_geometry::{Mesh, Rigid};

use crate::{
    FusionError, Prior, Scan, TrackedFrame,
    clean_up::clean_up,
    closing::close,
    fuser::{Fuser, Kept, NO_KNOWN_POSE},
    integrate::integrate,
    motion::{Axis, find_axis, total_turn},
    report::{FusionReport, VolumeReport},
    surface::{crossings, tidy},
    track::{DEGENERATE, register, samples},
    tsdf::Tsdf,
    view::{View, decode_color},
};

/// A turn of this many degrees is a full one.
const FULL_TURN_DEG: f64 = 340.0;
/// Most frames in the joint optimisation; of more, evenly spaced ones.
const MOST_CLOSED: usize = 100;
/// Most frames in a round of refinement.
const MOST_REFINED: usize = 200;
/// Most frames whose colours are used.
const MOST_COLORED: usize = 200;
/// Weight units that make a voxel surface: two frames at the most grazing angle.
const LEAST_WEIGHT: u16 = 2;
/// The same for each frame of a subject that turns before a resting camera, which sees every place in a fixed share of the
/// frames: one frame in fifty at the most grazing angle. Flying pixels and the noise over the disk come with every frame,
/// so the weight that makes a surface must grow with the number of frames.
const LEAST_WEIGHT_A_FRAME: f64 = 0.02;

/// What the report tells about the final field.
struct FieldSize {
    blocks: usize,
    bytes: usize,
    truncation: f32,
}

impl Fuser {
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
        let field = self.final_field()?;
        progress(0.7);
        let size = FieldSize { blocks: field.block_count(), bytes: field.bytes(), truncation: field.truncation() };
        let least_weight = self.least_weight();
        let raw = self.clock.time("extract", || {
            let crossings = crossings(&field, least_weight);
            drop(field);
            tidy(&crossings)
        });
        report.triangles_raw = raw.triangles.len();
        if raw.triangles.is_empty() {
            return Err(FusionError::NobodyInIt { reason: "the fused frames make no surface".into() });
        }
        let placed = self.place(&raw, &mut report);
        let mesh = raw.transformed(&placed);
        drop(raw);
        // Known poses keep their own frame, whose zero is no floor.
        let on_floor = self.volume.as_ref().filter(|v| v.floor.is_some() && self.settings.poses.is_none());
        let cut = on_floor.and_then(|v| v.bottom).map(|bottom| bottom as f32);
        let settings = &self.settings;
        let (mesh, cleaned) = self.clock.time("clean up", || clean_up(mesh, settings, cut));
        report.triangles = mesh.triangles.len();
        report.holes_filled = cleaned.holes;
        report.filled_percent = cleaned.filled_percent;
        report.watertight = cleaned.watertight;
        progress(1.0);
        Ok(self.scan(mesh, &size, &placed, report))
    }

    /// Weight units that make a voxel surface. A hand-held camera sees a place in a few of its frames only.
    pub(crate) fn least_weight(&self) -> u16 {
        let turning = self.volume.is_some() && self.settings.prior == Prior::Turntable;
        let share = if turning { (LEAST_WEIGHT_A_FRAME * self.kept.len() as f64) as u16 } else { 0 };
        share.max(LEAST_WEIGHT)
    }

    fn views(&self, indices: &[usize]) -> Vec<View> {
        indices.par_iter().map(|&i| self.kept[i].depth.view(self.window)).collect()
    }

    /// Joint optimisation over key frames; frames between follow their neighbours.
    fn close_turn(&mut self, report: &mut FusionReport) {
        if self.settings.closing_rounds == 0 {
            return;
        }
        let keys = self.key_frames(MOST_CLOSED);
        let views = self.views(&keys);
        let mut poses: Vec<Rigid> = keys.iter().map(|&i| self.kept[i].scan_from_camera).collect();
        let rounds = self.settings.closing_rounds;
        let closing = self.clock.time("close", || close(&views, &mut poses, rounds));
        report.closing_pairs = closing.pairs;
        report.seam_pairs = closing.seam_pairs;
        report.seam_before_mm = closing.seam_before * 1e3;
        report.seam_after_mm = closing.seam_after * 1e3;
        self.follow(&keys, &poses);
    }

    /// Fuses key frames and registers each of them to the whole.
    fn refine(&mut self) -> Result<(), FusionError> {
        let keys = self.key_frames(MOST_REFINED);
        let field = self.fuse_again(&keys, false)?;
        let (kept, window) = (&self.kept, self.window);
        let registered = |&i: &usize| {
            let (view, before) = (kept[i].depth.view(window), kept[i].scan_from_camera);
            let tracked = register(&field, &samples(&view, 6000), &before);
            if tracked.overlap > 0.5 && tracked.conditioning > DEGENERATE { tracked.scan_from_camera } else { before }
        };
        let poses: Vec<Rigid> = self.clock.time("refine", || keys.par_iter().map(registered).collect());
        let back = self.kept[0].scan_from_camera * poses[0].inverse();
        self.follow(&keys, &poses.iter().map(|pose| back * pose).collect::<Vec<_>>());
        Ok(())
    }

    /// At most so many frames, evenly spaced from the first on.
    fn key_frames(&self, most: usize) -> Vec<usize> {
        (0..self.kept.len()).step_by(self.kept.len().div_ceil(most).max(1)).collect()
    }

    /// Gives the key frames new poses; the frames between follow their neighbours smoothly.
    fn follow(&mut self, keys: &[usize], poses: &[Rigid]) {
        let step = keys.get(1).map_or(1, |second| second - keys[0]);
        let corrections: Vec<Rigid> =
            keys.iter().zip(poses).map(|(&i, pose)| pose * self.kept[i].scan_from_camera.inverse()).collect();
        for (i, kept) in self.kept.iter_mut().enumerate() {
            let (k, share) = (i / step, (i % step) as f64 / step as f64);
            let next = corrections.get(k + 1).unwrap_or(&corrections[k]);
            kept.scan_from_camera = between(&corrections[k], next, share) * kept.scan_from_camera;
        }
    }

    /// The field of the scan: of all frames, with the colours of key frames. Where poses are as they were pushed and
    /// there are no colours, that is the model already.
    fn final_field(&mut self) -> Result<Tsdf, FusionError> {
        let as_pushed =
            self.settings.poses.is_some() || (self.settings.closing_rounds == 0 && self.settings.refine_rounds == 0);
        if as_pushed && self.kept.iter().all(|k| k.color.is_none()) {
            let nothing = self.empty_field(false);
            return Ok(std::mem::replace(&mut self.model, nothing));
        }
        // At fine voxels memory decides: what is not needed any more goes before the next large thing comes.
        self.model = self.empty_field(false);
        self.fuse_again(&(0..self.kept.len()).collect::<Vec<_>>(), true)
    }

    fn fuse_again(&mut self, frames: &[usize], with_color: bool) -> Result<Tsdf, FusionError> {
        let with_color = with_color && self.kept.iter().any(|k| k.color.is_some());
        let mut field = self.empty_field(with_color);
        let window = self.window;
        let colored = self.kept.len().div_ceil(MOST_COLORED).max(1);
        let (kept, sensor, clock) = (&self.kept, &self.sensor, &mut self.clock);
        let step = if with_color { "integrate with colour" } else { "integrate again" };
        for group in frames.chunks(16) {
            let view = |&i: &usize| colored_view(&kept[i], sensor, window, with_color && i.is_multiple_of(colored));
            let views: Vec<View> = clock.time("prepare again", || group.par_iter().map(view).collect());
            for (&i, view) in group.iter().zip(&views) {
                clock.time(step, || integrate(&mut field, view, &kept[i].scan_from_camera))?;
            }
        }
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
        // Without a volume the model's frame is the first camera's, whose +Y points down.
        let up = if self.volume.is_some() { Vector3::y() } else { -Vector3::y() };
        let upright = Axis { point: Point3::origin(), direction: up };
        let axis = match axis {
            Some(mut a) if turned.abs() > 0.5 => {
                if a.direction.dot(&up) < 0.0 {
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

    fn scan(self, mesh: Mesh, field: &FieldSize, placed: &Rigid, mut report: FusionReport) -> Scan {
        report.frames_seen = self.seen;
        report.frames_fused = self.kept.len();
        report.dropped = self.dropped;
        report.sensors_not_used = self.other_sensors;
        report.volume = self.volume.as_ref().map(|v| VolumeReport {
            radius_m: v.radius,
            floor_found: v.floor.is_some(),
            bottom_m: v.bottom.unwrap_or(0.0),
            axis_distance_m: v.scan_from_camera.translation.vector.xz().norm(),
        });
        report.noise_mm = self.noise * 1e3;
        report.truncation_mm = f64::from(field.truncation) * 1e3;
        let mut residuals: Vec<f64> = self.kept.iter().filter_map(|k| k.tracked.map(|t| t.residual * 1e3)).collect();
        residuals.sort_unstable_by(f64::total_cmp);
        report.residual_mm = residuals.get(residuals.len() / 2).copied().unwrap_or(0.0);
        report.residual_max_mm = residuals.last().copied().unwrap_or(0.0);
        let tracked = || self.kept.iter().filter_map(|k| k.tracked);
        report.conditioning_least = tracked().map(|t| t.conditioning).min_by(f64::total_cmp).unwrap_or(0.0);
        report.frames_by_color = tracked().filter(|t| t.by_color).count();
        report.warnings = warnings(&report);
        let mut timings = self.clock.timings();
        timings.blocks = field.blocks;
        timings.voxels = field.blocks * crate::tsdf::VOXELS;
        timings.voxels_touched_per_frame = self.touched / self.kept.len().max(1);
        timings.voxels_updated_per_frame = self.updated / self.kept.len().max(1);
        timings.simd = toile_geometry::lanes::instruction_set().into();
        timings.field_bytes = field.bytes;
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
    if !report.sensors_not_used.is_empty() {
        let names = report.sensors_not_used.join("`, `");
        list.push(format!("the scan is made from the rig's first sensor alone: the depth of `{names}` is not used"));
    }
    if report.volume.is_some() && !report.full_turn && report.turned_deg > 0.0 {
        list.push(format!("no full turn: {:.0}° of 360°; the far side is filled, not seen", report.turned_deg));
    }
    let unknown = report.dropped.iter().filter(|d| d.reason == NO_KNOWN_POSE).count();
    if unknown > 0 {
        list.push(format!(
            "{unknown} of {} frames have no known pose within 5 ms and are left out",
            report.frames_seen
        ));
    }
    let lost = report.frames_seen.saturating_sub(report.frames_fused + unknown);
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
        view.add_colors(&image, sensor);
    }
    view
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
