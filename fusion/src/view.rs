//! One frame prepared for fusion: filtered depth, normals and colour over the part of the image that is used.

use std::sync::Arc;

use toile_capture::{ColorImage, DepthImage, RgbImage, Sensor};
use toile_geometry::camera::PinholeCamera;

/// Depth value of a pixel that saw past the volume: the ray is free.
pub const FREE: f32 = f32::INFINITY;

/// Stored marker of [`FREE`] in a [`CutDepth`].
const FREE_UNITS: u16 = u16::MAX;

/// Filtered depth of the used part of an image, compact enough to keep a whole take.
#[derive(Debug, Clone, PartialEq)]
pub struct CutDepth {
    /// Ideal pinhole camera of the part.
    pub camera: PinholeCamera,
    /// Metres a unit.
    pub scale: f32,
    /// Row by row; 0 missing, `u16::MAX` free.
    pub values: Vec<u16>,
}

/// Depth, normals and weights of the used part of an image.
#[derive(Debug, Clone)]
pub struct View {
    /// Ideal pinhole camera of the part.
    pub camera: PinholeCamera,
    /// Metres along +Z; 0 missing, [`FREE`] where the ray passes the volume.
    pub depth: Vec<f32>,
    /// Unit normals towards the camera, zero where unknown.
    pub normals: Vec<[f32; 3]>,
    /// sRGB of each pixel, or empty.
    pub colors: Vec<[u8; 3]>,
}

impl CutDepth {
    /// The part of `depth` (metres, [`FREE`] and 0 allowed) that holds measured pixels, with a border of two.
    pub fn new(camera: &PinholeCamera, depth: &[f32], scale: f32) -> Self {
        let (w, h) = (camera.width as usize, camera.height as usize);
        let (mut x0, mut x1, mut y0, mut y1) = (w, 0, h, 0);
        for (i, &d) in depth.iter().enumerate() {
            if is_measured(d) {
                let (x, y) = (i % w, i / w);
                (x0, x1, y0, y1) = (x0.min(x), x1.max(x), y0.min(y), y1.max(y));
            }
        }
        if x0 > x1 {
            (x0, x1, y0, y1) = (0, 0, 0, 0);
        }
        let (x0, y0) = (x0.saturating_sub(2), y0.saturating_sub(2));
        let (x1, y1) = ((x1 + 2).min(w - 1), (y1 + 2).min(h - 1));
        let mut cut = *camera;
        (cut.width, cut.height) = ((x1 - x0 + 1) as u32, (y1 - y0 + 1) as u32);
        (cut.cx, cut.cy) = (camera.cx - x0 as f64, camera.cy - y0 as f64);
        let unit = |d: f32| match d {
            FREE => FREE_UNITS,
            d => (d / scale).round().clamp(0.0, f32::from(FREE_UNITS - 1)) as u16,
        };
        let values = (y0..=y1).flat_map(|y| depth[y * w + x0..=y * w + x1].iter().map(|&d| unit(d))).collect();
        Self { camera: cut, scale, values }
    }

    /// Pixels with a measurement.
    pub fn count(&self) -> usize {
        self.values.iter().filter(|&&v| v != 0 && v != FREE_UNITS).count()
    }

    /// Depth in metres.
    pub fn meters(&self) -> Vec<f32> {
        self.values.iter().map(|&v| if v == FREE_UNITS { FREE } else { f32::from(v) * self.scale }).collect()
    }

    /// Depth with normals (averaged over `window` pixels to each side), without colour.
    pub fn view(&self, window: usize) -> View {
        let depth = self.meters();
        let normals = crate::normals::normals_from_depth(&self.camera, &depth, window);
        View { camera: self.camera, depth, normals, colors: Vec::new() }
    }
}

impl View {
    /// The point of pixel `i`, camera frame; meaningless where depth is missing.
    #[inline]
    pub fn point(&self, i: usize) -> [f32; 3] {
        let w = self.camera.width as usize;
        unproject(&self.camera, (i % w) as f32, (i / w) as f32, self.depth[i])
    }

    /// Pixels with depth and normal whose column and row are multiples of `stride`.
    pub fn samples(&self, stride: usize) -> impl Iterator<Item = usize> + '_ {
        let (w, h) = (self.camera.width as usize, self.camera.height as usize);
        (0..h)
            .step_by(stride)
            .flat_map(move |y| (0..w).step_by(stride).map(move |x| y * w + x))
            .filter(|&i| is_measured(self.depth[i]) && self.normals[i] != [0.0; 3])
    }

    /// Looks up the colour of each measured pixel in a colour image of the same sensor.
    pub fn add_colors(&mut self, image: &RgbImage, sensor: &Sensor) {
        let camera = sensor.color.unwrap_or(sensor.depth);
        let color_from_depth = sensor.color_from_depth;
        let sx = f64::from(image.width) / f64::from(camera.width);
        let sy = f64::from(image.height) / f64::from(camera.height);
        self.colors = (0..self.depth.len())
            .map(|i| {
                if !is_measured(self.depth[i]) {
                    return [0; 3];
                }
                let [x, y, z] = self.point(i);
                let p = color_from_depth * nalgebra::Point3::new(f64::from(x), f64::from(y), f64::from(z));
                camera.project(&p).map_or([0; 3], |q| bilinear(image, (q.x * sx) as f32, (q.y * sy) as f32))
            })
            .collect();
    }
}

/// True for a depth that was measured (neither missing nor free).
#[inline]
pub fn is_measured(depth: f32) -> bool {
    depth > 0.0 && depth < FREE
}

/// The point seen at pixel (u, v) of an ideal camera.
#[inline]
pub fn unproject(camera: &PinholeCamera, u: f32, v: f32, z: f32) -> [f32; 3] {
    [(u - camera.cx as f32) / camera.fx as f32 * z, (v - camera.cy as f32) / camera.fy as f32 * z, z]
}

/// Decodes colour if there is any; a broken colour image is no reason to lose the depth.
pub fn decode_color(color: Option<&ColorImage>, index: u64) -> Option<Arc<RgbImage>> {
    color.and_then(|c| c.decode(index).ok())
}

/// Depth in metres as an ideal camera of the same focal lengths sees it (nearest pixel); 0 where missing or beyond
/// `max_depth`.
pub fn rectified_depth(image: &DepthImage, sensor: &Sensor, max_depth: f64) -> (PinholeCamera, Vec<f32>) {
    let scale = sensor.depth_scale as f32;
    let limit = max_depth as f32;
    let meters = |v: u16| {
        let d = f32::from(v) * scale;
        if v == u16::MAX || d > limit { 0.0 } else { d }
    };
    let mut ideal = sensor.depth;
    if !sensor.depth.is_distorted() {
        return (ideal, image.values.iter().map(|&v| meters(v)).collect());
    }
    ideal.distortion = [0.0; 5];
    let ideal_rays = ideal.rays();
    let at = |ray: &[f32; 2]| {
        let p = nalgebra::Point3::new(f64::from(ray[0]), f64::from(ray[1]), 1.0);
        let q = sensor.depth.project(&p)?;
        let (u, v) = (q.x.round(), q.y.round());
        (u >= 0.0 && v >= 0.0).then(|| meters(image.at(u as u32, v as u32)))
    };
    (ideal, ideal_rays.iter().map(|r| at(r).unwrap_or(0.0)).collect())
}

fn bilinear(image: &RgbImage, x: f32, y: f32) -> [u8; 3] {
    let (w, h) = (image.width as usize, image.height as usize);
    let (x, y) = (x.clamp(0.0, (w - 1) as f32), y.clamp(0.0, (h - 1) as f32));
    let (x0, y0) = (x as usize, y as usize);
    let (x1, y1) = ((x0 + 1).min(w - 1), (y0 + 1).min(h - 1));
    let (fx, fy) = (x - x0 as f32, y - y0 as f32);
    let at = |x: usize, y: usize, c: usize| f32::from(image.pixels[y * w + x][c]);
    std::array::from_fn(|c| {
        let top = at(x0, y0, c) * (1.0 - fx) + at(x1, y0, c) * fx;
        let low = at(x0, y1, c) * (1.0 - fx) + at(x1, y1, c) * fx;
        (top * (1.0 - fy) + low * fy).round() as u8
    })
}
