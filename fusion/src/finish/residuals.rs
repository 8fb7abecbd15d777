//! How far the pixels of a frame lie from the whole model, each along its own ray: what the sensor's noise really is.

use nalgebra::{Point3, Vector3};
use toile_geometry::{Rigid, element::Element};

use crate::{
    field::{Tsdf, ray_cast},
    frame::{DepthView, unproject},
    tracking::NormalEquations,
};

/// A pixel is compared where the model is seen less obliquely than this (cosine).
const OBLIQUE: f32 = 0.1;
/// A pixel farther from the model than this share of the band sees something else: another surface, or nothing real.
const ANOTHER: f32 = 3.0;
/// A pixel counts as at most this share of the band from the model, so that noise of any width lies within the band and is
/// cut on both sides alike: the mean over frames is then that of Huber (1964), and has no bias.
const LIMIT: f32 = 0.6;

/// A pixel and the model's surface on its ray, camera frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    /// Index of the pixel.
    pub pixel: usize,
    /// Depth of the model, metres.
    pub depth: f32,
    /// The model's unit normal, towards the camera.
    pub normal: [f32; 3],
    /// Cosine between the normal and the ray of unit depth, times that ray's length.
    pub facing: f32,
    /// How much farther the pixel lies, along the normal, metres.
    pub distance: f32,
}

/// Compares every `stride`-th row and column of a view with the model.
pub(crate) fn residuals(view: &DepthView, field: &Tsdf, model_from_camera: &Rigid, stride: usize) -> Vec<Residual> {
    let camera_from_model = model_from_camera.inverse();
    let turn = camera_from_model.rotation.cast::<f32>();
    let model = ray_cast(field, &view.camera, model_from_camera, stride);
    let width = view.camera.width as usize;
    let residual = |(k, hit): (usize, &Option<_>)| {
        let hit: &crate::field::Hit = hit.as_ref()?;
        let (u, v) = (k % model.width * stride, k / model.width * stride);
        let element = view.elements[v * width + u];
        let depth = (camera_from_model * Point3::from(hit.point).cast::<f64>()).z as f32;
        let normal = turn * Vector3::from(hit.normal);
        let [x, y, _] = unproject(&view.camera, u as f32, v as f32, 1.0);
        let facing = -(normal.x * x + normal.y * y + normal.z);
        let distance = (element.depth() - depth) * facing;
        let is_same = element.is_some() && facing > OBLIQUE && distance.abs() < ANOTHER * field.truncation();
        is_same.then_some(Residual { pixel: v * width + u, depth, normal: normal.into(), facing, distance })
    };
    model.hits.iter().enumerate().filter_map(residual).collect()
}

/// Moves pixels that lie far from the model towards it, and gives all that were compared the model's normals, which are
/// steadier than those of a noisy frame. What the model does not have stays as it was measured.
pub(crate) fn settle(view: &mut DepthView, residuals: &[Residual], truncation: f32) {
    let limit = LIMIT * truncation;
    for r in residuals {
        let moved = r.depth + r.distance.clamp(-limit, limit) / r.facing;
        let [nx, ny, _] = r.normal;
        view.elements[r.pixel] = Element::new(moved, -r.facing.min(2.0), [nx, ny]);
    }
}

/// Normal equations of the motion that brings a frame onto the model. Noise lies along the rays and the pixels are compared
/// along them, so that it does not push frames into a curved surface, as it does where noisy points look for the nearest
/// place of the surface.
pub(crate) fn equations(
    view: &DepthView,
    residuals: &[Residual],
    model_from_camera: &Rigid,
    center: &Point3<f64>,
    gate: f32,
) -> NormalEquations {
    let turn = model_from_camera.rotation.cast::<f32>();
    let width = view.camera.width as usize;
    let mut sum = NormalEquations::zero();
    for r in residuals.iter().filter(|r| r.distance.abs() < gate) {
        let [x, y, _] = unproject(&view.camera, (r.pixel % width) as f32, (r.pixel / width) as f32, 1.0);
        let point = Point3::new(x, y, 1.0) * r.depth;
        let q = toile_geometry::transform_point(model_from_camera, &point);
        let normal = turn * Vector3::from(r.normal);
        let kernel = 1.0 - (r.distance / gate) * (r.distance / gate);
        // The farther pixel lies inside the model: its distance along the outward normal is negative.
        sum.add(&q, center, normal.into(), f64::from(-r.distance), f64::from(kernel * kernel));
    }
    sum
}
