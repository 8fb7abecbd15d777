//! Triangles to pixels: depth, triangle and barycentric coordinates.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::{Mesh, Rigid, camera::PinholeCamera};

/// Triangle index of a pixel that shows nothing.
pub const NOTHING: u32 = u32::MAX;
/// Nearest depth that is drawn, metres.
const NEAR: f64 = 0.01;
/// Rows that one task draws.
const BAND: usize = 16;
/// Slack around a triangle's projected bounds, pixels: rounding must not lose a pixel on an edge.
const SLACK: f64 = 1e-3;

/// A pinhole camera and where it stands. Its lens distortion is not applied: the image is the ideal one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Image size, focal lengths and principal point.
    pub lens: PinholeCamera,
    /// Maps world coordinates to the camera frame.
    pub camera_from_world: Rigid,
}

/// The triangles that a camera sees, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Depth along the camera's +Z, metres; 0 where nothing is seen.
    pub depth: Vec<f32>,
    /// Index of the nearest triangle, or [`NOTHING`].
    pub triangle: Vec<u32>,
    /// Barycentric coordinates of the pixel's ray in that triangle.
    pub barycentric: Vec<[f32; 3]>,
}

impl Raster {
    /// Triangle and barycentric coordinates at `pixel` (row × width + column), or `None` where nothing is seen.
    #[inline]
    pub fn hit(&self, pixel: usize) -> Option<(usize, [f32; 3])> {
        let triangle = self.triangle[pixel];
        (triangle != NOTHING).then(|| (triangle as usize, self.barycentric[pixel]))
    }
}

/// Draws a mesh; both sides of triangles count, the nearest wins, of equally near ones the lower index.
///
/// Homogeneous rasterisation (Olano and Greer 1997): a pixel's ray is inside the triangle when it lies on one side of
/// the three planes through the eye and an edge, so nothing needs clipping to polygons; depths come from the ray's exact
/// intersection with the triangle in f64. Neighbours leave no gap between them. Indices must be in range.
pub fn rasterize(mesh: &Mesh, camera: &Camera) -> Raster {
    let (width, height) = (camera.lens.width as usize, camera.lens.height as usize);
    let points: Vec<Vector3<f64>> =
        mesh.positions.par_iter().map(|p| (camera.camera_from_world * p.cast::<f64>()).coords).collect();
    let setups: Vec<Option<Setup>> =
        mesh.triangles.par_iter().map(|t| Setup::new(t.map(|v| points[v as usize]), &camera.lens)).collect();
    let bins = bin(&setups, height.div_ceil(BAND));
    let slopes: Vec<f64> = (0..width).map(|u| (u as f64 - camera.lens.cx) / camera.lens.fx).collect();
    let mut raster = Raster {
        width,
        height,
        depth: vec![0.0; width * height],
        triangle: vec![NOTHING; width * height],
        barycentric: vec![[0.0; 3]; width * height],
    };
    let size = (BAND * width).max(1);
    let bands = raster.depth.par_chunks_mut(size).zip(raster.triangle.par_chunks_mut(size));
    bands.zip(raster.barycentric.par_chunks_mut(size)).enumerate().for_each(|(band, ((depth, triangle), weights))| {
        let mut pixels = Band { first_row: band * BAND, width, depth, triangle, weights };
        for &t in &bins[band] {
            if let Some(setup) = &setups[t as usize] {
                pixels.draw(t, setup, &slopes, &camera.lens);
            }
        }
    });
    raster
}

/// A triangle ready to be tested against rays.
struct Setup {
    /// Normals of the planes through the eye and the edge opposite to each corner, pointing inside.
    edges: [Vector3<f64>; 3],
    /// Six times the volume of eye and triangle: depth is this over the sum of the three edge values.
    volume: f64,
    columns: [usize; 2],
    rows: [usize; 2],
}

impl Setup {
    fn new(corners: [Vector3<f64>; 3], lens: &PinholeCamera) -> Option<Self> {
        let [a, b, c] = corners;
        let edges = [b.cross(&c), c.cross(&a), a.cross(&b)];
        let volume = a.dot(&edges[0]);
        if volume == 0.0 || !volume.is_finite() {
            return None;
        }
        let (columns, rows) = projected_bounds(&corners, lens)?;
        let edges = if volume < 0.0 { edges.map(|e| -e) } else { edges };
        Some(Self { edges, volume: volume.abs(), columns, rows })
    }
}

/// First and last column and row that the part of a triangle in front of the near plane may touch.
fn projected_bounds(corners: &[Vector3<f64>; 3], lens: &PinholeCamera) -> Option<([usize; 2], [usize; 2])> {
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut add = |p: Vector3<f64>| {
        let pixel = [lens.fx * p.x / p.z + lens.cx, lens.fy * p.y / p.z + lens.cy];
        for k in 0..2 {
            lo[k] = lo[k].min(pixel[k]);
            hi[k] = hi[k].max(pixel[k]);
        }
    };
    for i in 0..3 {
        let (p, q) = (corners[i], corners[(i + 1) % 3]);
        if p.z >= NEAR {
            add(p);
        }
        if (p.z >= NEAR) != (q.z >= NEAR) {
            let mut crossing = p + (q - p) * ((NEAR - p.z) / (q.z - p.z));
            crossing.z = NEAR;
            add(crossing);
        }
    }
    let range = |k: usize, count: u32| {
        let first = (lo[k] - SLACK).ceil().max(0.0);
        let last = (hi[k] + SLACK).floor().min(f64::from(count) - 1.0);
        (first <= last).then_some([first as usize, last as usize])
    };
    Some((range(0, lens.width)?, range(1, lens.height)?))
}

/// Triangles that touch each band of rows, in index order.
fn bin(setups: &[Option<Setup>], bands: usize) -> Vec<Vec<u32>> {
    let mut bins = vec![Vec::new(); bands];
    for (t, setup) in setups.iter().enumerate() {
        if let Some(setup) = setup {
            bins[setup.rows[0] / BAND..=setup.rows[1] / BAND].iter_mut().for_each(|bin| bin.push(t as u32));
        }
    }
    bins
}

struct Band<'a> {
    first_row: usize,
    width: usize,
    depth: &'a mut [f32],
    triangle: &'a mut [u32],
    weights: &'a mut [[f32; 3]],
}

impl Band<'_> {
    fn draw(&mut self, t: u32, setup: &Setup, slopes: &[f64], lens: &PinholeCamera) {
        let rows = self.depth.len() / self.width;
        let [ex, ey, ez] = &setup.edges;
        for row in setup.rows[0].max(self.first_row)..=setup.rows[1].min(self.first_row + rows - 1) {
            let slope = (row as f64 - lens.cy) / lens.fy;
            let offsets = [ex.y * slope + ex.z, ey.y * slope + ey.z, ez.y * slope + ez.z];
            let start = (row - self.first_row) * self.width;
            let [first, last] = setup.columns;
            for (column, &x) in slopes[first..=last].iter().enumerate() {
                let w = [ex.x * x + offsets[0], ey.x * x + offsets[1], ez.x * x + offsets[2]];
                if w[0] >= 0.0 && w[1] >= 0.0 && w[2] >= 0.0 {
                    self.put(start + first + column, t, w, setup.volume);
                }
            }
        }
    }

    fn put(&mut self, pixel: usize, t: u32, w: [f64; 3], volume: f64) {
        let sum = w[0] + w[1] + w[2];
        let z = volume / sum;
        if sum <= 0.0 || z < NEAR || !z.is_finite() {
            return;
        }
        let (z, nearest) = (z as f32, self.depth[pixel]);
        if nearest == 0.0 || z < nearest {
            self.depth[pixel] = z;
            self.triangle[pixel] = t;
            self.weights[pixel] = w.map(|w| (w / sum) as f32);
        }
    }
}
