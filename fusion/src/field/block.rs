//! A block of the field: 8³ voxels and their colours.

/// Voxels along a block's edge.
pub(crate) const SIDE: usize = 8;
/// Voxels along the edge of an octant: an eighth of a block, the smallest part that an integration looks at.
pub(crate) const OCTANT: usize = SIDE / 2;
/// Voxels in a block.
pub(crate) const VOXELS: usize = SIDE * SIDE * SIDE;
/// Weight units of one perfectly seen measurement.
pub(crate) const WEIGHT_ONE: f32 = 64.0;

/// Signed distance and weight of one voxel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Voxel {
    /// Signed distance in units of truncation / 32767, positive outside.
    pub sdf: i16,
    /// Sum of weights, [`WEIGHT_ONE`] each; 0 never seen.
    pub weight: u16,
}

/// Mean colour of one voxel: 8.8 fixed point channels and the sum of weights.
pub(crate) type ColorVoxel = [u16; 4];

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
    pub(crate) const EMPTY: Self = Self { channels: [[0; VOXELS]; 3], weight: [0; VOXELS] };

    /// One voxel's.
    #[inline]
    pub(crate) fn voxel(&self, k: usize) -> ColorVoxel {
        let [r, g, b] = &self.channels;
        [r[k], g[k], b[k], self.weight[k]]
    }
}

/// Index of a voxel in its block: octant by octant, within them layer by layer of z, x fastest.
#[inline]
pub(crate) fn local_index(v: [i32; 3]) -> usize {
    along_x(v[0]) + along_y(v[1]) + along_z(v[2])
}

#[inline]
pub(crate) fn along_x(c: i32) -> usize {
    ((c & 3) | (c & 4) << 4) as usize
}

#[inline]
pub(crate) fn along_y(c: i32) -> usize {
    ((c & 3) << 2 | (c & 4) << 5) as usize
}

#[inline]
pub(crate) fn along_z(c: i32) -> usize {
    ((c & 3) << 4 | (c & 4) << 6) as usize
}
