//! Tracking by colour where the shape leaves a direction open: a column or a ball may turn without its surface moving.
//!
//! The frame's grey values are compared with those of a few earlier frames at the pixels that its points fall on
//! there, coarse to fine, together with the distances to the model. Each term is weighed by its own robust spread, so
//! that colour decides only what distances leave open (after Kerl, Sturm and Cremers 2013, "Dense visual SLAM for RGB-D
//! cameras", with earlier frames in place of one key frame).

use nalgebra::{Matrix3, Point3, Vector3};
use toile_geometry::{
    Rigid,
    statistics::{median, sigma_about_zero},
};

use super::{
    equations::{NormalEquations, Residual, accumulate},
    grey::{LEVELS, Picture},
    open_directions::{conditioning, drop_open_directions},
    registration::{assess, robust_spread, surface_distance, tukey},
    samples::{Sample, centroid},
    tracked::Tracked,
};
use crate::{field::Tsdf, frame::dot};

/// Steps on each level.
const STEPS: usize = 8;
/// A step below this (metres at the subject's radius) has converged.
const CONVERGED: f64 = 2e-5;
/// Smallest robust spread of grey values, and of distances (metres): below, quantisation speaks.
const MIN_GREY_SPREAD: f64 = 2.0;
const MIN_SPREAD: f64 = 5e-4;
/// Smallest cosine between a point's normal and the ray on which an earlier frame sees it.
const MIN_COSINE: f32 = 0.4;
/// Fewer points than this say nothing.
const MIN_POINTS: usize = 100;

/// A frame whose pose is known.
pub(crate) struct EarlierFrame<'a> {
    pub picture: &'a Picture,
    pub model_from_camera: Rigid,
}

/// How well colours agree at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrackedByColor {
    pub tracked: Tracked,
    /// Robust spread of the differences of grey values.
    pub spread: f64,
}

/// Normal equations of distances and grey values, and the spread of the latter.
struct JointSystem {
    equations: NormalEquations,
    spread: f64,
}

/// Registers samples to the model and the colours of `picture` to those of earlier frames, from a start. `None` where
/// too few points are seen by both.
pub(crate) fn register_with_color(
    field: &Tsdf,
    points: &[Sample],
    picture: &Picture,
    earlier: &[EarlierFrame],
    start: &Rigid,
) -> Option<TrackedByColor> {
    let mut fit = Tracked { by_color: true, ..Tracked::at(start) };
    let mut spread = 0.0;
    for level in (0..LEVELS).rev() {
        let compared: Vec<Comparison> = earlier.iter().map(|e| Comparison::new(picture, e, level)).collect();
        for _ in 0..STEPS {
            let center = centroid(points, &fit.model_from_camera);
            let system = joint_system(field, points, &compared, &fit.model_from_camera, &center)?;
            let step = system.equations.step(&center, 1e-6);
            fit.model_from_camera = step.motion * fit.model_from_camera;
            fit.conditioning = conditioning(&system.equations);
            fit.converged = step.size < CONVERGED;
            spread = system.spread;
            if fit.converged {
                break;
            }
        }
    }
    Some(TrackedByColor { tracked: assess(field, points, fit), spread })
}

/// Normal equations of distances and grey values, each over the square of its spread.
fn joint_system(
    field: &Tsdf,
    points: &[Sample],
    compared: &[Comparison],
    pose: &Rigid,
    center: &Point3<f64>,
) -> Option<JointSystem> {
    let distance = robust_spread(field, points, pose)?.max(MIN_SPREAD);
    let gate = (4.7 * distance).min(0.9 * f64::from(field.truncation()));
    let mut equations = accumulate(points, pose, center, |_, q, n| {
        let surface = surface_distance(field, q, n)?;
        let kernel = tukey(surface.distance, gate) / (distance * distance);
        Some(Residual { value: surface.distance, gradient: surface.normal, kernel })
    });
    let (mut widest, mut count) = (0.0f64, 0);
    drop_open_directions(&mut equations);
    let share = 1.0 / compared.len() as f64;
    for comparison in compared {
        let Some(colors) = color_system(points, comparison, pose, center, share) else { continue };
        equations = equations.plus(&colors.equations);
        widest = widest.max(colors.spread);
        count += 1;
    }
    (count > 0).then_some(JointSystem { equations, spread: widest })
}

/// Normal equations of the grey values of one earlier frame; `None` where it sees too few of the points.
fn color_system(
    points: &[Sample],
    comparison: &Comparison,
    pose: &Rigid,
    center: &Point3<f64>,
    share: f64,
) -> Option<JointSystem> {
    let mut all: Vec<f64> = points.iter().filter_map(|s| comparison.difference(s, pose)).map(|d| d.value).collect();
    if all.len() < MIN_POINTS {
        return None;
    }
    let offset = median(&mut all).unwrap_or(0.0);
    let mut sizes: Vec<f64> = all.iter().map(|d| (d - offset).abs()).collect();
    let spread = sigma_about_zero(&mut sizes).unwrap_or(0.0).max(MIN_GREY_SPREAD);
    let gate = 4.7 * spread;
    let equations = accumulate(points, pose, center, |s, _, _| {
        let difference = comparison.difference(s, pose)?;
        let value = difference.value - offset;
        let k = (1.0 - (value / gate) * (value / gate)).max(0.0);
        Some(Residual { value, gradient: difference.gradient, kernel: share * k * k / (spread * spread) })
    });
    Some(JointSystem { equations, spread })
}

/// A frame beside an earlier one, on one level.
struct Comparison<'a> {
    picture: &'a Picture,
    earlier: &'a EarlierFrame<'a>,
    level: usize,
    camera_from_model: Rigid,
    turn: Matrix3<f32>,
}

/// The earlier frame's grey value less this one's, and its gradient along the point in the model's frame.
struct Difference {
    value: f64,
    gradient: [f32; 3],
}

impl<'a> Comparison<'a> {
    fn new(picture: &'a Picture, earlier: &'a EarlierFrame, level: usize) -> Self {
        let turn = earlier.model_from_camera.rotation.to_rotation_matrix().into_inner().cast();
        Self { picture, earlier, level, camera_from_model: earlier.model_from_camera.inverse(), turn }
    }

    /// `None` where the earlier frame does not see the sample, or only at a grazing angle.
    fn difference(&self, s: &Sample, pose: &Rigid) -> Option<Difference> {
        let earlier_from_camera = self.camera_from_model * pose;
        let p = (earlier_from_camera * s.point.cast::<f64>()).cast::<f32>();
        let normal = earlier_from_camera.rotation.cast::<f32>() * Vector3::from(s.normal);
        if p.z < 0.1 || -dot(normal.into(), p.coords.into()) < MIN_COSINE * p.coords.norm() {
            return None;
        }
        let here = self.picture.look_up(self.level, &s.point)?;
        let there = self.earlier.picture.look_up(self.level, &p)?;
        let gradient = (self.turn * there.gradient).into();
        Some(Difference { value: f64::from(there.value - here.value), gradient })
    }
}
