//! Frame-to-model tracking: projective point-to-plane against the ray-cast model to come near, then the registration to
//! the distance field.

use nalgebra::Point3;
use toile_geometry::Rigid;

use super::{
    equations::{Residual, accumulate},
    registration::{MIN_POINTS, register, tukey},
    samples::{Sample, centroid, every, samples},
    tracked::Tracked,
};
use crate::{
    field::{Hit, ModelView, Tsdf, ray_cast},
    frame::{DepthView, dot},
};

/// About how many points the registration uses.
const FINE_POINTS: usize = 4000;
/// About how many points the approach uses.
const COARSE_POINTS: usize = 1500;
/// Smallest overlap, and share of inliers, at which a registration without an approach is believed.
const NEAR_OVERLAP: f64 = 0.8;
const NEAR_INLIERS: f64 = 0.7;
/// Distance gates of the approach's iterations, metres.
const GATES: [f64; 7] = [0.10, 0.08, 0.06, 0.05, 0.04, 0.03, 0.03];
/// Pixels between rays of the ray-cast model, and images with more pixels than this get along with fewer rays.
const STRIDES: [usize; 2] = [3, 4];
const LARGE_IMAGE: usize = 60_000;
/// Smallest cosine between a point's normal and that of the hit it belongs to.
const MIN_COSINE: f32 = 0.6;

/// Registers a view to the model from a predicted pose: against the distance field at once where that pose lies well
/// within its band, else after an approach.
pub fn track(field: &Tsdf, view: &DepthView, predicted: &Rigid) -> Tracked {
    let points = samples(view, FINE_POINTS);
    let near = register(field, &points, predicted);
    if near.converged && near.overlap > NEAR_OVERLAP && near.inliers > NEAR_INLIERS {
        return near;
    }
    let stride = STRIDES[usize::from(view.pixels() > LARGE_IMAGE)];
    let model = ray_cast(field, &view.camera, predicted, stride);
    register(field, &points, &approach(&model, predicted, &points, predicted))
}

/// The pose that brings the samples onto the model view rendered from `rendered_at`.
pub fn approach(model: &ModelView, rendered_at: &Rigid, points: &[Sample], start: &Rigid) -> Rigid {
    let mut pose = *start;
    let camera_from_model = rendered_at.inverse();
    let few = every((points.len() / COARSE_POINTS).max(1), points);
    for gate in GATES {
        let center = centroid(&few, &pose);
        let system = accumulate(&few, &pose, &center, |_, q, n| {
            let hit = associate(model, &camera_from_model, q, n, gate)?;
            let r = f64::from(dot(hit.normal, [q.x - hit.point[0], q.y - hit.point[1], q.z - hit.point[2]]));
            Some(Residual { value: r, gradient: hit.normal, kernel: tukey(r, gate) })
        });
        if system.count < MIN_POINTS {
            break;
        }
        pose = system.step(&center, 1e-4).motion * pose;
    }
    pose
}

/// The hit of the ray that passes nearest to a point (model frame), where it lies within the gate and faces the same way.
fn associate(
    model: &ModelView,
    camera_from_model: &Rigid,
    q: &Point3<f32>,
    normal: [f32; 3],
    gate: f64,
) -> Option<Hit> {
    let p = camera_from_model * q.cast::<f64>();
    let pixel = model.camera.project(&p)?;
    let s = model.stride as f64;
    let (u, v) = ((pixel.x / s).round(), (pixel.y / s).round());
    if u < 0.0 || v < 0.0 || u >= model.width as f64 || v >= model.height as f64 {
        return None;
    }
    let hit = model.hits[v as usize * model.width + u as usize]?;
    let d = [q.x - hit.point[0], q.y - hit.point[1], q.z - hit.point[2]];
    (f64::from(dot(d, d)) < gate * gate && dot(hit.normal, normal) > MIN_COSINE).then_some(hit)
}
