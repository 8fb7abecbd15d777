//! Depth images as an ideal camera sees them.

use toile_capture::{DepthImage, Sensor};
use toile_geometry::camera::PinholeCamera;

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
