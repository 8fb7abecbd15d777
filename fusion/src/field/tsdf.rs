//! A sparse truncated signed distance field: blocks of 8³ voxels, four bytes a voxel, under a dense block index.

use nalgebra::Point3;

use super::{
    block::{Block, ColorBlock, SIDE, Voxel, along_x, along_y, along_z, local_index},
    block_index::{BlockIndex, NONE},
};
use crate::FusionError;

/// A sparse truncated signed distance field. Voxel (i, j, k) is sampled at `voxel_size * (i, j, k)`, scan frame.
#[derive(Debug, Clone)]
pub struct Tsdf {
    voxel_size: f32,
    truncation: f32,
    index: BlockIndex,
    pub(crate) coords: Vec<[i32; 3]>,
    pub(crate) blocks: Vec<Block>,
    pub(crate) colors: Vec<ColorBlock>,
    with_color: bool,
    is_even: bool,
}

impl Tsdf {
    /// An empty field.
    pub fn new(voxel_size: f64, truncation: f64, with_color: bool) -> Self {
        Self {
            voxel_size: voxel_size as f32,
            truncation: truncation as f32,
            index: BlockIndex::default(),
            coords: Vec::new(),
            blocks: Vec::new(),
            colors: Vec::new(),
            with_color,
            is_even: false,
        }
    }

    /// Weighs measurements alike at all incidence angles, for noise that is the same along rays of all angles: along the
    /// normal it is then the smaller, the more slanted a surface is seen.
    pub(crate) fn weighed_evenly(self) -> Self {
        Self { is_even: true, ..self }
    }

    /// True where weights do not fall with the incidence angle.
    pub(crate) fn is_even(&self) -> bool {
        self.is_even
    }

    /// Edge of a voxel, metres.
    pub fn voxel_size(&self) -> f32 {
        self.voxel_size
    }

    /// Truncation distance, metres.
    pub fn truncation(&self) -> f32 {
        self.truncation
    }

    /// True when colours are kept.
    pub fn has_color(&self) -> bool {
        self.with_color
    }

    /// Number of blocks.
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// Bytes held by blocks and index.
    pub fn bytes(&self) -> usize {
        self.blocks.len() * size_of::<Block>()
            + self.colors.len() * size_of::<ColorBlock>()
            + self.index.slots.len() * size_of::<u32>()
    }

    /// Slot of the block with these block coordinates.
    #[inline]
    pub(crate) fn slot(&self, b: [i32; 3]) -> u32 {
        self.index.slot(b)
    }

    /// Makes the index cover block coordinates `lo..=hi`.
    pub(crate) fn cover(&mut self, lo: [i32; 3], hi: [i32; 3]) -> Result<(), FusionError> {
        self.index.cover(lo, hi).map_err(|blocks| FusionError::TooLarge {
            extent_m: blocks as f64 * SIDE as f64 * f64::from(self.voxel_size),
            voxel_mm: f64::from(self.voxel_size) * 1e3,
        })
    }

    /// Slot of the block, made where it is missing; the index must cover it.
    #[inline]
    pub(crate) fn slot_or_new(&mut self, b: [i32; 3]) -> u32 {
        let cell = self.index.cell(b);
        if self.index.slots[cell] == NONE {
            self.index.slots[cell] = self.blocks.len() as u32;
            self.coords.push(b);
            self.blocks.push(Block::EMPTY);
            if self.with_color {
                self.colors.push(ColorBlock::EMPTY);
            }
        }
        self.index.slots[cell]
    }

    /// The voxel at integer coordinates, unseen where its block is missing.
    #[inline]
    pub(crate) fn voxel(&self, v: [i32; 3]) -> Voxel {
        match self.slot(v.map(|c| c >> 3)) {
            NONE => Voxel::default(),
            slot => self.blocks[slot as usize].voxel(local_index(v)),
        }
    }

    /// Metres a unit of `Voxel::sdf`.
    #[inline]
    pub fn unit(&self) -> f32 {
        self.truncation / f32::from(i16::MAX)
    }

    /// Signed distance at a point by trilinear interpolation, metres; `None` where a corner was never seen.
    #[inline]
    pub fn distance(&self, p: &Point3<f32>) -> Option<f32> {
        let (corners, f) = self.cell_at(p)?;
        Some(trilinear(&corners, f) * self.unit())
    }

    /// Signed distance (metres) and gradient (unit-free) of the trilinear field at a point.
    #[inline]
    pub fn distance_and_gradient(&self, p: &Point3<f32>) -> Option<(f32, [f32; 3])> {
        let (c, f) = self.cell_at(p)?;
        let unit = self.unit();
        let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let x = [lerp(c[0], c[1], f[0]), lerp(c[2], c[3], f[0]), lerp(c[4], c[5], f[0]), lerp(c[6], c[7], f[0])];
        let y = [lerp(x[0], x[1], f[1]), lerp(x[2], x[3], f[1])];
        let dx = lerp(lerp(c[1] - c[0], c[3] - c[2], f[1]), lerp(c[5] - c[4], c[7] - c[6], f[1]), f[2]);
        let dy = lerp(x[1] - x[0], x[3] - x[2], f[2]);
        let scale = unit / self.voxel_size;
        Some((lerp(y[0], y[1], f[2]) * unit, [dx * scale, dy * scale, (y[1] - y[0]) * scale]))
    }

    /// Unit normal (outward) at a point from differences over one voxel either side; `None` beside the unseen.
    pub fn normal(&self, p: &Point3<f32>) -> Option<[f32; 3]> {
        let h = self.voxel_size;
        let mut g = [0.0; 3];
        for k in 0..3 {
            let (mut a, mut b) = (*p, *p);
            a[k] -= h;
            b[k] += h;
            g[k] = self.distance(&b)? - self.distance(&a)?;
        }
        let length = crate::frame::dot(g, g).sqrt();
        (length > 1e-9).then(|| g.map(|c| c / length))
    }

    /// The eight corner distances (units) of the cell around `p`, x fastest, and the position inside the cell.
    #[inline]
    fn cell_at(&self, p: &Point3<f32>) -> Option<([f32; 8], [f32; 3])> {
        let inv = 1.0 / self.voxel_size;
        let g = [p.x * inv, p.y * inv, p.z * inv];
        let v = g.map(floor);
        let f = [g[0] - v[0] as f32, g[1] - v[1] as f32, g[2] - v[2] as f32];
        let mut corners = [0.0; 8];
        if v.iter().all(|c| c & 7 < 7) {
            let slot = self.slot(v.map(|c| c >> 3));
            if slot == NONE {
                return None;
            }
            let block = &self.blocks[slot as usize];
            let (x, y) = ([along_x(v[0]), along_x(v[0] + 1)], [along_y(v[1]), along_y(v[1] + 1)]);
            let z = [along_z(v[2]), along_z(v[2] + 1)];
            for (k, c) in corners.iter_mut().enumerate() {
                let j = x[k & 1] + y[k >> 1 & 1] + z[k >> 2];
                if block.weight[j] == 0 {
                    return None;
                }
                *c = f32::from(block.sdf[j]);
            }
            return Some((corners, f));
        }
        for (k, c) in corners.iter_mut().enumerate() {
            let voxel = self.voxel([v[0] + (k & 1) as i32, v[1] + ((k >> 1) & 1) as i32, v[2] + (k >> 2) as i32]);
            if voxel.weight == 0 {
                return None;
            }
            *c = f32::from(voxel.sdf);
        }
        Some((corners, f))
    }
}

/// Largest integer not above `x`, without the library call that plain x86-64 needs for it.
#[inline]
pub(crate) fn floor(x: f32) -> i32 {
    let i = x as i32;
    i - i32::from(x < i as f32)
}

#[inline]
fn trilinear(c: &[f32; 8], f: [f32; 3]) -> f32 {
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let low = lerp(lerp(c[0], c[1], f[0]), lerp(c[2], c[3], f[0]), f[1]);
    let high = lerp(lerp(c[4], c[5], f[0]), lerp(c[6], c[7], f[0]), f[1]);
    lerp(low, high, f[2])
}
