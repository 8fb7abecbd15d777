//! A scalar on a regular grid in space, and the distance to a closed body.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, bvh::Bvh};

/// Nodes between two exact far distances.
const COARSE: usize = 4;
/// Beyond this distance values are interpolated between coarse nodes, metres.
const EXACT_WITHIN: f32 = 0.08;

/// A regular grid of nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Position of node (0, 0, 0).
    pub origin: Point3<f32>,
    /// Distance between nodes, metres.
    pub cell: f32,
    /// Nodes along x, y, z.
    pub dims: [usize; 3],
}

impl Grid {
    /// A grid that covers a box with `margin` around it.
    pub fn covering(lo: Point3<f32>, hi: Point3<f32>, margin: f32, cell: f32) -> Self {
        let origin = lo - Vector3::repeat(margin);
        let span = hi - lo + Vector3::repeat(2.0 * margin);
        Self { origin, cell, dims: [0, 1, 2].map(|k| (span[k] / cell).ceil() as usize + 1) }
    }

    /// How many nodes there are.
    pub fn node_count(&self) -> usize {
        self.dims.iter().product()
    }

    /// Index of a node.
    #[inline]
    pub fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.dims[1] + y) * self.dims[0] + x
    }

    /// The node with this index.
    #[inline]
    pub fn node(&self, index: usize) -> [usize; 3] {
        let row = index / self.dims[0];
        [index % self.dims[0], row % self.dims[1], row / self.dims[1]]
    }

    /// Position of a node.
    #[inline]
    pub fn position(&self, node: [usize; 3]) -> Point3<f32> {
        self.origin + Vector3::new(node[0] as f32, node[1] as f32, node[2] as f32) * self.cell
    }

    /// The cell that holds a point (clamped to the grid) and the place in it, 0..1.
    fn locate(&self, p: &Point3<f32>) -> ([usize; 3], [f32; 3]) {
        let scaled = (p - self.origin) / self.cell;
        let mut base = [0; 3];
        let mut place = [0.0; 3];
        for k in 0..3 {
            let last = self.dims[k].saturating_sub(2) as f32;
            let low = scaled[k].floor().clamp(0.0, last);
            base[k] = low as usize;
            place[k] = (scaled[k] - low).clamp(0.0, 1.0);
        }
        (base, place)
    }

    /// The node nearest to a point.
    pub fn nearest(&self, p: &Point3<f32>) -> usize {
        let (base, place) = self.locate(p);
        self.index([0, 1, 2].map(|k| base[k] + usize::from(place[k] > 0.5)))
    }
}

/// A scalar at each node of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Where the nodes are.
    pub grid: Grid,
    /// Value at each node.
    pub values: Vec<f32>,
}

impl Field {
    /// A value for each node by its position and index. Parallel, deterministic.
    pub fn from_fn(grid: &Grid, value: impl Fn(usize, &Point3<f32>) -> f32 + Sync) -> Self {
        let values = (0..grid.node_count()).into_par_iter().map(|i| value(i, &grid.position(grid.node(i)))).collect();
        Self { grid: grid.clone(), values }
    }

    /// Trilinear interpolation; outside the grid the value at its border.
    pub fn sample(&self, p: &Point3<f32>) -> f32 {
        let (base, f) = self.grid.locate(p);
        let mut sum = 0.0;
        for corner in 0..8 {
            let offset = [0, 1, 2].map(|k| corner >> k & 1);
            let weight: f32 = (0..3).map(|k| if offset[k] == 1 { f[k] } else { 1.0 - f[k] }).product();
            sum += weight * self.values[self.grid.index([0, 1, 2].map(|k| base[k] + offset[k]))];
        }
        sum
    }

    /// Gradient by central differences over one cell.
    pub fn gradient(&self, p: &Point3<f32>) -> Vector3<f32> {
        let h = 0.5 * self.grid.cell;
        let slope = |axis: Vector3<f32>| (self.sample(&(p + axis * h)) - self.sample(&(p - axis * h))) / (2.0 * h);
        Vector3::new(slope(Vector3::x()), slope(Vector3::y()), slope(Vector3::z()))
    }

    /// The mean over boxes of ±`radius` nodes, `rounds` times: about a Gaussian.
    pub fn blurred(&self, radius: usize, rounds: usize) -> Self {
        let mut out = self.clone();
        for _ in 0..rounds {
            (0..3).for_each(|axis| out.blur_axis(axis, radius));
        }
        out
    }

    fn blur_axis(&mut self, axis: usize, radius: usize) {
        let grid = self.grid.clone();
        let (n, r) = (grid.dims[axis], radius as isize);
        let old = std::mem::take(&mut self.values);
        let value = |i: usize| {
            let mut node = grid.node(i);
            let at = node[axis] as isize;
            let mut sum = 0.0;
            for d in -r..=r {
                node[axis] = (at + d).clamp(0, n as isize - 1) as usize;
                sum += old[grid.index(node)];
            }
            sum / (2 * radius + 1) as f32
        };
        self.values = (0..grid.node_count()).into_par_iter().map(value).collect();
    }
}

/// Signed distance to a closed mesh (positive outside), and the nearest triangle of each node that is near it
/// (`u32::MAX` elsewhere, where distances are interpolated).
pub fn signed_distance(mesh: &Mesh, grid: &Grid) -> (Field, Vec<u32>) {
    let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
    let exact = |p: &Point3<f32>, outside: Option<bool>| {
        let hit = bvh.closest(p, f32::INFINITY);
        let distance = hit.map_or(f32::INFINITY, |h| h.distance);
        let outside = outside.unwrap_or_else(|| !bvh.contains(p));
        (if outside { distance } else { -distance }, hit.map_or(u32::MAX, |h| h.triangle))
    };
    let coarse_grid =
        Grid { origin: grid.origin, cell: grid.cell * COARSE as f32, dims: grid.dims.map(|n| n.div_ceil(COARSE) + 1) };
    let coarse = Field::from_fn(&coarse_grid, |_, p| exact(p, None).0);
    let nodes: Vec<(f32, u32)> = (0..grid.node_count())
        .into_par_iter()
        .map(|i| {
            let p = grid.position(grid.node(i));
            let rough = coarse.sample(&p);
            let known_side = (rough.abs() > coarse_grid.cell).then_some(rough > 0.0);
            if rough.abs() > EXACT_WITHIN { (rough, u32::MAX) } else { exact(&p, known_side) }
        })
        .collect();
    let (values, nearest) = nodes.into_iter().unzip();
    (Field { grid: grid.clone(), values }, nearest)
}
