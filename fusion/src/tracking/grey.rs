//! Colour images as pyramids of grey values.

use nalgebra::{Point3, Vector3};
use toile_capture::{RgbImage, Sensor};
use toile_geometry::{Rigid, camera::PinholeCamera};

/// Grey images, each half of the one before, finest first.
pub(crate) const LEVELS: usize = 3;

/// A colour image as grey values, with its camera.
pub(crate) struct Picture {
    camera: PinholeCamera,
    color_from_depth: Rigid,
    levels: Vec<Grey>,
}

/// Grey values of one size.
struct Grey {
    width: usize,
    height: usize,
    /// Columns and rows of this size over those of the camera.
    scale: [f32; 2],
    values: Vec<f32>,
}

/// Grey value at a point.
pub(crate) struct GreyAt {
    pub value: f32,
    /// Change of the value along the point's position, depth camera's frame, a metre.
    pub gradient: Vector3<f32>,
}

impl Picture {
    /// The finest level is as large as the depth image or a little larger.
    pub(crate) fn new(image: &RgbImage, sensor: &Sensor) -> Self {
        let camera = sensor.color.unwrap_or(sensor.depth);
        let mut grey = Grey::new(image, &camera);
        while grey.width >= 2 * sensor.depth.width as usize {
            grey = grey.halved();
        }
        let mut levels = vec![grey];
        while levels.len() < LEVELS {
            levels.push(levels[levels.len() - 1].halved());
        }
        Self { camera, color_from_depth: sensor.color_from_depth, levels }
    }

    /// The grey value of a point (depth camera's frame) on a level; `None` outside the picture.
    pub(crate) fn look_up(&self, level: usize, p: &Point3<f32>) -> Option<GreyAt> {
        let q = self.color_from_depth * p.cast::<f64>();
        let grey = &self.levels[level];
        let pixel = self.camera.project(&q)?;
        let [u, v] = [(pixel.x as f32 + 0.5) * grey.scale[0] - 0.5, (pixel.y as f32 + 0.5) * grey.scale[1] - 0.5];
        let (value, [du, dv]) = grey.at(u, v)?;
        let (x, y, z) = (q.x as f32, q.y as f32, q.z as f32);
        let (du, dv) = (du * grey.scale[0] * self.camera.fx as f32 / z, dv * grey.scale[1] * self.camera.fy as f32 / z);
        let along = Vector3::new(du, dv, -(du * x + dv * y) / z);
        Some(GreyAt { value, gradient: self.color_from_depth.rotation.inverse().cast::<f32>() * along })
    }
}

impl Grey {
    fn new(image: &RgbImage, camera: &PinholeCamera) -> Self {
        let values = image.pixels.iter().map(|p| p.iter().map(|c| f32::from(*c)).sum::<f32>() / 3.0).collect();
        let (width, height) = (image.width as usize, image.height as usize);
        let scale = [width as f32 / camera.width as f32, height as f32 / camera.height as f32];
        Self { width, height, scale, values }
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mean = |i: usize| {
            let at = i / width.max(1) * 2 * self.width + i % width.max(1) * 2;
            [at, at + 1, at + self.width, at + self.width + 1].iter().map(|&k| self.values[k]).sum::<f32>() / 4.0
        };
        Self { width, height, scale: self.scale.map(|s| s / 2.0), values: (0..width * height).map(mean).collect() }
    }

    /// Bilinear value and central differences; `None` near the border.
    fn at(&self, u: f32, v: f32) -> Option<(f32, [f32; 2])> {
        let inside = u >= 1.0 && v >= 1.0 && u + 2.0 < self.width as f32 && v + 2.0 < self.height as f32;
        let value = |u: f32, v: f32| {
            let (x, y) = (u as usize, v as usize);
            let (a, b) = (u - x as f32, v - y as f32);
            let row = |y: usize| self.values[y * self.width + x] * (1.0 - a) + self.values[y * self.width + x + 1] * a;
            row(y) * (1.0 - b) + row(y + 1) * b
        };
        let slope = |du: f32, dv: f32| (value(u + du, v + dv) - value(u - du, v - dv)) / 2.0;
        inside.then(|| (value(u, v), [slope(0.5, 0.0) * 2.0, slope(0.0, 0.5) * 2.0]))
    }
}
