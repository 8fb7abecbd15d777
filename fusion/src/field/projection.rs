//! The voxel grid seen from a camera.

use toile_geometry::{Rigid, element::Element};

use super::{block::SIDE, tsdf::Tsdf};
use crate::frame::{DepthView, PAGE};

/// Voxels nearer to the camera than this are not updated, metres.
const NEAREST: f32 = 0.02;

/// A view's image and where the voxels lie in it.
pub(crate) struct Projection<'a> {
    pub elements: &'a [Element],
    /// Width and height of the image, pixels.
    pub size: [usize; 2],
    /// Camera coordinates (x and y times the focal lengths) of a voxel step along each axis, and of voxel 0.
    pub axes: [[f32; 3]; 3],
    pub origin: [f32; 3],
    /// Principal point, and widths of a pixel at unit depth.
    pub center: [f32; 2],
    pub pitch: [f32; 2],
    /// Elements nearer than this are not fused, so that no voxel of a touched block lies beside or behind the camera.
    pub nearest: f32,
    /// Weights do not fall with the incidence angle.
    pub is_even: bool,
    /// The field's: metres, and metres a unit of its distances.
    pub truncation: f32,
    pub voxel_size: f32,
    pub unit: f32,
    /// Distance from a block's centre to its farthest voxel, metres.
    pub block_radius: f32,
}

impl<'a> Projection<'a> {
    pub(crate) fn new(tsdf: &Tsdf, view: &'a DepthView, model_from_camera: &Rigid) -> Self {
        let camera_from_model = model_from_camera.inverse();
        let rotation = camera_from_model.rotation.to_rotation_matrix();
        let (voxel, camera) = (tsdf.voxel_size(), &view.camera);
        let focal = [camera.fx, camera.fy, 1.0];
        Self {
            elements: &view.elements,
            size: [camera.width as usize, camera.height as usize],
            axes: std::array::from_fn(|k| {
                std::array::from_fn(|r| (rotation[(r, k)] * focal[r] * f64::from(voxel)) as f32)
            }),
            origin: std::array::from_fn(|r| (camera_from_model.translation.vector[r] * focal[r]) as f32),
            center: [camera.cx as f32, camera.cy as f32],
            pitch: [1.0 / camera.fx as f32, 1.0 / camera.fy as f32],
            nearest: NEAREST + tsdf.truncation() + 2.0 * SIDE as f32 * voxel,
            is_even: tsdf.is_even(),
            truncation: tsdf.truncation(),
            voxel_size: voxel,
            unit: tsdf.unit(),
            block_radius: 0.5 * 3f32.sqrt() * (SIDE - 1) as f32 * voxel,
        }
    }

    /// Camera coordinates (x and y times the focal lengths) of a point of the voxel grid.
    #[inline(always)]
    pub(crate) fn camera_point(&self, voxel: [f32; 3]) -> [f32; 3] {
        let [a, b, c] = &self.axes;
        std::array::from_fn(|r| self.origin[r] + a[r] * voxel[0] + b[r] * voxel[1] + c[r] * voxel[2])
    }

    /// Index of the first of [`PAGE`] pixels among which all those lie that see the block around a camera point;
    /// `None` where they are too many.
    #[inline(always)]
    pub(crate) fn page(&self, center: [f32; 3]) -> Option<usize> {
        let radius = self.block_radius;
        // Pixels, with one more for rounding.
        let reach = radius / ((center[2] - radius) * self.pitch[1]) + 1.5;
        let rows = 2.0 * reach + 2.0;
        if !(rows > 0.0 && rows * self.size[0] as f32 <= PAGE as f32) {
            return None;
        }
        let top = center[1] / center[2] + self.center[1] - reach;
        let row = if top > 0.0 { top as usize } else { 0 };
        Some((row * self.size[0]).min(self.elements.len() - PAGE))
    }
}
