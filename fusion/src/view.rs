//! One frame prepared for fusion: filtered depth, normals and colour over the part of the image that is used.

use std::sync::Arc;

use toile_capture::{ColorImage, DepthImage, RgbImage, Sensor};
use toile_geometry::camera::PinholeCamera;

use crate::{element::Element, normals::surface_elements};

/// Filtered depth of the used part of an image, compact enough to keep a whole take.
#[derive(Debug, Clone, PartialEq)]
pub struct CutDepth {
    /// Ideal pinhole camera of the part.
    pub camera: PinholeCamera,
    /// Metres a unit.
    pub scale: f32,
    /// Row by row; 0 missing.
    pub values: Vec<u16>,
}

/// Surface elements, and colours, of the used part of an image.
#[derive(Debug, Clone)]
pub struct View {
    /// Ideal pinhole camera of the part.
    pub camera: PinholeCamera,
    /// One element a pixel, row by row, as [`surface_elements`] gives them; those along the border are empty.
    pub elements: Vec<Element>,
    /// sRGB of each element and 255, or 0 where the colour is not seen; or nothing at all.
    pub colors: Vec<[u8; 4]>,
}

impl CutDepth {
    /// The part of `depth` (metres, 0 missing) that holds measured pixels, with an unmeasured border, which may lie
    /// outside the image.
    pub fn new(camera: &PinholeCamera, depth: &[f32], scale: f32) -> Self {
        let (w, h) = (camera.width as usize, camera.height as usize);
        let (mut x0, mut x1, mut y0, mut y1) = (w, 0, h, 0);
        for (y, row) in depth.chunks(w.max(1)).enumerate().filter(|(_, row)| holds_any(row)) {
            let first = row.iter().position(|d| *d > 0.0).unwrap_or(w);
            let last = row.iter().rposition(|d| *d > 0.0).unwrap_or(0);
            (x0, x1, y0, y1) = (x0.min(first), x1.max(last + 1), y0.min(y), y + 1);
        }
        if x0 >= x1 {
            (x0, x1, y0, y1) = (0, 0, 0, 0);
        }
        let mut cut = *camera;
        (cut.width, cut.height) = ((x1 - x0 + 2) as u32, (y1 - y0 + 2) as u32);
        (cut.cx, cut.cy) = (camera.cx - x0 as f64 + 1.0, camera.cy - y0 as f64 + 1.0);
        let mut values = vec![0; cut.width as usize * cut.height as usize];
        for (row, y) in values.chunks_mut(x1 - x0 + 2).skip(1).zip(y0..y1) {
            for (value, d) in row[1..].iter_mut().zip(&depth[y * w + x0..y * w + x1]) {
                *value = (d / scale + 0.5).min(f32::from(u16::MAX)) as u16;
            }
        }
        Self { camera: cut, scale, values }
    }

    /// Pixels with a measurement.
    pub fn count(&self) -> usize {
        self.values.iter().filter(|v| **v != 0).count()
    }

    /// Depth in metres.
    pub fn meters(&self) -> Vec<f32> {
        self.values.iter().map(|v| f32::from(*v) * self.scale).collect()
    }

    /// Surface elements from normals averaged over `window` pixels to each side, without colour.
    pub fn view(&self, window: usize) -> View {
        View::new(&self.camera, &self.meters(), window)
    }
}

/// True where any pixel is measured.
fn holds_any(row: &[f32]) -> bool {
    row.chunks(64).any(|c| c.iter().fold(0.0, |m, &d| if d > m { d } else { m }) > 0.0)
}

impl View {
    /// The surface elements of a depth image (metres, 0 missing), without colour.
    pub fn new(camera: &PinholeCamera, depth: &[f32], window: usize) -> Self {
        Self { camera: *camera, elements: surface_elements(camera, depth, window), colors: Vec::new() }
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.camera.width as usize * self.camera.height as usize
    }

    /// Number of surface elements.
    pub fn count(&self) -> usize {
        self.elements.iter().filter(|e| e.is_some()).count()
    }

    /// Greatest depth of the elements (every third is looked at), metres; 1 of none.
    pub fn farthest(&self) -> f32 {
        let far = self.samples(3).map(|i| self.elements[i].depth()).fold(0.0, f32::max);
        if far > 0.0 { far } else { 1.0 }
    }

    /// The point of pixel `i`, camera frame; meaningless where the element is empty.
    #[inline]
    pub fn point(&self, i: usize) -> [f32; 3] {
        let w = self.camera.width as usize;
        unproject(&self.camera, (i % w) as f32, (i / w) as f32, self.elements[i].depth())
    }

    /// Point and unit normal (towards the camera) of pixel `i`, camera frame; `None` where its element is empty.
    #[inline]
    pub fn element(&self, i: usize) -> Option<([f32; 3], [f32; 3])> {
        let w = self.camera.width as usize;
        self.element_at(i % w, i / w)
    }

    /// The same of the pixel at a column and a row of the image.
    #[inline]
    pub fn element_at(&self, u: usize, v: usize) -> Option<([f32; 3], [f32; 3])> {
        let element = self.elements[v * self.camera.width as usize + u];
        if !element.is_some() {
            return None;
        }
        let z = element.depth();
        let [x, y, _] = unproject(&self.camera, u as f32, v as f32, 1.0);
        Some(([x * z, y * z, z], element.normal(x, y)))
    }

    /// Pixels with an element whose column and row are multiples of `stride`.
    pub fn samples(&self, stride: usize) -> impl Iterator<Item = usize> + '_ {
        let (w, h) = (self.camera.width as usize, self.camera.height as usize);
        (0..h)
            .step_by(stride)
            .flat_map(move |y| (0..w).step_by(stride).map(move |x| y * w + x))
            .filter(|&i| self.elements[i].is_some())
    }

    /// Looks up the colour of each element in a colour image of the same sensor.
    pub fn add_colors(&mut self, image: &RgbImage, sensor: &Sensor) {
        let camera = sensor.color.unwrap_or(sensor.depth);
        let color_from_depth = sensor.color_from_depth;
        let sx = f64::from(image.width) / f64::from(camera.width);
        let sy = f64::from(image.height) / f64::from(camera.height);
        self.colors = vec![[0; 4]; self.elements.len()];
        for i in (0..self.pixels()).filter(|i| self.elements[*i].is_some()) {
            let p = color_from_depth * nalgebra::Point3::from(self.point(i)).cast::<f64>();
            let inside = |q: &nalgebra::Point2<f64>| {
                let last = [f64::from(camera.width) - 0.5, f64::from(camera.height) - 0.5];
                q.x >= -0.5 && q.y >= -0.5 && q.x <= last[0] && q.y <= last[1]
            };
            if let Some(q) = camera.project(&p).filter(inside) {
                let [r, g, b] = bilinear(image, (q.x * sx) as f32, (q.y * sy) as f32);
                self.colors[i] = [r, g, b, 255];
            }
        }
    }
}

/// True for a depth that was measured.
#[inline]
pub fn is_measured(depth: f32) -> bool {
    depth > 0.0
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

/// Brings depth images of one sensor to metres as an ideal camera of the same focal lengths sees them.
#[derive(Debug, Clone)]
pub struct Rectifier {
    /// The ideal camera.
    pub camera: PinholeCamera,
    scale: f32,
    max_depth: f32,
    /// Source pixel of each pixel (`u32::MAX`: none); empty where the lens is ideal already.
    map: Vec<u32>,
}

impl Rectifier {
    /// For a sensor; depth beyond `max_depth` metres counts as missing.
    pub fn new(sensor: &Sensor, max_depth: f64) -> Self {
        let mut camera = sensor.depth;
        camera.distortion = [0.0; 5];
        let source = |ray: &[f32; 2]| {
            let q = sensor.depth.project(&nalgebra::Point3::new(f64::from(ray[0]), f64::from(ray[1]), 1.0))?;
            let (u, v) = (q.x.round(), q.y.round());
            let inside = u >= 0.0 && v >= 0.0 && u < f64::from(camera.width) && v < f64::from(camera.height);
            inside.then(|| v as u32 * camera.width + u as u32)
        };
        let distorted = sensor.depth.is_distorted();
        let map =
            if distorted { camera.rays().iter().map(|r| source(r).unwrap_or(u32::MAX)).collect() } else { vec![] };
        Self { camera, scale: sensor.depth_scale as f32, max_depth: max_depth as f32, map }
    }

    /// Depth in metres (nearest pixel); 0 where missing, saturated or too far.
    pub fn rectify(&self, image: &DepthImage) -> Vec<f32> {
        let meters = |v: u16| {
            let d = f32::from(v) * self.scale;
            if v == u16::MAX || d > self.max_depth { 0.0 } else { d }
        };
        if self.map.is_empty() {
            return image.values.iter().map(|v| meters(*v)).collect();
        }
        self.map.iter().map(|&i| image.values.get(i as usize).map_or(0.0, |v| meters(*v))).collect()
    }
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

#[cfg(test)]
mod tests {
    use toile_capture::DeviceIdentity;
    use toile_geometry::Rigid;

    use super::*;

    /// The colour camera sees the middle half of the depth camera's picture: what lies beyond has no colour, and not
    /// that of the picture's rim.
    #[test]
    fn pixels_beyond_the_colour_picture_have_no_colour() {
        let depth = PinholeCamera::ideal(80, 60, 100.0, 100.0, 39.5, 29.5);
        let sensor = Sensor {
            name: "narrow".into(),
            identity: DeviceIdentity::default(),
            depth,
            depth_scale: 0.001,
            color: Some(PinholeCamera::ideal(80, 60, 200.0, 200.0, 39.5, 29.5)),
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps: 30.0,
        };
        let mut view = View::new(&depth, &[1.5; 80 * 60], 2);
        view.add_colors(&RgbImage { width: 80, height: 60, pixels: vec![[9, 8, 7]; 80 * 60] }, &sensor);
        for i in (0..80 * 60).filter(|i| view.elements[*i].is_some()) {
            let is_seen = (20..60).contains(&(i % 80)) && (15..45).contains(&(i / 80));
            assert_eq!(view.colors[i], if is_seen { [9, 8, 7, 255] } else { [0; 4] }, "{} {}", i % 80, i / 80);
        }
    }
}
