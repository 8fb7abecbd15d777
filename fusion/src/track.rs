//! Frame-to-model tracking: projective point-to-plane against the ray-cast model to come near, then the frame's
//! points against the distance field itself, which has no association error.

use nalgebra::{Isometry3, Matrix6, Point3, SymmetricEigen, Translation3, UnitQuaternion, Vector3, Vector6};
use rayon::prelude::*;
use serde::Serialize;
use toile_geometry::{Rigid, statistics::sigma_about_zero};

use crate::{
    normals::dot,
    raycast::{ModelView, ray_cast},
    tsdf::Tsdf,
    view::View,
};

/// Points of a parallel task; fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 512;
/// About how many points the fine stage uses.
const FINE_POINTS: usize = 4000;
/// Least overlap and inliers at which a registration without the coarse stage is believed.
const NEAR: (f64, f64) = (0.8, 0.7);
/// One point in so many serves until the pose hardly moves.
const THINNING: usize = 6;
/// A step below this (metres at the subject's radius) asks for all points.
const NEARLY: f64 = 2e-4;
/// Distance gates of the coarse iterations, metres.
const COARSE_GATES: [f64; 7] = [0.10, 0.08, 0.06, 0.05, 0.04, 0.03, 0.03];
/// A conditioning below this means that the shape hardly tells a direction: a column's turn (a person's is above 0.01).
pub(crate) const DEGENERATE: f64 = 5e-3;
/// A direction with less than this share of the largest eigenvalue is open.
const OPEN: f64 = 1e-3;
/// Fewer points than this say nothing.
const LEAST_POINTS: usize = 50;
/// Most fine iterations.
const FINE_ITERATIONS: usize = 15;
/// A step below this (metres at the subject's radius) has converged.
const CONVERGED: f64 = 5e-6;

/// A weighted point of a frame, camera frame.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Position.
    pub point: Point3<f32>,
    /// Unit normal towards the camera.
    pub normal: [f32; 3],
    /// Relative weight: falls with incidence angle and the noise of the range.
    pub weight: f32,
}

/// What tracking found out about a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tracked {
    /// Pose found.
    #[serde(skip)]
    pub scan_from_camera: Rigid,
    /// Share of the frame's points that lie within the model's band.
    pub overlap: f64,
    /// Share of those that agree with it (within three robust standard deviations).
    pub inliers: f64,
    /// Root mean square point-to-surface distance of the inliers, metres.
    pub residual: f64,
    /// Least over largest eigenvalue of the normal matrix (rotations scaled by the subject's size); near 0 where a
    /// direction is not determined.
    pub conditioning: f64,
    /// Iterations of the fine stage.
    pub iterations: usize,
    /// True when the last step was negligible.
    pub converged: bool,
    /// True where the shape left a direction open and colours decided it.
    pub by_color: bool,
}

impl Tracked {
    /// Nothing known yet but a pose.
    pub(crate) fn at(pose: &Rigid) -> Self {
        Self {
            scan_from_camera: *pose,
            overlap: 0.0,
            inliers: 0.0,
            residual: f64::INFINITY,
            conditioning: 0.0,
            iterations: 0,
            converged: false,
            by_color: false,
        }
    }
}

/// Normal equations of a point-to-plane problem about a centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Normal {
    pub hessian: Matrix6<f64>,
    pub gradient: Vector6<f64>,
    pub squares: f64,
    pub weight: f64,
    pub count: usize,
}

/// Samples of a view, thinned to about `count`.
pub fn samples(view: &View, count: usize) -> Vec<Sample> {
    let all = view.count();
    let stride = ((all as f64 / count.max(1) as f64).sqrt().round() as usize).max(1);
    view.samples(stride)
        .filter_map(|i| {
            let (p, n) = view.element(i)?;
            let cosine = -dot(n, p) / dot(p, p).sqrt().max(1e-6);
            let weight = cosine * cosine / (p[2] * p[2]).max(0.25);
            Some(Sample { point: p.into(), normal: n, weight })
        })
        .collect()
}

/// Registers a view to the model from a predicted pose: against the distance field at once where that pose lies well
/// within its band, else the coarse stage goes before.
pub fn track(tsdf: &Tsdf, view: &View, predicted: &Rigid) -> Tracked {
    let points = samples(view, FINE_POINTS);
    let near = register(tsdf, &points, predicted);
    if near.converged && near.overlap > NEAR.0 && near.inliers > NEAR.1 {
        return near;
    }
    let stride = if view.pixels() > 60_000 { 4 } else { 3 };
    let model = ray_cast(tsdf, &view.camera, predicted, stride);
    let coarse = approach(&model, predicted, &points, predicted);
    register(tsdf, &points, &coarse)
}

/// Coarse stage alone: the pose that brings the samples onto the model view rendered from `rendered_at`.
pub fn approach(model: &ModelView, rendered_at: &Rigid, points: &[Sample], start: &Rigid) -> Rigid {
    let mut pose = *start;
    let camera_from_scan = rendered_at.inverse();
    let thin = (points.len() / 1500).max(1);
    let few: Vec<Sample> = points.iter().step_by(thin).copied().collect();
    for gate in COARSE_GATES {
        let center = centroid(&few, &pose);
        let system = accumulate(&few, &pose, &center, |q, n, _| {
            let hit = associate(model, &camera_from_scan, q, n, gate)?;
            let r = f64::from(dot(hit.normal, [q.x - hit.point[0], q.y - hit.point[1], q.z - hit.point[2]]));
            let kernel = (1.0 - (r / gate) * (r / gate)).max(0.0);
            Some((r, hit.normal, kernel * kernel))
        });
        if system.count < LEAST_POINTS {
            break;
        }
        pose = step(&system, &center, 1e-4).0 * pose;
    }
    pose
}

fn associate(
    model: &ModelView,
    camera_from_scan: &Rigid,
    q: &Point3<f32>,
    normal: [f32; 3],
    gate: f64,
) -> Option<crate::raycast::Hit> {
    let p = camera_from_scan * q.cast::<f64>();
    let pixel = model.camera.project(&p)?;
    let s = model.stride as f64;
    let (u, v) = ((pixel.x / s).round(), (pixel.y / s).round());
    if u < 0.0 || v < 0.0 || u >= model.width as f64 || v >= model.height as f64 {
        return None;
    }
    let hit = model.hits[v as usize * model.width + u as usize]?;
    let d = [q.x - hit.point[0], q.y - hit.point[1], q.z - hit.point[2]];
    (f64::from(dot(d, d)) < gate * gate && dot(hit.normal, normal) > 0.6).then_some(hit)
}

/// Fine stage: the samples against the distance field, Tukey's kernel with a scale taken from the data; a few of them
/// until the pose hardly moves, then all.
pub fn register(tsdf: &Tsdf, points: &[Sample], start: &Rigid) -> Tracked {
    let few: Vec<Sample> = points.iter().step_by(THINNING).copied().collect();
    let rough = descend(tsdf, &few, start, NEARLY);
    let start = if rough.converged { rough.scan_from_camera } else { *start };
    let fine = descend(tsdf, points, &start, CONVERGED);
    Tracked { iterations: rough.iterations + fine.iterations, ..assess(tsdf, points, fine) }
}

/// Gauss–Newton steps until one is smaller than `enough`.
fn descend(tsdf: &Tsdf, points: &[Sample], start: &Rigid, enough: f64) -> Tracked {
    let mut pose = *start;
    let truncation = f64::from(tsdf.truncation());
    let mut result = Tracked::at(start);
    let mut cut = truncation * 0.9;
    for iteration in 0..FINE_ITERATIONS {
        if iteration < 3 {
            let spread = robust_spread(tsdf, points, &pose).unwrap_or(truncation / 3.0);
            cut = (4.7 * spread).clamp(0.002, truncation * 0.9);
        }
        let center = centroid(points, &pose);
        let system = accumulate(points, &pose, &center, |q, n, _| {
            let (r, normal) = signed_distance(tsdf, q, n)?;
            let k = (1.0 - (r / cut) * (r / cut)).max(0.0);
            Some((r, normal, k * k))
        });
        result.iterations = iteration + 1;
        if system.count < LEAST_POINTS {
            return result;
        }
        let (motion, size) = step(&system, &center, 1e-6);
        pose = motion * pose;
        (result.scan_from_camera, result.conditioning) = (pose, conditioning(&system));
        result.converged = size < enough;
        if result.converged {
            break;
        }
    }
    result
}

/// Distance to the surface and its normal, where the point's own normal agrees with it.
#[inline]
pub(crate) fn signed_distance(tsdf: &Tsdf, q: &Point3<f32>, normal: [f32; 3]) -> Option<(f64, [f32; 3])> {
    let (d, g) = tsdf.distance_and_gradient(q)?;
    let length = dot(g, g).sqrt();
    if length < 0.2 || d.abs() >= tsdf.truncation() * 0.95 {
        return None;
    }
    let unit = g.map(|c| c / length);
    (dot(unit, normal) > 0.5).then(|| (f64::from(d / length.max(0.7)), unit))
}

/// Robust standard deviation of the distances (1.4826 × median absolute value); `None` of fewer than 50.
pub(crate) fn robust_spread(tsdf: &Tsdf, points: &[Sample], pose: &Rigid) -> Option<f64> {
    let mut all: Vec<f64> =
        distances(tsdf, &points.iter().step_by(points.len() / 1000 + 1).copied().collect::<Vec<_>>(), pose)
            .into_iter()
            .flatten()
            .map(f64::abs)
            .collect();
    if all.len() < LEAST_POINTS {
        return None;
    }
    sigma_about_zero(&mut all)
}

/// Signed distance of every sample; `None` outside the band.
fn distances(tsdf: &Tsdf, points: &[Sample], pose: &Rigid) -> Vec<Option<f64>> {
    let rotation = pose.rotation.cast::<f32>();
    points
        .par_iter()
        .with_min_len(CHUNK)
        .map(|s| {
            let q = toile_geometry::transform_point(pose, &s.point);
            let n = rotation * Vector3::from(s.normal);
            signed_distance(tsdf, &q, n.into()).map(|r| r.0)
        })
        .collect()
}

/// How well the points fit at the pose found.
pub(crate) fn assess(tsdf: &Tsdf, points: &[Sample], result: Tracked) -> Tracked {
    let all = distances(tsdf, points, &result.scan_from_camera);
    let within: Vec<f64> = all.iter().flatten().copied().collect();
    let mut sizes: Vec<f64> = within.iter().map(|d| d.abs()).collect();
    let spread = sigma_about_zero(&mut sizes).unwrap_or(0.0);
    let limit = (3.0 * spread).max(5e-4);
    let inliers: Vec<f64> = within.iter().copied().filter(|d| d.abs() <= limit).collect();
    let mean_square = inliers.iter().map(|d| d * d).sum::<f64>() / inliers.len().max(1) as f64;
    Tracked {
        overlap: within.len() as f64 / points.len().max(1) as f64,
        inliers: inliers.len() as f64 / within.len().max(1) as f64,
        residual: mean_square.sqrt(),
        ..result
    }
}

/// Sums weighted normal equations of left increments about `center`: residual r with normal n at q has the row
/// [(q − c) × n, n].
pub(crate) fn accumulate(
    points: &[Sample],
    pose: &Rigid,
    center: &Point3<f64>,
    measure: impl Fn(&Point3<f32>, [f32; 3], &Sample) -> Option<(f64, [f32; 3], f64)> + Sync,
) -> Normal {
    let rotation = pose.rotation.cast::<f32>();
    let parts: Vec<Normal> = points
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut sum = Normal::zero();
            for s in chunk {
                let q = toile_geometry::transform_point(pose, &s.point);
                let n = rotation * Vector3::from(s.normal);
                if let Some((r, normal, kernel)) = measure(&q, n.into(), s) {
                    sum.add(&q, center, normal, r, kernel * f64::from(s.weight));
                }
            }
            sum
        })
        .collect();
    parts.iter().fold(Normal::zero(), |a, b| a.plus(b))
}

impl Normal {
    pub(crate) fn zero() -> Self {
        Self { hessian: Matrix6::zeros(), gradient: Vector6::zeros(), squares: 0.0, weight: 0.0, count: 0 }
    }

    #[inline]
    pub(crate) fn add(&mut self, q: &Point3<f32>, center: &Point3<f64>, normal: [f32; 3], r: f64, weight: f64) {
        if weight <= 0.0 {
            return;
        }
        let n = Vector3::from(normal).cast::<f64>();
        let m = (q.cast::<f64>() - center).cross(&n);
        let row = [m.x, m.y, m.z, n.x, n.y, n.z];
        for i in 0..6 {
            let wi = weight * row[i];
            for (j, column) in row.iter().enumerate().take(i + 1) {
                self.hessian[(i, j)] += wi * column;
            }
            self.gradient[i] += wi * r;
        }
        self.squares += weight * r * r;
        self.weight += weight;
        self.count += 1;
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            hessian: self.hessian + other.hessian,
            gradient: self.gradient + other.gradient,
            squares: self.squares + other.squares,
            weight: self.weight + other.weight,
            count: self.count + other.count,
        }
    }

    /// The full symmetric matrix (only its lower half is summed).
    pub(crate) fn symmetric(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| if i >= j { self.hessian[(i, j)] } else { self.hessian[(j, i)] })
    }
}

/// The damped Gauss–Newton step as a motion, and its size in metres at the subject's radius.
pub(crate) fn step(system: &Normal, center: &Point3<f64>, damping: f64) -> (Rigid, f64) {
    let h = system.symmetric();
    let lever = damping * h.trace() / 6.0;
    let damped = h + Matrix6::identity() * lever.max(1e-12);
    let Some(factor) = damped.cholesky() else { return (Rigid::identity(), 0.0) };
    let x = -factor.solve(&system.gradient);
    let size = (x.fixed_rows::<3>(0).norm_squared() * 0.25 + x.fixed_rows::<3>(3).norm_squared()).sqrt();
    (increment(&x, center), size)
}

/// The motion of increment [rotation, translation] about a centre.
pub(crate) fn increment(x: &Vector6<f64>, center: &Point3<f64>) -> Rigid {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(x[0], x[1], x[2]));
    let shift = Vector3::new(x[3], x[4], x[5]) + center.coords - rotation * center.coords;
    Isometry3::from_parts(Translation3::from(shift), rotation)
}

/// Least over largest eigenvalue of the scaled normal matrix.
pub(crate) fn conditioning(system: &Normal) -> f64 {
    let eigen = scaled_eigen(system).0.eigenvalues;
    (eigen.min() / eigen.max().max(1e-12)).max(0.0)
}

/// A direction that the measurements leave open, in the units of a step and in those of a gradient, and what little
/// the normal matrix holds of it.
struct Open {
    step: Vector6<f64>,
    gradient: Vector6<f64>,
    stiffness: f64,
}

/// Makes directions stiff that the measurements leave open: there the solution stays where it is, instead of following
/// the noise (after Zhang, Kaess and Singh 2016, "On degeneracy of optimization-based state estimation problems").
pub(crate) fn hold_open_directions(system: &mut Normal) {
    let (open, largest) = open_directions(system);
    for o in &open {
        system.gradient -= o.gradient * o.step.dot(&system.gradient);
        system.hessian += o.gradient * o.gradient.transpose() * largest;
    }
}

/// Takes away what noise says about directions that the measurements leave open: others may decide them.
pub(crate) fn drop_open_directions(system: &mut Normal) {
    for o in &open_directions(system).0 {
        system.gradient -= o.gradient * o.step.dot(&system.gradient);
        system.hessian -= o.gradient * o.gradient.transpose() * o.stiffness;
    }
}

/// The open directions and the stiffness of the best determined one.
fn open_directions(system: &Normal) -> (Vec<Open>, f64) {
    let (eigen, scale) = scaled_eigen(system);
    let largest = eigen.eigenvalues.max();
    let open = |(k, e): (usize, &f64)| {
        let u: Vector6<f64> = eigen.eigenvectors.column(k).into();
        Open { step: u.component_mul(&scale), gradient: u.component_div(&scale), stiffness: e * system.weight }
    };
    let few = eigen.eigenvalues.iter().enumerate().filter(|(_, e)| **e < OPEN * largest);
    (few.map(open).collect(), largest * system.weight)
}

/// Eigenvalues and vectors of the mean normal matrix with rotations scaled by the subject's size, and the scale.
fn scaled_eigen(system: &Normal) -> (SymmetricEigen<f64, nalgebra::U6>, Vector6<f64>) {
    let h = system.symmetric() / system.weight.max(1e-12);
    let spread = (h.fixed_view::<3, 3>(0, 0).trace() / h.fixed_view::<3, 3>(3, 3).trace().max(1e-12)).sqrt().max(1e-6);
    let scale = Vector6::new(1.0 / spread, 1.0 / spread, 1.0 / spread, 1.0, 1.0, 1.0);
    let scaled = Matrix6::from_fn(|i, j| h[(i, j)] * scale[i] * scale[j]);
    (SymmetricEigen::new(scaled), scale)
}

pub(crate) fn centroid(points: &[Sample], pose: &Rigid) -> Point3<f64> {
    let sum: Vector3<f64> = points.iter().map(|s| s.point.coords.cast::<f64>()).sum();
    pose * Point3::from(sum / points.len().max(1) as f64)
}
