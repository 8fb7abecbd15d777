//! Integration of a view into the signed distance field (Curless and Levoy 1996), block by block.

use rayon::prelude::*;
use toile_geometry::Rigid;

use crate::{
    FusionError,
    lanes::{Kernel, LANES, Lanes, dispatch},
    normals::{Element, dot},
    tsdf::{Block, ColorBlock, SIDE, Tsdf, VOXELS, WEIGHT_ONE, floor},
    view::View,
};

/// Colour is taken this far from the surface, voxels: what extraction reads, and a little for surfaces that move.
const COLOR_VOXELS: f32 = 2.0;
/// Voxels nearer to the camera than this are not updated, metres.
const NEAREST: f32 = 0.02;
/// Blocks of a parallel task.
const CHUNK: usize = 32;

/// What an integration touched.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Touched {
    /// Blocks in the frame's truncation band.
    pub blocks: usize,
    /// Voxels whose values the frame changed, in steps of two rows.
    pub updated: usize,
}

/// Integrates `view` seen from `scan_from_camera`. Distances are to the plane of each pixel's surface element, so
/// that slanted surfaces do not smear; weights fall with the incidence angle and the square of the range.
/// The result does not depend on the number of threads, nor on the machine's instruction set.
///
/// # Errors
/// [`FusionError::TooLarge`] where the block index would not fit.
pub fn integrate(tsdf: &mut Tsdf, view: &View, scan_from_camera: &Rigid) -> Result<Touched, FusionError> {
    let touched = touch_blocks(tsdf, view, scan_from_camera)?;
    let projection = Projection::new(tsdf, view, scan_from_camera);
    let (coords, touched) = (&tsdf.coords, &touched);
    let updated = if view.colors.is_empty() || !tsdf.has_color() {
        let chunks = tsdf.blocks.par_chunks_mut(CHUNK).enumerate();
        let update = |(chunk, blocks)| {
            dispatch(UpdateBlocks { projection: &projection, coords, touched, chunk, blocks, colors: None })
        };
        chunks.map(update).sum()
    } else {
        let both = tsdf.blocks.par_chunks_mut(CHUNK).zip(tsdf.colors.par_chunks_mut(CHUNK));
        let update = |(chunk, (blocks, fields))| {
            let colors = Some((fields, view.colors.as_slice()));
            dispatch(UpdateBlocks { projection: &projection, coords, touched, chunk, blocks, colors })
        };
        both.enumerate().map(update).sum()
    };
    Ok(Touched { blocks: touched.iter().filter(|t| **t).count(), updated })
}

/// Marks, and makes where missing, the blocks within the truncation band of the elements.
fn touch_blocks(tsdf: &mut Tsdf, view: &View, scan_from_camera: &Rigid) -> Result<Vec<bool>, FusionError> {
    let block_size = tsdf.voxel_size() * SIDE as f32;
    let rotation = scan_from_camera.rotation.to_rotation_matrix();
    let r: [[f32; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)] as f32 / block_size));
    let t: [f32; 3] = std::array::from_fn(|i| scan_from_camera.translation.vector[i] as f32 / block_size);
    let band = tsdf.truncation() + tsdf.voxel_size();
    let steps = (2.0 * band / (0.5 * block_size)).ceil() as i32;
    let nearest = nearest_depth(tsdf);
    let mut marks: Vec<[i32; 3]> = Vec::new();
    let mut last = [i32::MIN; 3];
    for i in band_pixels(view, sampling_stride(view, block_size)) {
        let p = view.point(i);
        if p[2] < nearest {
            continue;
        }
        let q = r.map(|row| dot(row, p));
        let inverse = band / p[2];
        for s in 0..=steps {
            let scale = 1.0 + inverse * (2.0 * s as f32 / steps as f32 - 1.0);
            let b: [i32; 3] = std::array::from_fn(|k| floor(q[k] * scale + t[k]));
            if b != last {
                marks.push(b);
                last = b;
            }
        }
    }
    if let Some(&first) = marks.first() {
        let (mut lo, mut hi) = (first, first);
        for b in &marks {
            for k in 0..3 {
                (lo[k], hi[k]) = (lo[k].min(b[k]), hi[k].max(b[k]));
            }
        }
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

/// The pixels of a grid of the given stride, and those along the grid's lines where a measured run begins or ends: the
/// rim of the subject must not depend on where the grid lies.
fn band_pixels(view: &View, stride: usize) -> impl Iterator<Item = usize> + '_ {
    let (width, height) = (view.camera.width as usize, view.camera.height as usize);
    let has = |i: usize| view.elements[i][0] > 0.0;
    // The border's elements are empty, so every pixel within has neighbours.
    (1..height.saturating_sub(1)).flat_map(move |y| {
        let on_row = y % stride == 0;
        let step = if on_row { 1 } else { stride };
        let first = if on_row { 1 } else { stride };
        (first..width.saturating_sub(1)).step_by(step).map(move |x| (x, y * width + x, on_row)).filter_map(
            move |(x, i, on_row)| {
                let on_column = x % stride == 0;
                let ends = |step: usize| !(has(i - step) && has(i + step));
                let wanted = has(i) && ((on_row && (on_column || ends(1))) || (on_column && ends(width)));
                wanted.then_some(i)
            },
        )
    })
}

/// Elements nearer than this are not fused, so that no voxel of a touched block lies beside or behind the camera.
fn nearest_depth(tsdf: &Tsdf) -> f32 {
    NEAREST + tsdf.truncation() + 2.0 * SIDE as f32 * tsdf.voxel_size()
}

/// Pixels that may be skipped so that neighbouring rays still fall at most half a block apart.
fn sampling_stride(view: &View, block_size: f32) -> usize {
    let (mut sum, mut count) = (0.0f64, 0usize);
    for i in view.samples(5) {
        sum += f64::from(view.elements[i][0]);
        count += 1;
    }
    let mean = sum / count.max(1) as f64;
    ((f64::from(block_size) / 2.0 * view.camera.fx / mean.max(0.1)) as usize).clamp(1, 4)
}

/// The voxel grid seen from the camera.
struct Projection<'a> {
    elements: &'a [Element],
    /// Camera coordinates (x and y times the focal lengths) of a voxel step along each axis, and of voxel 0.
    axes: [[f32; 3]; 3],
    origin: [f32; 3],
    /// Last column and row, principal point, and widths of a pixel at unit depth.
    last: [f32; 2],
    center: [f32; 2],
    pitch: [f32; 2],
    nearest: f32,
    truncation: f32,
    unit: f32,
    color_band: f32,
}

impl<'a> Projection<'a> {
    fn new(tsdf: &Tsdf, view: &'a View, scan_from_camera: &Rigid) -> Self {
        let camera_from_scan = scan_from_camera.inverse();
        let rotation = camera_from_scan.rotation.to_rotation_matrix();
        let (voxel, camera) = (tsdf.voxel_size(), &view.camera);
        let focal = [camera.fx, camera.fy, 1.0];
        Self {
            elements: &view.elements,
            axes: std::array::from_fn(|k| {
                std::array::from_fn(|r| (rotation[(r, k)] * focal[r] * f64::from(voxel)) as f32)
            }),
            origin: std::array::from_fn(|r| (camera_from_scan.translation.vector[r] * focal[r]) as f32),
            last: [camera.width as f32 - 1.0, camera.height as f32 - 1.0],
            center: [camera.cx as f32, camera.cy as f32],
            pitch: [1.0 / camera.fx as f32, 1.0 / camera.fy as f32],
            nearest: nearest_depth(tsdf),
            truncation: tsdf.truncation(),
            unit: tsdf.unit(),
            color_band: (COLOR_VOXELS * voxel).min(tsdf.truncation()) / tsdf.unit(),
        }
    }

    /// Camera coordinates of the first voxel of a row.
    #[inline(always)]
    fn start(&self, base: [f32; 3], row: usize) -> [f32; 3] {
        let (y, z) = (base[1] + (row % SIDE) as f32, base[2] + (row / SIDE) as f32);
        std::array::from_fn(|r| self.origin[r] + self.axes[0][r] * base[0] + self.axes[1][r] * y + self.axes[2][r] * z)
    }
}

/// The touched ones of a chunk of blocks.
struct UpdateBlocks<'a> {
    projection: &'a Projection<'a>,
    coords: &'a [[i32; 3]],
    touched: &'a [bool],
    chunk: usize,
    blocks: &'a mut [Block],
    /// The blocks' colours and the pixels'.
    colors: Option<(&'a mut [ColorBlock], &'a [[u8; 3]])>,
}

impl Kernel for UpdateBlocks<'_> {
    /// Voxels whose values changed.
    type Output = usize;

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) -> usize {
        let first = self.chunk * CHUNK;
        let rows = RowPairs::new(lanes, self.projection);
        let mut updated = 0;
        for (k, block) in self.blocks.iter_mut().enumerate() {
            if !self.touched[first + k] {
                continue;
            }
            let base = self.coords[first + k].map(|c| (c * SIDE as i32) as f32);
            let mut colors = self.colors.as_mut().map(|(fields, pixels)| (&mut fields[k], *pixels));
            for pair in 0..VOXELS / LANES {
                let (index, z, sub) = rows.look_up(self.projection.start(base, 2 * pair));
                let measured = rows.measure(&index, z, sub);
                if !lanes.any(measured.counts) {
                    continue;
                }
                updated += LANES;
                rows.blend(pair_of(&mut block.sdf, pair), pair_of(&mut block.weight, pair), &measured);
                if let Some((field, pixels)) = &mut colors {
                    let near = lanes.store(rows.color_weight(&measured));
                    let field = pair_of(field, pair);
                    for x in (0..LANES).filter(|x| near[*x] > 0.0) {
                        blend_color(&mut field[x], pixels[index[x] as usize], near[x]);
                    }
                }
            }
        }
        updated
    }
}

/// A projection in lanes: the voxels of two rows at once.
struct RowPairs<'a, L: Lanes> {
    lanes: L,
    projection: &'a Projection<'a>,
    /// Camera coordinates of the voxels less those of the first.
    steps: [L::F; 3],
}

/// What the pixels of two rows say about their voxels.
struct Measured<L: Lanes> {
    /// In units of the field.
    distance: L::F,
    /// 0 where it does not count.
    weight: L::F,
    counts: L::M,
}

impl<'a, L: Lanes> RowPairs<'a, L> {
    #[inline(always)]
    fn new(lanes: L, projection: &'a Projection<'a>) -> Self {
        let step =
            |r: usize, x: usize| projection.axes[0][r] * (x % SIDE) as f32 + projection.axes[1][r] * (x / SIDE) as f32;
        let all: [[f32; LANES]; 3] = std::array::from_fn(|r| std::array::from_fn(|x| step(r, x)));
        Self { lanes, projection, steps: [lanes.load(&all[0]), lanes.load(&all[1]), lanes.load(&all[2])] }
    }

    /// Element index, inverse depth and depth of the voxels, and how far from their pixels' centres they are seen,
    /// pixels. What lies outside the image falls on its border, which is empty.
    #[inline(always)]
    fn look_up(&self, start: [f32; 3]) -> ([u32; LANES], [L::F; 2], [L::F; 2]) {
        let (l, p) = (self.lanes, self.projection);
        let x = l.add(l.splat(start[0]), self.steps[0]);
        let y = l.add(l.splat(start[1]), self.steps[1]);
        let z = l.add(l.splat(start[2]), self.steps[2]);
        let inverse = l.div(l.splat(1.0), z);
        let exact = [l.add(l.mul(x, inverse), l.splat(p.center[0])), l.add(l.mul(y, inverse), l.splat(p.center[1]))];
        let zero = l.splat(0.0);
        let bounded = [
            l.round(l.min(l.max(exact[0], zero), l.splat(p.last[0]))),
            l.round(l.min(l.max(exact[1], zero), l.splat(p.last[1]))),
        ];
        let aside = [
            l.mul(l.sub(exact[0], bounded[0]), l.splat(p.pitch[0])),
            l.mul(l.sub(exact[1], bounded[1]), l.splat(p.pitch[1])),
        ];
        let flat = l.add(l.mul(bounded[1], l.splat(p.last[0] + 1.0)), bounded[0]);
        (l.indices(flat), [inverse, z], aside)
    }

    /// Signed distances to the planes of the elements, capped, and their weights.
    #[inline(always)]
    fn measure(&self, index: &[u32; LANES], [inverse, z]: [L::F; 2], aside: [L::F; 2]) -> Measured<L> {
        let (l, p) = (self.lanes, self.projection);
        // In range: columns and rows are bounded by the image's, also of NaN. Sixteen loads from memory are cheaper
        // than taking a register apart, hence the black box.
        let index = std::hint::black_box(index);
        let records = std::array::from_fn(|k| &p.elements[index[k] as usize]);
        let [depth, facing, nx, ny] = l.transpose(records);
        let t = l.splat(p.truncation);
        let ahead = l.sub(depth, z);
        let tilt = l.mul(z, l.add(l.mul(nx, aside[0]), l.mul(ny, aside[1])));
        let to_plane = l.sub(tilt, l.mul(facing, ahead));
        let far = l.ge(ahead, l.splat(4.0 * p.truncation));
        let distance = l.select(far, t, l.max(l.min(to_plane, t), l.splat(-p.truncation)));
        let counts = l.and(l.ge(ahead, l.splat(-p.truncation)), l.ge(depth, l.splat(p.nearest)));
        let seen = l.mul(facing, inverse);
        let weight = l.mul(l.mul(seen, seen), l.splat(WEIGHT_ONE));
        let weight = l.min(l.max(weight, l.splat(1.0)), l.splat(4.0 * WEIGHT_ONE));
        Measured { distance: l.mul(distance, l.splat(1.0 / p.unit)), weight: l.keep(counts, weight), counts }
    }

    /// Running weighted means.
    #[inline(always)]
    fn blend(&self, sdf: &mut [i16; LANES], weights: &mut [u16; LANES], measured: &Measured<L>) {
        let l = self.lanes;
        let old = l.from_u16(weights);
        let sum = l.add(old, measured.weight);
        let value = l.add(l.mul(l.from_i16(sdf), old), l.mul(measured.distance, measured.weight));
        *sdf = l.to_i16(l.div(value, l.max(sum, l.splat(1e-9))));
        *weights = l.to_u16(l.min(sum, l.splat(f32::from(u16::MAX))));
    }

    /// The weights of the voxels near enough to the surface to take its colour, 0 elsewhere.
    #[inline(always)]
    fn color_weight(&self, measured: &Measured<L>) -> L::F {
        let (l, band) = (self.lanes, self.projection.color_band);
        let near = l.and(l.ge(measured.distance, l.splat(-band)), l.ge(l.splat(band), measured.distance));
        l.keep(near, measured.weight)
    }
}

/// Two neighbouring rows of a block.
#[inline(always)]
fn pair_of<T>(values: &mut [T; VOXELS], pair: usize) -> &mut [T; LANES] {
    let (pairs, _) = values.as_chunks_mut::<LANES>();
    &mut pairs[pair]
}

/// Running weighted mean of a voxel's colour.
#[inline(always)]
fn blend_color(voxel: &mut [u16; 4], color: [u8; 3], weight: f32) {
    if color == [0; 3] {
        return;
    }
    let old = f32::from(voxel[3]);
    let sum = old + weight;
    let (keep, take) = (old / sum, 256.0 * weight / sum);
    let [r, g, b] = std::array::from_fn(|k| (f32::from(voxel[k]) * keep + f32::from(color[k]) * take + 0.5) as u16);
    *voxel = [r, g, b, if sum > 65535.0 { u16::MAX } else { (sum + 0.5) as u16 }];
}
