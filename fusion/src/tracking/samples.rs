//! The weighted points of a frame that registrations use.

use nalgebra::{Point3, Vector3};
use toile_geometry::Rigid;

use crate::frame::{DepthView, dot};

/// A weighted point of a frame, camera frame.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Position, metres.
    pub point: Point3<f32>,
    /// Unit normal towards the camera.
    pub normal: [f32; 3],
    /// Relative weight: falls with the incidence angle and the noise of the range.
    pub weight: f32,
}

/// Samples of a view, thinned to about `count`.
pub fn samples(view: &DepthView, count: usize) -> Vec<Sample> {
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

/// Every `step`-th sample from the first on.
pub(crate) fn every(step: usize, points: &[Sample]) -> Vec<Sample> {
    points.iter().step_by(step).copied().collect()
}

/// Mean position of the samples in the model's frame; the pose itself where there are none.
pub(crate) fn centroid(points: &[Sample], pose: &Rigid) -> Point3<f64> {
    let sum: Vector3<f64> = points.iter().map(|s| s.point.coords.cast::<f64>()).sum();
    pose * Point3::from(sum / points.len().max(1) as f64)
}
