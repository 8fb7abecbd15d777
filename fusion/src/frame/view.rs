//! One frame prepared for fusion: surface elements and colours of the part of the image that is used.

use std::sync::Arc;

use toile_capture::{ColorImage, RgbImage, Sensor};
use toile_geometry::{camera::PinholeCamera, element::Element};

use super::normals::surface_elements;

/// Surface elements, and colours, of the used part of an image.
#[derive(Debug, Clone)]
pub struct DepthView {
    /// Ideal pinhole camera of the part.
    pub camera: PinholeCamera,
    /// One element a pixel, row by row, as [`surface_elements`] gives them; those along the border are empty.
    pub elements: Vec<Element>,
    /// sRGB of each element and 255, or 0 where the colour is not seen; or nothing at all.
    pub colors: Vec<[u8; 4]>,
}

impl DepthView {
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

    /// Largest depth of the elements (every third is looked at), metres; 1 where there are none.
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

/// Decodes colour if there is any; a broken colour image must not cost the depth.
pub fn decode_color(color: Option<&ColorImage>, index: u64) -> Option<Arc<RgbImage>> {
    color.and_then(|c| c.decode(index).ok())
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
        let mut view = DepthView::new(&depth, &vec![1.5; 80 * 60], 2);
        view.add_colors(&RgbImage { width: 80, height: 60, pixels: vec![[9, 8, 7]; 80 * 60] }, &sensor);
        for i in (0..80 * 60).filter(|i| view.elements[*i].is_some()) {
            let is_seen = (20..60).contains(&(i % 80)) && (15..45).contains(&(i / 80));
            assert_eq!(view.colors[i], if is_seen { [9, 8, 7, 255] } else { [0; 4] }, "{} {}", i % 80, i / 80);
        }
    }
}
