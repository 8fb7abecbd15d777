//! The part of space that the subject takes up, and the cut to it.

use toile_geometry::{
    Rigid,
    camera::PinholeCamera,
    lanes::floats::{Kernel, LANES, Lanes, dispatch, group, put_group},
};

use super::{floor::Floor, upright::ImageSide};
use crate::frame::unproject;

/// The part of space that is fused, in the model's frame: +Y up, +Z towards the camera at the first frame, origin
/// on the axis of the turn at the floor's (or lowest moving point's) height.
#[derive(Debug, Clone, PartialEq)]
pub struct SubjectVolume {
    /// The pose of the resting camera before the subject has turned.
    pub model_from_camera: Rigid,
    /// Radius of the cylinder, metres.
    pub radius: f64,
    /// Points below this height are floor or disk; `None` where no floor is in view.
    pub bottom: Option<f64>,
    /// The floor plane, camera frame.
    pub floor: Option<Floor>,
    /// The side of the image that is up.
    pub image_up: ImageSide,
}

impl SubjectVolume {
    /// Depth with everything outside the volume taken away.
    pub fn cut(&self, camera: &PinholeCamera, depth: &[f32]) -> Vec<f32> {
        dispatch(Cut { volume: self, camera, depth })
    }
}

struct Cut<'a> {
    volume: &'a SubjectVolume,
    camera: &'a PinholeCamera,
    depth: &'a [f32],
}

impl Kernel for Cut<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Vec<f32> {
        let (camera, width) = (self.camera, self.camera.width as usize);
        let rotation = self.volume.model_from_camera.rotation.to_rotation_matrix();
        let turn: [[f32; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)] as f32));
        let shift: [f32; 3] = self.volume.model_from_camera.translation.vector.cast::<f32>().into();
        let bottom = l.splat(self.volume.bottom.map_or(f32::NEG_INFINITY, |b| b as f32));
        let reach = l.splat((self.volume.radius * self.volume.radius) as f32);
        let rays: Vec<f32> = (0..width).map(|u| unproject(camera, u as f32, 0.0, 1.0)[0]).collect();
        let mut cut = vec![0.0; self.depth.len()];
        for (v, (row, out)) in self.depth.chunks(width.max(1)).zip(cut.chunks_mut(width.max(1))).enumerate() {
            let y = unproject(camera, 0.0, v as f32, 1.0)[1];
            for x in (0..width).step_by(LANES) {
                let d = l.load(&group(row, x));
                if !l.any(l.gt(d, l.splat(0.0))) {
                    continue;
                }
                let ray = l.load(&group(&rays, x));
                let px = coordinate(l, turn[0], shift[0], ray, y, d);
                let py = coordinate(l, turn[1], shift[1], ray, y, d);
                let pz = coordinate(l, turn[2], shift[2], ray, y, d);
                let within = l.gt(reach, l.add(l.mul(px, px), l.mul(pz, pz)));
                put_group(out, x, l.store(l.keep(l.and(within, l.gt(py, bottom)), d)));
            }
        }
        cut
    }
}

/// One coordinate of the points at depths along rays, from its row of a transform.
#[inline(always)]
fn coordinate<L: Lanes>(l: L, turn: [f32; 3], shift: f32, ray: L::F, y: f32, depth: L::F) -> L::F {
    let across = l.add(l.mul(ray, l.splat(turn[0])), l.splat(turn[1] * y + turn[2]));
    l.add(l.mul(across, depth), l.splat(shift))
}
