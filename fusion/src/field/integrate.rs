//! Integration of a view into the signed distance field (Curless and Levoy 1996), octant by octant.

use rayon::prelude::*;
use toile_geometry::{
    Rigid,
    lanes::floats::{Kernel, Lanes, dispatch},
};

use super::{
    band::touch,
    block::{Block, ColorBlock, SIDE},
    layers::{Layers, Touched},
    pixels::{Everywhere, Page},
    projection::Projection,
    tsdf::Tsdf,
};
use crate::{FusionError, frame::DepthView};

/// Blocks of a parallel task.
const CHUNK: usize = 32;
/// Voxels from a block's first to its centre along each axis.
const HALF_BLOCK: f32 = 0.5 * (SIDE - 1) as f32;

/// Integrates `view` seen from `model_from_camera`. Distances are to the plane of each pixel's surface element, so
/// that slanted surfaces do not smear; weights fall with the incidence angle and the square of the range.
/// The result does not depend on the number of threads, nor on the machine's instruction set.
///
/// # Errors
/// [`FusionError::TooLarge`] where the block index would not fit.
pub fn integrate(tsdf: &mut Tsdf, view: &DepthView, model_from_camera: &Rigid) -> Result<Touched, FusionError> {
    let projection = Projection::new(tsdf, view, model_from_camera);
    let touched = touch(tsdf, view, model_from_camera, &projection)?;
    let (coords, touched, projection) = (&tsdf.coords, &touched, &projection);
    let all = if view.colors.is_empty() || !tsdf.has_color() {
        let chunks = tsdf.blocks.par_chunks_mut(CHUNK).enumerate();
        let update =
            |(chunk, blocks)| dispatch(UpdateBlocks { projection, coords, touched, chunk, blocks, colors: None });
        chunks.map(update).reduce(Touched::default, Touched::plus)
    } else {
        let both = tsdf.blocks.par_chunks_mut(CHUNK).zip(tsdf.colors.par_chunks_mut(CHUNK));
        let update = |(chunk, (blocks, fields))| {
            let colors = Some((fields, view.colors.as_slice()));
            dispatch(UpdateBlocks { projection, coords, touched, chunk, blocks, colors })
        };
        both.enumerate().map(update).reduce(Touched::default, Touched::plus)
    };
    Ok(all)
}

/// The touched ones of a chunk of blocks.
struct UpdateBlocks<'a> {
    projection: &'a Projection<'a>,
    coords: &'a [[i32; 3]],
    touched: &'a [bool],
    chunk: usize,
    blocks: &'a mut [Block],
    /// The blocks' colours and the pixels'.
    colors: Option<(&'a mut [ColorBlock], &'a [[u8; 4]])>,
}

impl Kernel for UpdateBlocks<'_> {
    type Output = Touched;

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) -> Touched {
        let first = self.chunk * CHUNK;
        let layers = Layers::new(l, self.projection);
        let mut sum = Touched::default();
        for (k, block) in self.blocks.iter_mut().enumerate().filter(|(k, _)| self.touched[first + k]) {
            let colors = self.colors.as_mut().map(|(fields, pixels)| (&mut fields[k], *pixels));
            let at = self.coords[first + k].map(|c| c * SIDE as i32);
            let center = self.projection.camera_point(at.map(|c| c as f32 + HALF_BLOCK));
            sum = sum.plus(match self.projection.page(center) {
                Some(first) => layers.update_block(Page(first), at, center[2], block, colors),
                None => layers.update_block(Everywhere, at, center[2], block, colors),
            });
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};
    use toile_geometry::{Rigid, camera::PinholeCamera};

    use toile_geometry::lanes::floats::Scalar;

    use super::*;
    use crate::field::block::{VOXELS, local_index};

    /// A slanted wall with a hole, seen from a turned camera.
    fn wall(focal: f64) -> (DepthView, Rigid) {
        let camera = PinholeCamera::ideal(120, 90, focal, focal, 59.5, 44.5);
        let depth = |i: usize| {
            let (u, v) = (i % 120, i / 120);
            let hole = (50..58).contains(&u) && (30..50).contains(&v);
            let ray = [(u as f64 - 59.5) / focal, (v as f64 - 44.5) / focal];
            if hole { 0.0 } else { (1.5 / (1.0 - 0.5 * ray[0] - 0.3 * ray[1])) as f32 }
        };
        let depth: Vec<f32> = (0..120 * 90).map(depth).collect();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.2, 2.4, -0.3));
        (DepthView::new(&camera, &depth, 2), Rigid::from_parts(Translation3::new(0.4, 0.9, -0.2), turn))
    }

    /// Every voxel of touched blocks about which a pixel says something within the band is updated: compared with a plain
    /// loop over all voxels. The rim may be a voxel off.
    #[test]
    fn slabs_in_the_band_hold_all_voxels_in_the_band() {
        for focal in [110.0, 200.0, 400.0] {
            let (view, pose) = wall(focal);
            let mut field = Tsdf::new(0.012, 0.048, false);
            integrate(&mut field, &view, &pose).unwrap();
            let (camera_from_model, mut inside) = (pose.inverse(), 0);
            for (block, at) in field.blocks.iter().zip(&field.coords) {
                for k in 0..VOXELS as i32 {
                    let v = [k & 7, k >> 3 & 7, k >> 6].map(f64::from);
                    let p: nalgebra::Point3<f64> =
                        std::array::from_fn(|i| (f64::from(8 * at[i]) + v[i]) * 0.012).into();
                    let q = camera_from_model * p;
                    let pixel = [q.x / q.z * focal + 59.5, q.y / q.z * focal + 44.5].map(f64::round);
                    if !(5.0..115.0).contains(&pixel[0]) || !(5.0..85.0).contains(&pixel[1]) {
                        continue;
                    }
                    let at_pixel = pixel[1] as usize * 120 + pixel[0] as usize;
                    let element = view.elements[at_pixel];
                    let around = (0..81).map(|d| at_pixel + d % 9 + d / 9 * 120 - 4 * 121);
                    let within = around.into_iter().all(|i| view.elements[i].is_some());
                    if within && (f64::from(element.depth()) - q.z).abs() < 0.047 {
                        let index = local_index([k & 7, k >> 3 & 7, k >> 6]);
                        let facts = (element.parts(), q.z, pixel);
                        assert!(block.weight[index] > 0, "{p} of focal length {focal}: {facts:?}");
                        inside += 1;
                    }
                }
            }
            assert!(inside > 1000, "{inside} with focal length {focal}");
        }
    }

    #[test]
    fn lanes_of_any_kind_fuse_the_same_field() {
        let (view, pose) = wall(110.0);
        let mut field = Tsdf::new(0.006, 0.024, false);
        integrate(&mut field, &view, &pose).unwrap();
        let projection = Projection::new(&field, &view, &pose);
        let mut changed = 0;
        for (found, at) in field.blocks.iter().zip(&field.coords) {
            let mut plain = Block::EMPTY;
            let blocks = std::slice::from_mut(&mut plain);
            let (coords, touched) = (&[*at][..], &[true][..]);
            let kernel = UpdateBlocks { projection: &projection, coords, touched, chunk: 0, blocks, colors: None };
            changed += kernel.run(Scalar).updated;
            assert!(plain.sdf == found.sdf && plain.weight == found.weight, "block {at:?}");
        }
        assert!(changed > 2000);
    }
}
