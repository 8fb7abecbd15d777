//! Integration of a view into the signed distance field (Curless and Levoy 1996), block by block.

use rayon::prelude::*;
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{
    FusionError,
    normals::dot,
    tsdf::{Block, ColorBlock, SIDE, Tsdf, Voxel, WEIGHT_ONE},
    view::{View, is_measured},
};

/// Colour is taken in this share of the truncation band.
const COLOR_BAND: f32 = 0.6;
/// Blocks of a parallel task.
const CHUNK: usize = 32;

/// What an integration touched.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Touched {
    /// Blocks in the frame's truncation band.
    pub blocks: usize,
}

/// What one pixel says: the plane of its surface element and its weight.
#[derive(Debug, Clone, Copy, Default)]
struct Pixel {
    depth: f32,
    normal: [f32; 3],
    /// normal · point.
    offset: f32,
    weight: f32,
}

/// The voxel grid seen from the camera.
struct Projection<'a> {
    camera: &'a PinholeCamera,
    pixels: &'a [Pixel],
    colors: &'a [[u8; 3]],
    /// Columns of camera_from_scan times voxel size, then the translation.
    axes: [[f32; 3]; 3],
    origin: [f32; 3],
    truncation: f32,
}

/// Integrates `view` seen from `scan_from_camera`. Distances are to the plane of each pixel's surface element, so
/// that slanted surfaces do not smear; weights fall with the incidence angle and the square of the range.
/// The result does not depend on the number of threads.
///
/// # Errors
/// [`FusionError::TooLarge`] where the block index would not fit.
pub fn integrate(tsdf: &mut Tsdf, view: &View, scan_from_camera: &Rigid) -> Result<Touched, FusionError> {
    let pixels = surface_elements(view);
    let touched = touch_blocks(tsdf, view, scan_from_camera)?;
    let count = touched.iter().filter(|t| **t).count();
    let camera_from_scan = scan_from_camera.inverse();
    let rotation = camera_from_scan.rotation.to_rotation_matrix();
    let size = tsdf.voxel_size();
    let projection = Projection {
        camera: &view.camera,
        pixels: &pixels,
        colors: if tsdf.has_color() { &view.colors } else { &[] },
        axes: std::array::from_fn(|k| std::array::from_fn(|r| rotation[(r, k)] as f32 * size)),
        origin: std::array::from_fn(|r| camera_from_scan.translation.vector[r] as f32),
        truncation: tsdf.truncation(),
    };
    let unit = tsdf.unit();
    if projection.colors.is_empty() {
        tsdf.blocks.par_chunks_mut(CHUNK).enumerate().for_each(|(c, blocks)| {
            for (k, block) in blocks.iter_mut().enumerate().filter(|(k, _)| touched[c * CHUNK + k]) {
                update_block(&projection, tsdf.coords[c * CHUNK + k], block, None, unit);
            }
        });
    } else {
        let both = tsdf.blocks.par_chunks_mut(CHUNK).zip(tsdf.colors.par_chunks_mut(CHUNK));
        both.enumerate().for_each(|(c, (blocks, colors))| {
            let pairs = blocks.iter_mut().zip(colors).enumerate();
            for (k, (block, color)) in pairs.filter(|(k, _)| touched[c * CHUNK + k]) {
                update_block(&projection, tsdf.coords[c * CHUNK + k], block, Some(color), unit);
            }
        });
    }
    Ok(Touched { blocks: count })
}

fn surface_elements(view: &View) -> Vec<Pixel> {
    let element = |i: usize| {
        let depth = view.depth[i];
        if !is_measured(depth) {
            return Pixel { depth, ..Pixel::default() };
        }
        let (p, n) = (view.point(i), view.normals[i]);
        if n == [0.0; 3] {
            return Pixel::default();
        }
        let cosine = -dot(n, p) / dot(p, p).sqrt().max(1e-6);
        let weight = (WEIGHT_ONE * cosine * cosine / (depth * depth).max(0.25)).clamp(1.0, WEIGHT_ONE * 4.0);
        Pixel { depth, normal: n, offset: dot(n, p), weight }
    };
    (0..view.depth.len()).map(element).collect()
}

/// Marks, and makes where missing, the blocks within the truncation band of the measured pixels.
fn touch_blocks(tsdf: &mut Tsdf, view: &View, scan_from_camera: &Rigid) -> Result<Vec<bool>, FusionError> {
    let block_size = tsdf.voxel_size() * SIDE as f32;
    let rotation = scan_from_camera.rotation.to_rotation_matrix();
    let r: [[f32; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)] as f32));
    let t: [f32; 3] = std::array::from_fn(|i| scan_from_camera.translation.vector[i] as f32);
    let band = tsdf.truncation() + tsdf.voxel_size();
    let steps = (2.0 * band / (0.5 * block_size)).ceil() as i32;
    let mut marks: Vec<[i32; 3]> = Vec::new();
    for i in view.samples(sampling_stride(view, block_size)) {
        let p = view.point(i);
        let depth = view.depth[i];
        let mut last = [i32::MIN; 3];
        for s in 0..=steps {
            let scale = 1.0 + (band * (2.0 * s as f32 / steps as f32 - 1.0)) / depth;
            let q = p.map(|c| c * scale);
            let b: [i32; 3] = std::array::from_fn(|k| ((dot(r[k], q) + t[k]) / block_size).floor() as i32);
            if b != last {
                marks.push(b);
                last = b;
            }
        }
    }
    if let Some(&first) = marks.first() {
        let bounds = |(lo, hi): ([i32; 3], [i32; 3]), b: &[i32; 3]| {
            (std::array::from_fn(|k| lo[k].min(b[k])), std::array::from_fn(|k| hi[k].max(b[k])))
        };
        let (lo, hi) = marks.iter().fold((first, first), bounds);
        tsdf.cover(lo, hi)?;
    }
    let mut touched = vec![false; tsdf.block_count()];
    for b in marks {
        let slot = tsdf.slot_or_new(b) as usize;
        if slot >= touched.len() {
            touched.resize(slot + 1, false);
        }
        touched[slot] = true;
    }
    Ok(touched)
}

/// Pixels that may be skipped so that neighbouring rays still fall at most a third of a block apart.
fn sampling_stride(view: &View, block_size: f32) -> usize {
    let nearest_third = view.depth.iter().filter(|d| is_measured(**d)).fold((0.0f64, 0usize), |(s, n), d| {
        (s + f64::from(*d), n + 1)
    });
    let mean = nearest_third.0 / nearest_third.1.max(1) as f64;
    ((f64::from(block_size) / 3.0 * view.camera.fx / mean.max(0.1)) as usize).clamp(1, 4)
}

fn update_block(
    projection: &Projection,
    coords: [i32; 3],
    block: &mut Block,
    mut color: Option<&mut ColorBlock>,
    unit: f32,
) {
    let base = coords.map(|c| (c * SIDE as i32) as f32);
    for z in 0..SIDE {
        for y in 0..SIDE {
            let v = [base[0], base[1] + y as f32, base[2] + z as f32];
            let start: [f32; 3] = std::array::from_fn(|r| {
                projection.origin[r]
                    + projection.axes[0][r] * v[0]
                    + projection.axes[1][r] * v[1]
                    + projection.axes[2][r] * v[2]
            });
            let row = z * 64 + y * 8;
            for x in 0..SIDE {
                let p: [f32; 3] = std::array::from_fn(|r| start[r] + projection.axes[0][r] * x as f32);
                if let Some((distance, weight, pixel)) = measure(projection, p) {
                    blend(&mut block[row + x], distance / unit, weight);
                    if let Some(colors) = color.as_deref_mut().filter(|_| distance.abs() < COLOR_BAND * projection.truncation)
                    {
                        blend_color(&mut colors[row + x], projection.colors[pixel], weight);
                    }
                }
            }
        }
    }
}

/// Distance of a camera-frame point to the surface element on its ray, the element's weight and pixel.
#[inline]
fn measure(projection: &Projection, p: [f32; 3]) -> Option<(f32, f32, usize)> {
    if p[2] <= 0.05 {
        return None;
    }
    let camera = projection.camera;
    let inv = 1.0 / p[2];
    let u = (camera.fx as f32 * p[0] * inv + camera.cx as f32 + 0.5).floor();
    let v = (camera.fy as f32 * p[1] * inv + camera.cy as f32 + 0.5).floor();
    if u < 0.0 || v < 0.0 || u >= camera.width as f32 || v >= camera.height as f32 {
        return None;
    }
    let i = v as usize * camera.width as usize + u as usize;
    let pixel = &projection.pixels[i];
    if pixel.weight == 0.0 {
        return None;
    }
    let behind = p[2] - pixel.depth;
    let t = projection.truncation;
    if behind > t {
        return None;
    }
    if behind < -4.0 * t {
        return Some((t, pixel.weight, i));
    }
    let distance = dot(pixel.normal, p) - pixel.offset;
    (distance > -t).then(|| (distance.min(t), pixel.weight, i))
}

#[inline]
fn blend(voxel: &mut Voxel, sdf: f32, weight: f32) {
    let old = f32::from(voxel.weight);
    let sum = old + weight;
    let value = (f32::from(voxel.sdf) * old + sdf * weight) / sum;
    voxel.sdf = (value + 0.5).floor() as i16;
    voxel.weight = (sum + 0.5).min(f32::from(u16::MAX)) as u16;
}

#[inline]
fn blend_color(voxel: &mut [u16; 4], color: [u8; 3], weight: f32) {
    if color == [0; 3] {
        return;
    }
    let old = f32::from(voxel[3]);
    let sum = old + weight;
    for k in 0..3 {
        let value = (f32::from(voxel[k]) * old + f32::from(color[k]) * 256.0 * weight) / sum;
        voxel[k] = (value + 0.5) as u16;
    }
    voxel[3] = (sum + 0.5).min(f32::from(u16::MAX)) as u16;
}
