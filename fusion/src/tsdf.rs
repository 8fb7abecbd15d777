//! A sparse truncated signed distance field: blocks of 8³ voxels, four bytes a voxel, under a dense block index.

use nalgebra::Point3;

use crate::FusionError;

/// Voxels along a block's edge.
pub const SIDE: usize = 8;
/// Voxels along the edge of an octant: an eighth of a block, the least part that an integration looks at.
pub(crate) const OCTANT: usize = SIDE / 2;
/// Voxels in a block.
pub const VOXELS: usize = SIDE * SIDE * SIDE;
/// Marker of a block that does not exist.
pub(crate) const NONE: u32 = u32::MAX;
/// Most entries of the block index (four bytes each).
const MAX_INDEX: usize = 64 << 20;
/// Weight units of one perfectly seen measurement.
pub const WEIGHT_ONE: f32 = 64.0;

/// Signed distance and weight of one voxel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Voxel {
    /// Signed distance in units of truncation / 32767, positive outside.
    pub sdf: i16,
    /// Sum of weights, [`WEIGHT_ONE`] each; 0 never seen.
    pub weight: u16,
}

/// Mean colour of one voxel: 8.8 fixed point channels and the sum of weights.
pub type ColorVoxel = [u16; 4];

/// A block: 512 voxels in the order of [`local_index`], distances and weights apart, so that a layer of an octant is
/// updated at once.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    pub sdf: [i16; VOXELS],
    pub weight: [u16; VOXELS],
}

impl Block {
    pub(crate) const EMPTY: Self = Self { sdf: [0; VOXELS], weight: [0; VOXELS] };

    /// One voxel.
    #[inline]
    pub(crate) fn voxel(&self, k: usize) -> Voxel {
        Voxel { sdf: self.sdf[k], weight: self.weight[k] }
    }

    /// True where a seen voxel lies inside.
    pub(crate) fn has_inside(&self) -> bool {
        self.sdf.iter().zip(&self.weight).any(|(s, w)| *w > 0 && *s <= 0)
    }
}
/// The colours of a block, channel by channel, and their weights.
#[derive(Debug, Clone)]
pub(crate) struct ColorBlock {
    pub channels: [[u16; VOXELS]; 3],
    pub weight: [u16; VOXELS],
}

impl ColorBlock {
    const EMPTY: Self = Self { channels: [[0; VOXELS]; 3], weight: [0; VOXELS] };

    /// One voxel's.
    #[inline]
    pub(crate) fn voxel(&self, k: usize) -> ColorVoxel {
        let [r, g, b] = &self.channels;
        [r[k], g[k], b[k], self.weight[k]]
    }
}

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
}

#[derive(Debug, Clone, Default)]
struct BlockIndex {
    origin: [i32; 3],
    dims: [usize; 3],
    slots: Vec<u32>,
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
        }
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
    pub fn voxel(&self, v: [i32; 3]) -> Voxel {
        match self.slot(v.map(|c| c >> 3)) {
            NONE => Voxel::default(),
            slot => self.blocks[slot as usize].voxel(local_index(v)),
        }
    }

    /// Metres a unit of [`Voxel::sdf`].
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
        let length = crate::normals::dot(g, g).sqrt();
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

impl BlockIndex {
    #[inline]
    fn slot(&self, b: [i32; 3]) -> u32 {
        let l = [b[0] - self.origin[0], b[1] - self.origin[1], b[2] - self.origin[2]];
        let inside = (0..3).all(|k| (l[k] as u32 as usize) < self.dims[k]);
        if inside { self.slots[self.flat(l)] } else { NONE }
    }

    #[inline]
    fn flat(&self, l: [i32; 3]) -> usize {
        (l[2] as usize * self.dims[1] + l[1] as usize) * self.dims[0] + l[0] as usize
    }

    #[inline]
    fn cell(&self, b: [i32; 3]) -> usize {
        self.flat([b[0] - self.origin[0], b[1] - self.origin[1], b[2] - self.origin[2]])
    }

    /// Grows to cover `lo..=hi` with some slack; the largest extent in blocks where that is too much.
    fn cover(&mut self, lo: [i32; 3], hi: [i32; 3]) -> Result<(), usize> {
        let has = |b: [i32; 3]| (0..3).all(|k| b[k] >= self.origin[k] && b[k] < self.origin[k] + self.dims[k] as i32);
        if !self.slots.is_empty() && has(lo) && has(hi) {
            return Ok(());
        }
        let (mut from, mut to) = (lo.map(|c| c - 4), hi.map(|c| c + 5));
        if !self.slots.is_empty() {
            for k in 0..3 {
                from[k] = from[k].min(self.origin[k]);
                to[k] = to[k].max(self.origin[k] + self.dims[k] as i32);
            }
        }
        let dims: [usize; 3] = std::array::from_fn(|k| (to[k] - from[k]) as usize);
        let count = dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d)).filter(|&n| n <= MAX_INDEX);
        let Some(count) = count else {
            return Err(dims.into_iter().max().unwrap_or(0));
        };
        let mut grown = Self { origin: from, dims, slots: vec![NONE; count] };
        for (i, &slot) in self.slots.iter().enumerate().filter(|(_, s)| **s != NONE) {
            let x = i % self.dims[0];
            let y = i / self.dims[0] % self.dims[1];
            let z = i / self.dims[0] / self.dims[1];
            let b = [x as i32 + self.origin[0], y as i32 + self.origin[1], z as i32 + self.origin[2]];
            let cell = grown.cell(b);
            grown.slots[cell] = slot;
        }
        *self = grown;
        Ok(())
    }
}

/// Largest integer not above `x`, without the library call that plain x86-64 needs for it.
#[inline]
pub(crate) fn floor(x: f32) -> i32 {
    let i = x as i32;
    i - i32::from(x < i as f32)
}

/// Index of a voxel in its block: octant by octant, within them layer by layer of z, x fastest.
#[inline]
pub(crate) fn local_index(v: [i32; 3]) -> usize {
    along_x(v[0]) + along_y(v[1]) + along_z(v[2])
}

#[inline]
fn along_x(c: i32) -> usize {
    ((c & 3) | (c & 4) << 4) as usize
}

#[inline]
fn along_y(c: i32) -> usize {
    ((c & 3) << 2 | (c & 4) << 5) as usize
}

#[inline]
fn along_z(c: i32) -> usize {
    ((c & 3) << 4 | (c & 4) << 6) as usize
}

#[inline]
fn trilinear(c: &[f32; 8], f: [f32; 3]) -> f32 {
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let low = lerp(lerp(c[0], c[1], f[0]), lerp(c[2], c[3], f[0]), f[1]);
    let high = lerp(lerp(c[4], c[5], f[0]), lerp(c[6], c[7], f[0]), f[1]);
    lerp(low, high, f[2])
}
