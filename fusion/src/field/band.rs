//! The blocks of a field that a view's truncation band meets.

use toile_geometry::{
    Rigid,
    element::Element,
    lanes::floats::{Kernel, LANES, Lanes, dispatch, group},
};

use super::{
    block::SIDE,
    projection::Projection,
    tsdf::{Tsdf, floor},
};
use crate::{
    FusionError,
    frame::{DepthView, dot},
};

/// Makes the blocks within the truncation band of the view's elements where they are missing. Returns for each block of the
/// field whether it is one of them.
///
/// # Errors
/// [`FusionError::TooLarge`] where the block index would not fit.
pub(crate) fn touch(
    tsdf: &mut Tsdf,
    view: &DepthView,
    model_from_camera: &Rigid,
    projection: &Projection<'_>,
) -> Result<Vec<bool>, FusionError> {
    let rays = Rays::new(tsdf, view, model_from_camera, projection);
    let mut touched = vec![false; tsdf.block_count()];
    let (bounds, seen) = dispatch(Survey(&rays));
    let Some([low, high]) = bounds else { return Ok(touched) };
    tsdf.cover(low, high)?;
    let grid = Grid { low, dims: [0, 1, 2].map(|k| (high[k] - low[k] + 1) as usize) };
    let cells = dispatch(Mark { rays: &rays, grid: &grid, seen: &seen });
    for (cell, _) in cells.into_iter().enumerate().filter(|(_, marked)| *marked) {
        let slot = tsdf.slot_or_new(grid.block(cell)) as usize;
        if slot >= touched.len() {
            touched.resize(slot + 1, false);
        }
        touched[slot] = true;
    }
    Ok(touched)
}

/// The view's rays in blocks of the field: at depth z they pass `origin + z direction`.
struct Rays<'a> {
    elements: &'a [Element],
    size: [usize; 2],
    nearest: f32,
    origin: [f32; 3],
    rotation: [[f32; 3]; 3],
    /// x of each column's and y of each row's ray of unit depth.
    columns: Vec<f32>,
    rows: Vec<f32>,
    /// Half the band's width, metres.
    band: f32,
    /// Half a block, metres: along the camera's axis samples lie no farther apart.
    spacing: f32,
    /// Pixels between sampled rows, and between sampled columns.
    stride: usize,
}

impl<'a> Rays<'a> {
    fn new(tsdf: &Tsdf, view: &DepthView, model_from_camera: &Rigid, projection: &Projection<'a>) -> Self {
        let block = tsdf.voxel_size() * SIDE as f32;
        let turn = model_from_camera.rotation.to_rotation_matrix();
        let rotation = std::array::from_fn(|k| std::array::from_fn(|j| turn[(k, j)] as f32 / block));
        // A voxel belongs to the block with everything that is nearer to it than to others.
        let half_voxel = 0.5 / SIDE as f32;
        let ray = |i: usize, k: usize| (i as f32 - projection.center[k]) * projection.pitch[k];
        Self {
            elements: projection.elements,
            size: projection.size,
            nearest: projection.nearest,
            origin: std::array::from_fn(|k| model_from_camera.translation.vector[k] as f32 / block + half_voxel),
            rotation,
            spacing: 0.5 * block,
            columns: (0..projection.size[0]).map(|u| ray(u, 0)).collect(),
            rows: (0..projection.size[1]).map(|v| ray(v, 1)).collect(),
            band: tsdf.truncation() + tsdf.voxel_size(),
            stride: ((0.5 * block / (projection.pitch[1] * view.farthest())) as usize).clamp(1, 4),
        }
    }

    /// Depths of the pixels from a place in the image on, 0 where nothing is to be fused.
    #[inline(always)]
    fn depths<L: Lanes>(&self, l: L, x: usize, y: usize) -> L::F {
        let row = &self.elements[y * self.size[0]..(y + 1) * self.size[0]];
        let halves = [group(row, x), group(row, x + LANES / 2)];
        let [depth, ..] = l.unpack(halves);
        l.keep(l.ge(depth, l.splat(self.nearest)), depth)
    }

    /// Directions of the rays of the pixels from a place in the image on.
    #[inline(always)]
    fn directions<L: Lanes>(&self, l: L, x: usize, y: usize) -> [L::F; 3] {
        let column = l.load(&group(&self.columns, x));
        let [a, b, c] = self.rotation.map(|r| [r[0], dot(r, [0.0, self.rows[y], 1.0])]);
        [
            l.add(l.mul(column, l.splat(a[0])), l.splat(a[1])),
            l.add(l.mul(column, l.splat(b[0])), l.splat(b[1])),
            l.add(l.mul(column, l.splat(c[0])), l.splat(c[1])),
        ]
    }
}

/// Which pixels are to be fused.
struct Visible {
    /// Groups of lanes in a row.
    groups: usize,
    bits: Vec<u16>,
}

impl Visible {
    /// Which pixels of a group are sampled: those on every `stride`-th row and column, and those beside something
    /// that is not seen, so that rims do not depend on where rows and columns lie.
    #[inline(always)]
    fn sampled(&self, group: usize, y: usize, stride: usize) -> u16 {
        let at = y * self.groups + group;
        let here = self.bits[at];
        if here == 0 || stride == 1 {
            return here;
        }
        let left = if group > 0 { self.bits[at - 1] } else { 0 };
        let right = if group + 1 < self.groups { self.bits[at + 1] } else { 0 };
        let across = (here << 1 | left >> 15) & (here >> 1 | right << 15);
        let inside = across & self.bits[at - self.groups] & self.bits[at + self.groups];
        let first = group * LANES;
        let grid = if y.is_multiple_of(stride) {
            let columns = first.next_multiple_of(stride) - first;
            (columns..LANES).step_by(stride).fold(0, |bits, k| bits | 1 << k)
        } else {
            0
        };
        here & (grid | !inside)
    }
}

/// Finds which pixels are to be fused, and the smallest and largest block coordinates of their band; `None` where nothing
/// is seen.
struct Survey<'a>(&'a Rays<'a>);

impl Kernel for Survey<'_> {
    type Output = (Option<[[i32; 3]; 2]>, Visible);

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Self::Output {
        let rays = self.0;
        let (mut low, mut high) = ([l.splat(f32::INFINITY); 3], [l.splat(f32::NEG_INFINITY); 3]);
        let groups = rays.size[0].div_ceil(LANES);
        let mut bits = vec![0; groups * rays.size[1]];
        let mut any = false;
        for y in 0..rays.size[1] {
            for x in (0..rays.size[0]).step_by(LANES) {
                let depth = rays.depths(l, x, y);
                let seen = l.gt(depth, l.splat(0.0));
                if !l.any(seen) {
                    continue;
                }
                any = true;
                bits[y * groups + x / LANES] = l.bits(seen) as u16;
                let direction = rays.directions(l, x, y);
                let (near, far) = (l.sub(depth, l.splat(rays.band)), l.add(depth, l.splat(rays.band)));
                for k in 0..3 {
                    let (a, b) = (l.mul(direction[k], near), l.mul(direction[k], far));
                    low[k] = l.select(seen, l.min(low[k], l.min(a, b)), low[k]);
                    high[k] = l.select(seen, l.max(high[k], l.max(a, b)), high[k]);
                }
            }
        }
        let mut bounds = [[0; 3]; 2];
        for k in 0..3 {
            let least = l.store(low[k]).into_iter().fold(f32::INFINITY, f32::min);
            let most = l.store(high[k]).into_iter().fold(f32::NEG_INFINITY, f32::max);
            // One block more to both sides, for rounding.
            bounds[0][k] = floor(least + rays.origin[k]) - 1;
            bounds[1][k] = floor(most + rays.origin[k]) + 1;
        }
        (any.then_some(bounds), Visible { groups, bits })
    }
}

/// The blocks that a view may touch.
struct Grid {
    low: [i32; 3],
    dims: [usize; 3],
}

impl Grid {
    /// Coordinates of the block of a cell.
    fn block(&self, cell: usize) -> [i32; 3] {
        let [width, height, _] = self.dims;
        let at = [cell % width, cell / width % height, cell / width / height];
        std::array::from_fn(|k| self.low[k] + at[k] as i32)
    }
}

/// Finds the blocks of the band among the cells of a grid that holds them all.
struct Mark<'a> {
    rays: &'a Rays<'a>,
    grid: &'a Grid,
    seen: &'a Visible,
}

impl Kernel for Mark<'_> {
    type Output = Vec<bool>;

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Vec<bool> {
        let (rays, [width, height, _]) = (self.rays, self.grid.dims);
        let steps = (2.0 * rays.band / rays.spacing).ceil();
        // From the grid's first block, less a half, so that rounding takes the floor.
        let origin: [f32; 3] = std::array::from_fn(|k| rays.origin[k] - self.grid.low[k] as f32 - 0.5);
        let mut cells = vec![false; self.grid.dims.iter().product()];
        for y in 1..rays.size[1].saturating_sub(1) {
            for x in (0..rays.size[0]).step_by(LANES) {
                let sampled = self.seen.sampled(x / LANES, y, rays.stride);
                if sampled == 0 {
                    continue;
                }
                let depth = rays.depths(l, x, y);
                let direction = rays.directions(l, x, y);
                for s in 0..=steps as usize {
                    let at = l.add(depth, l.splat(rays.band * (2.0 * s as f32 / steps - 1.0)));
                    let column = l.round(l.add(l.mul(direction[0], at), l.splat(origin[0])));
                    let row = l.round(l.add(l.mul(direction[1], at), l.splat(origin[1])));
                    let layer = l.round(l.add(l.mul(direction[2], at), l.splat(origin[2])));
                    let (column, row) =
                        (l.indices(column), l.indices(l.add(l.mul(layer, l.splat(height as f32)), row)));
                    let mut left = sampled;
                    while left != 0 {
                        let k = left.trailing_zeros() as usize % LANES;
                        // Beyond the grid only where coordinates are too large for their digits.
                        if let Some(cell) = cells.get_mut(row[k] as usize * width + column[k] as usize) {
                            *cell = true;
                        }
                        left &= left - 1;
                    }
                }
            }
        }
        cells
    }
}
