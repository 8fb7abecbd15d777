//! Registration of a frame's points to the distance field itself, which has no association error.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Rigid, statistics::sigma_about_zero};

use super::{
    equations::{CHUNK, Residual, accumulate},
    open_directions::conditioning,
    samples::{Sample, centroid, every},
    tracked::Tracked,
};
use crate::{field::Tsdf, frame::dot};

/// One point in this many serves until the pose rests.
const THINNING: usize = 6;
/// A step below this (metres at the subject's radius) asks for all points.
const NEARLY: f64 = 2e-4;
/// A step below this (metres at the subject's radius) has converged.
pub(crate) const CONVERGED: f64 = 5e-6;
/// Iterations of each stage at most.
const ITERATIONS: usize = 15;
/// Iterations in which the gate follows the data; then it stays, so that steps converge.
const GATED: usize = 3;
/// Fewer points than this say nothing.
pub(crate) const MIN_POINTS: usize = 50;
/// Robust standard deviations at which Tukey's kernel ends.
const TUKEY: f64 = 4.7;
/// The smallest gate, metres.
const SMALLEST_GATE: f64 = 0.002;

/// Distance of a point to the model's surface.
pub(crate) struct SurfaceDistance {
    /// Signed, metres; positive outside.
    pub distance: f64,
    /// The surface's unit normal, outward.
    pub normal: [f32; 3],
}

/// Registers samples to the distance field from a start: Gauss–Newton steps under Tukey's kernel with a scale taken
/// from the data, with a few of the samples until the pose rests, then with all.
pub fn register(field: &Tsdf, points: &[Sample], start: &Rigid) -> Tracked {
    let few = every(THINNING, points);
    let mut fit = Tracked::at(start);
    let mut iterations = 0;
    for (points, enough) in [(few.as_slice(), NEARLY), (points, CONVERGED)] {
        // A first stage that does not converge is forgotten.
        fit = Tracked::at(if fit.converged { &fit.model_from_camera } else { start });
        let mut gate = 0.0;
        for iteration in 0..ITERATIONS {
            let pose = fit.model_from_camera;
            if iteration < GATED {
                gate = gate_of(field, points, &pose);
            }
            let center = centroid(points, &pose);
            let system = accumulate(points, &pose, &center, |_, q, n| {
                let surface = surface_distance(field, q, n)?;
                let kernel = tukey(surface.distance, gate);
                Some(Residual { value: surface.distance, gradient: surface.normal, kernel })
            });
            iterations += 1;
            if system.count < MIN_POINTS {
                break;
            }
            let step = system.step(&center, 1e-6);
            fit.model_from_camera = step.motion * pose;
            fit.conditioning = conditioning(&system);
            fit.converged = step.size < enough;
            if fit.converged {
                break;
            }
        }
    }
    Tracked { iterations, ..assess(field, points, fit) }
}

/// The distance beyond which a sample does not count, metres.
pub(crate) fn gate_of(field: &Tsdf, points: &[Sample], pose: &Rigid) -> f64 {
    let truncation = f64::from(field.truncation());
    let spread = robust_spread(field, points, pose).unwrap_or(truncation / 3.0);
    (TUKEY * spread).clamp(SMALLEST_GATE, truncation * 0.9)
}

/// Weight of a residual under Tukey's kernel that ends at the gate.
pub(crate) fn tukey(residual: f64, gate: f64) -> f64 {
    let k = (1.0 - (residual / gate) * (residual / gate)).max(0.0);
    k * k
}

/// Distance of a point to the surface, where the point's own normal agrees with the surface's.
#[inline]
pub(crate) fn surface_distance(field: &Tsdf, q: &Point3<f32>, normal: [f32; 3]) -> Option<SurfaceDistance> {
    let (d, g) = field.distance_and_gradient(q)?;
    let length = dot(g, g).sqrt();
    if length < 0.2 || d.abs() >= field.truncation() * 0.95 {
        return None;
    }
    let unit = g.map(|c| c / length);
    (dot(unit, normal) > 0.5).then(|| SurfaceDistance { distance: f64::from(d / length.max(0.7)), normal: unit })
}

/// Robust standard deviation of the distances (1.4826 × median absolute value), metres; `None` where fewer than 50 samples
/// lie in the band.
pub(crate) fn robust_spread(field: &Tsdf, points: &[Sample], pose: &Rigid) -> Option<f64> {
    let few = every(points.len() / 1000 + 1, points);
    let mut all: Vec<f64> = distances(field, &few, pose).into_iter().flatten().map(f64::abs).collect();
    if all.len() < MIN_POINTS {
        return None;
    }
    sigma_about_zero(&mut all)
}

/// Signed distance of every sample; `None` outside the band.
fn distances(field: &Tsdf, points: &[Sample], pose: &Rigid) -> Vec<Option<f64>> {
    let rotation = pose.rotation.cast::<f32>();
    points
        .par_iter()
        .with_min_len(CHUNK)
        .map(|s| {
            let q = toile_geometry::transform_point(pose, &s.point);
            let n = rotation * Vector3::from(s.normal);
            surface_distance(field, &q, n.into()).map(|r| r.distance)
        })
        .collect()
}

/// How well the samples fit at the pose that was found.
pub(crate) fn assess(field: &Tsdf, points: &[Sample], found: Tracked) -> Tracked {
    let all = distances(field, points, &found.model_from_camera);
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
        ..found
    }
}
