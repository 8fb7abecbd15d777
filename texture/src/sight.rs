//! What a picture shows of each vertex: where, how well, and in which colour at large.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{
    Mesh,
    raster::{Camera, Raster, rasterize},
};

use crate::photo::{COARSE, Shot};

/// Pixels along the side of a pixel of the depth picture that hidden vertices are found with.
const STEP: usize = 2;
/// A vertex is hidden where something lies in front of it by more, metres: the noise of a scan and the length of its edges.
const IN_FRONT: f64 = 0.008;
/// Something behind a vertex by more is another surface, metres.
const BEHIND: f64 = 0.02;
/// Within these many pixels of the depth picture of something in front, a vertex is not used: the lens mixes the two.
const APART: usize = 2;
/// Smallest cosine between a vertex's normal and its way to the camera. Beyond 75 degrees a pixel is four times as long on the
/// surface as it is wide.
const MIN_COSINE: f32 = 0.26;
/// Passes over neighbours that free normals of noise: over about a centimetre of a scan.
const NORMAL_PASSES: usize = 4;
/// Neighbour rings over which a vertex's quality rises from a place that is not seen.
const FEATHER: usize = 3;

/// One picture's sight of all vertices.
pub(crate) struct Sight {
    /// Column and row in the picture's part.
    pub pixel: Vec<[f32; 2]>,
    /// How well it is seen: the sine of half the angle that a millimetre of it takes up, over that of the best possible; 0 where it is not.
    pub quality: Vec<f32>,
    /// Colour at large, linear light, where it is seen.
    pub color: Vec<[f32; 3]>,
}

/// A mesh ready to be looked at.
pub(crate) struct Surface<'a> {
    pub mesh: &'a Mesh,
    pub normals: Vec<Vector3<f32>>,
    /// Normals without the noise of the scan, by which light falls.
    pub smooth: Vec<Vector3<f32>>,
    /// Neighbours of each vertex in compressed rows.
    pub neighbours: Neighbours,
}

/// Neighbours of each vertex in compressed rows.
pub(crate) struct Neighbours {
    starts: Vec<u32>,
    others: Vec<u32>,
}

impl Neighbours {
    pub(crate) fn new(mesh: &Mesh) -> Self {
        let edges = toile_geometry::topology::Edges::new(&mesh.triangles).vertices;
        let mut starts = vec![0u32; mesh.positions.len() + 1];
        edges.iter().flatten().for_each(|&v| starts[v as usize + 1] += 1);
        (1..starts.len()).for_each(|v| starts[v] += starts[v - 1]);
        let (mut fill, mut others) = (starts.clone(), vec![0; 2 * edges.len()]);
        for [a, b] in edges {
            for (p, q) in [(a, b), (b, a)] {
                others[fill[p as usize] as usize] = q;
                fill[p as usize] += 1;
            }
        }
        Self { starts, others }
    }

    #[inline]
    pub(crate) fn of(&self, v: usize) -> &[u32] {
        &self.others[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}

impl<'a> Surface<'a> {
    pub(crate) fn new(mesh: &'a Mesh) -> Self {
        let (normals, neighbours) = (mesh.vertex_normals(), Neighbours::new(mesh));
        let mut smooth = normals.clone();
        for _ in 0..NORMAL_PASSES {
            let before = smooth.clone();
            smooth.par_iter_mut().enumerate().for_each(|(v, normal)| {
                let around: Vector3<f32> = neighbours.of(v).iter().map(|&n| before[n as usize]).sum();
                *normal = (before[v] + around).try_normalize(1e-6).unwrap_or(before[v]);
            });
        }
        Self { mesh, normals, smooth, neighbours }
    }
}

impl Sight {
    pub(crate) fn new(shot: &Shot, surface: &Surface) -> Self {
        let mesh = surface.mesh;
        let depth = Depth::new(shot, mesh);
        let eye = shot.eye();
        let (mut pixel, mut quality) = (Vec::with_capacity(mesh.positions.len()), Vec::new());
        for (p, normal) in mesh.positions.iter().zip(&surface.normals) {
            let seen = shot.seen(p);
            let place = shot
                .camera
                .project(&seen)
                .map_or([-1e6; 2], |q| [(q.x - shot.corner[0] as f64) as f32, (q.y - shot.corner[1] as f64) as f32]);
            let way = (eye - p.cast::<f64>()).cast::<f32>();
            let cosine = normal.dot(&way) / way.norm().max(1e-6);
            pixel.push(place);
            let is_seen = cosine > MIN_COSINE && inside(shot, place);
            let share = if is_seen { depth.shows(shot, &seen, f64::from(cosine)) } else { 0.0 };
            quality.push(share * share * cosine / way.norm());
        }
        feather(&mut quality, &surface.neighbours);
        let masked = depth.masked_colors(shot);
        let color = pixel.iter().zip(&quality).map(|(p, q)| if *q > 0.0 { masked.at(*p) } else { [0.0; 3] }).collect();
        Self { pixel, quality, color }
    }
}

/// True where the spline has all its pixels.
fn inside(shot: &Shot, [x, y]: [f32; 2]) -> bool {
    x >= 2.0 && y >= 2.0 && x <= shot.width as f32 - 4.0 && y <= shot.height as f32 - 4.0
}

/// Lowers the quality near vertices that are not seen, so that pictures go over into each other there.
fn feather(quality: &mut [f32], neighbours: &Neighbours) {
    let mut ring: Vec<u8> = quality.iter().map(|q| if *q > 0.0 { FEATHER as u8 } else { 0 }).collect();
    for step in 1..FEATHER as u8 {
        let before = ring.clone();
        for v in 0..ring.len() {
            if before[v] > step && neighbours.of(v).iter().any(|&n| before[n as usize] < step) {
                ring[v] = step;
            }
        }
    }
    for (q, ring) in quality.iter_mut().zip(ring) {
        *q *= f32::from(ring) / FEATHER as f32;
    }
}

/// Depth of the surface in squares of `STEP` pixels of the picture's part.
struct Depth {
    raster: Raster,
}

impl Depth {
    fn new(shot: &Shot, mesh: &Mesh) -> Self {
        let (step, camera) = (STEP as f64, shot.camera);
        let mut lens = camera.undistorted();
        lens.width = shot.width.div_ceil(STEP) as u32;
        lens.height = shot.height.div_ceil(STEP) as u32;
        (lens.fx, lens.fy) = (camera.fx / step, camera.fy / step);
        lens.cx = (camera.cx - shot.corner[0] as f64) / step;
        lens.cy = (camera.cy - shot.corner[1] as f64) / step;
        Self { raster: rasterize(mesh, &Camera { lens, camera_from_world: shot.camera_from_surface }) }
    }

    /// How much of the window around a point in the camera's frame shows the surface that it lies on, 0 to 1: less beside an outline,
    /// where the lens mixes in what lies behind, and nothing where something lies in front.
    fn shows(&self, shot: &Shot, point: &Point3<f64>, cosine: f64) -> f32 {
        let ideal = |f: f64, c: f64, slope: f64, corner: usize| {
            ((f * slope + c - corner as f64) / STEP as f64).round().max(0.0) as usize
        };
        let camera = &shot.camera;
        let u = ideal(camera.fx, camera.cx, point.x / point.z, shot.corner[0]).min(self.raster.width - 1);
        let v = ideal(camera.fy, camera.cy, point.y / point.z, shot.corner[1]).min(self.raster.height - 1);
        // The surface itself comes nearer, and goes away, by this on the way to the edge of the window.
        let slope = (1.0 - cosine * cosine).sqrt() / cosine * ((APART * STEP) as f64 + 1.0) * point.z / camera.fx;
        let (mut same, mut all) = (0u32, 0u32);
        for y in v.saturating_sub(APART)..(v + APART + 1).min(self.raster.height) {
            for x in u.saturating_sub(APART)..(u + APART + 1).min(self.raster.width) {
                let depth = f64::from(self.raster.depth[y * self.raster.width + x]);
                if depth > 0.0 && point.z - depth > IN_FRONT + slope {
                    return 0.0;
                }
                all += 1;
                same += u32::from(depth > 0.0 && depth - point.z < BEHIND + slope);
            }
        }
        same as f32 / all.max(1) as f32
    }

    /// The coarse picture blurred over what shows the surface alone.
    fn masked_colors(&self, shot: &Shot) -> Masked {
        let [width, height] = shot.coarse_size();
        let per = COARSE / STEP;
        let shows = |i: usize| {
            let (u, v) = (i % width * per, i / width * per);
            let all = |y: usize| (u..u + per).all(|x| self.is_surface(x, y));
            (v..v + per).all(all)
        };
        let mut cells: Vec<[f32; 4]> = (0..width * height)
            .map(|i| if shows(i) { [shot.coarse[i][0], shot.coarse[i][1], shot.coarse[i][2], 1.0] } else { [0.0; 4] })
            .collect();
        blur(&mut cells, width, height);
        Masked { cells, width, height }
    }

    /// True where the surface is seen and does not jump beside.
    fn is_surface(&self, x: usize, y: usize) -> bool {
        if x == 0 || y == 0 || x + 1 >= self.raster.width || y + 1 >= self.raster.height {
            return false;
        }
        let at = |x: usize, y: usize| self.raster.depth[y * self.raster.width + x];
        let (mut lo, mut hi) = (f32::MAX, 0.0f32);
        for v in y - 1..=y + 1 {
            for u in x - 1..=x + 1 {
                (lo, hi) = (lo.min(at(u, v)), hi.max(at(u, v)));
            }
        }
        lo > 0.0 && hi - lo < 0.02 * hi
    }
}

/// Colours and how much of each is known.
struct Masked {
    cells: Vec<[f32; 4]>,
    width: usize,
    height: usize,
}

impl Masked {
    /// The colour at a pixel of the part; black where nothing is known.
    fn at(&self, [x, y]: [f32; 2]) -> [f32; 3] {
        let half = (COARSE as f32 - 1.0) / 2.0;
        let x = ((x - half) / COARSE as f32).clamp(0.0, self.width as f32 - 1.001);
        let y = ((y - half) / COARSE as f32).clamp(0.0, self.height as f32 - 1.001);
        let (u, v) = (x as usize, y as usize);
        let (fx, fy) = (x - u as f32, y - v as f32);
        let (right, below) = (usize::from(u + 1 < self.width), usize::from(v + 1 < self.height));
        let mut sum = [0.0f32; 4];
        for (du, wx) in [(0, 1.0 - fx), (right, fx)] {
            for (dv, wy) in [(0, 1.0 - fy), (below, fy)] {
                let cell = self.cells[(v + dv) * self.width + u + du];
                (0..4).for_each(|k| sum[k] += wx * wy * cell[k]);
            }
        }
        if sum[3] > 0.02 { [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]] } else { [0.0; 3] }
    }
}

/// Three passes of a box of three along both axes: a Gaussian of 1.4 squares.
fn blur(cells: &mut [[f32; 4]], width: usize, height: usize) {
    let mut copy = cells.to_vec();
    for _ in 0..3 {
        for (stride, count) in [(1, width), (width, height)] {
            copy.copy_from_slice(cells);
            for (i, cell) in cells.iter_mut().enumerate() {
                let place = i / stride % count;
                let before = if place > 0 { copy[i - stride] } else { copy[i] };
                let after = if place + 1 < count { copy[i + stride] } else { copy[i] };
                *cell = std::array::from_fn(|k| (before[k] + copy[i][k] + after[k]) / 3.0);
            }
        }
    }
}
