//! Integration of a view into the signed distance field (Curless and Levoy 1996), block by block.

use rayon::prelude::*;
use toile_geometry::Rigid;

use crate::{
    FusionError,
    normals::dot,
    tsdf::{Block, ColorBlock, SIDE, Tsdf, VOXELS, WEIGHT_ONE, floor},
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
    /// Columns and rows of the image.
    size: [u32; 2],
    /// Depth by pixel, 0 where there is nothing to fuse, and one more 0 for points outside the image.
    depth: &'a [f32],
    /// One more than there are pixels, as `depth`.
    pixels: &'a [Pixel],
    colors: &'a [[u8; 3]],
    /// Camera coordinates of a voxel step along each axis, and of voxel 0.
    axes: [[f32; 3]; 3],
    origin: [f32; 3],
    /// Focal length and principal point of columns and of rows.
    lens: [f32; 4],
    truncation: f32,
    unit: f32,
}

/// Integrates `view` seen from `scan_from_camera`. Distances are to the plane of each pixel's surface element, so
/// that slanted surfaces do not smear; weights fall with the incidence angle and the square of the range.
/// The result does not depend on the number of threads.
///
/// # Errors
/// [`FusionError::TooLarge`] where the block index would not fit.
pub fn integrate(tsdf: &mut Tsdf, view: &View, scan_from_camera: &Rigid) -> Result<Touched, FusionError> {
    let mut pixels = surface_elements(view);
    let mut depth: Vec<f32> = pixels.iter().map(|p| if p.weight > 0.0 { p.depth } else { 0.0 }).collect();
    depth.push(0.0);
    pixels.push(Pixel::default());
    let touched = touch_blocks(tsdf, view, scan_from_camera)?;
    let count = touched.iter().filter(|t| **t).count();
    let colors = if tsdf.has_color() { view.colors.as_slice() } else { &[] };
    let projection = Projection::new(tsdf, view, scan_from_camera, &depth, &pixels, colors);
    if projection.colors.is_empty() {
        tsdf.blocks.par_chunks_mut(CHUNK).enumerate().for_each(|(c, blocks)| {
            for (k, block) in blocks.iter_mut().enumerate().filter(|(k, _)| touched[c * CHUNK + k]) {
                projection.update(tsdf.coords[c * CHUNK + k], block, None);
            }
        });
    } else {
        let both = tsdf.blocks.par_chunks_mut(CHUNK).zip(tsdf.colors.par_chunks_mut(CHUNK));
        both.enumerate().for_each(|(c, (blocks, colors))| {
            let pairs = blocks.iter_mut().zip(colors).enumerate();
            for (k, (block, color)) in pairs.filter(|(k, _)| touched[c * CHUNK + k]) {
                projection.update(tsdf.coords[c * CHUNK + k], block, Some(color));
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
            let b: [i32; 3] = std::array::from_fn(|k| floor((dot(r[k], q) + t[k]) / block_size));
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

/// Pixels that may be skipped so that neighbouring rays still fall at most half a block apart.
fn sampling_stride(view: &View, block_size: f32) -> usize {
    let total =
        view.depth.iter().filter(|d| is_measured(**d)).fold((0.0f64, 0usize), |(s, n), d| (s + f64::from(*d), n + 1));
    let mean = total.0 / total.1.max(1) as f64;
    ((f64::from(block_size) / 2.0 * view.camera.fx / mean.max(0.1)) as usize).clamp(1, 4)
}

impl<'a> Projection<'a> {
    fn new(
        tsdf: &Tsdf,
        view: &View,
        scan_from_camera: &Rigid,
        depth: &'a [f32],
        pixels: &'a [Pixel],
        colors: &'a [[u8; 3]],
    ) -> Self {
        let camera_from_scan = scan_from_camera.inverse();
        let rotation = camera_from_scan.rotation.to_rotation_matrix();
        let (size, camera) = (tsdf.voxel_size(), &view.camera);
        Self {
            size: [camera.width, camera.height],
            depth,
            pixels,
            colors,
            axes: std::array::from_fn(|k| std::array::from_fn(|r| rotation[(r, k)] as f32 * size)),
            origin: std::array::from_fn(|r| camera_from_scan.translation.vector[r] as f32),
            lens: [camera.fx as f32, camera.cx as f32, camera.fy as f32, camera.cy as f32],
            truncation: tsdf.truncation(),
            unit: tsdf.unit(),
        }
    }

    fn update(&self, coords: [i32; 3], block: &mut Block, mut color: Option<&mut ColorBlock>) {
        let base = coords.map(|c| (c * SIDE as i32) as f32);
        for row in 0..SIDE * SIDE {
            let (y, z) = (base[1] + (row % SIDE) as f32, base[2] + (row / SIDE) as f32);
            let start: [f32; 3] = std::array::from_fn(|r| {
                self.origin[r] + self.axes[0][r] * base[0] + self.axes[1][r] * y + self.axes[2][r] * z
            });
            let (index, range, any) = self.look_up(start);
            if !any {
                continue;
            }
            let (distance, weight) = self.measure(start, &index, &range);
            let sdf: &mut [i16; SIDE] = row_of(&mut block.sdf, row);
            blend(sdf, row_of(&mut block.weight, row), &distance, &weight);
            if let Some(colors) = color.as_deref_mut() {
                for x in 0..SIDE {
                    if weight[x] > 0.0 && distance[x].abs() < COLOR_BAND * f32::from(i16::MAX) {
                        blend_color(&mut colors[row * SIDE + x], self.colors[index[x] as usize], weight[x]);
                    }
                }
            }
        }
    }

    /// Pixel index (the extra one outside the image) and depth of the eight voxels of a row, and whether any of them
    /// is not hidden.
    #[inline]
    fn look_up(&self, start: [f32; 3]) -> ([u32; SIDE], [f32; SIDE], bool) {
        let step = self.axes[0];
        let [fx, cx, fy, cy] = self.lens;
        let mut range = [0.0f32; SIDE];
        let (mut columns, mut rows) = ([0i32; SIDE], [0i32; SIDE]);
        for x in 0..SIDE {
            let z = start[2] + step[2] * STEPS[x];
            let inv = 1.0 / z;
            range[x] = z;
            columns[x] = rounded(fx * (start[0] + step[0] * STEPS[x]) * inv + cx);
            rows[x] = rounded(fy * (start[1] + step[1] * STEPS[x]) * inv + cy);
        }
        let outside = (self.depth.len() - 1) as u32;
        let mut index = [outside; SIDE];
        let mut any = false;
        for x in 0..SIDE {
            let (u, v) = (columns[x] as u32, rows[x] as u32);
            if (u < self.size[0]) & (v < self.size[1]) & (range[x] > 0.05) {
                index[x] = v * self.size[0] + u;
                let depth = self.depth[index[x] as usize];
                any |= (depth > 0.0) & (range[x] - depth <= self.truncation);
            }
        }
        (index, range, any)
    }

    /// Signed distances (voxel units, capped in front) to the surface elements of a row's pixels, and their weights:
    /// 0 behind the band or where nothing was measured.
    #[inline]
    fn measure(&self, start: [f32; 3], index: &[u32; SIDE], range: &[f32; SIDE]) -> ([f32; SIDE], [f32; SIDE]) {
        let mut planes = [[0.0f32; SIDE]; 6];
        for x in 0..SIDE {
            let pixel = &self.pixels[index[x] as usize];
            planes[0][x] = pixel.normal[0];
            planes[1][x] = pixel.normal[1];
            planes[2][x] = pixel.normal[2];
            planes[3][x] = pixel.offset;
            planes[4][x] = pixel.weight;
            planes[5][x] = pixel.depth;
        }
        let (t, step, scale) = (self.truncation, self.axes[0], 1.0 / self.unit);
        let (mut distance, mut weight) = ([0.0; SIDE], [0.0; SIDE]);
        for x in 0..SIDE {
            let k = STEPS[x];
            let across = planes[0][x] * (start[0] + step[0] * k) + planes[1][x] * (start[1] + step[1] * k);
            let to_plane = across + planes[2][x] * (start[2] + step[2] * k) - planes[3][x];
            let ahead = planes[5][x] - range[x];
            let far = if ahead > 4.0 * t { t } else { to_plane };
            let d = if far > t { t } else { far };
            let counts = (ahead >= -t) & (d > -t);
            distance[x] = d * scale;
            weight[x] = if counts { planes[4][x] } else { 0.0 };
        }
        (distance, weight)
    }
}

/// Voxel steps along a row.
const STEPS: [f32; SIDE] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

#[inline]
fn row_of<T>(values: &mut [T; VOXELS], row: usize) -> &mut [T; SIDE] {
    let (rows, _) = values.as_chunks_mut::<SIDE>();
    &mut rows[row]
}

/// Adding 1.5 · 2²³ puts a float's rounded value into its low bits: conversion without a branch.
const ROUNDER: f32 = 12_582_912.0;

#[inline]
fn rounded(x: f32) -> i32 {
    ((x + ROUNDER).to_bits() as i32).wrapping_sub(ROUNDER.to_bits() as i32)
}

/// Running weighted means of a row.
#[inline]
fn blend(sdf: &mut [i16; SIDE], weights: &mut [u16; SIDE], distance: &[f32; SIDE], weight: &[f32; SIDE]) {
    for x in 0..SIDE {
        let old = f32::from(weights[x]);
        let sum = old + weight[x];
        let value = (f32::from(sdf[x]) * old + distance[x] * weight[x]) / (sum + 1e-9);
        sdf[x] = rounded(value) as i16;
        weights[x] = rounded(if sum > 65535.0 { 65535.0 } else { sum }) as u16;
    }
}

#[inline]
fn blend_color(voxel: &mut [u16; 4], color: [u8; 3], weight: f32) {
    if color == [0; 3] {
        return;
    }
    let old = f32::from(voxel[3]);
    let sum = old + weight;
    let share = 1.0 / sum;
    for k in 0..3 {
        let value = (f32::from(voxel[k]) * old + f32::from(color[k]) * 256.0 * weight) * share;
        voxel[k] = rounded(value) as u16;
    }
    voxel[3] = rounded(if sum > 65535.0 { 65535.0 } else { sum }) as u16;
}
