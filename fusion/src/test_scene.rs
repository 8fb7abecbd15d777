//! A figure of capsules that turns on a disk before a wall, rendered by sphere tracing: truth for the tests.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_capture::{CaptureError, ColorImage, DepthImage, DeviceIdentity, Frame, RgbImage, Rig, Sensor, Source};
use toile_geometry::{Rigid, camera::PinholeCamera};

/// Capsules (two ends, radius) in the figure's frame: +Y up, feet at 0, facing +Z.
const FIGURE: [([f64; 3], [f64; 3], f64); 9] = [
    ([-0.06, 1.05, 0.0], [0.06, 1.05, 0.0], 0.13),
    ([-0.09, 1.30, 0.01], [0.09, 1.30, 0.01], 0.12),
    ([0.0, 1.42, 0.0], [0.0, 1.62, 0.02], 0.085),
    ([0.0, 1.58, 0.10], [0.0, 1.55, 0.12], 0.02),
    ([-0.17, 1.36, 0.0], [-0.52, 0.98, 0.06], 0.045),
    ([0.17, 1.36, 0.0], [0.50, 0.95, -0.03], 0.050),
    ([-0.10, 0.95, 0.0], [-0.20, 0.07, 0.0], 0.068),
    ([0.10, 0.95, 0.0], [0.19, 0.07, -0.02], 0.072),
    ([0.0, 1.15, -0.05], [0.0, 1.30, -0.10], 0.07),
];
/// Feet: from the ankle forward.
const FEET: [([f64; 3], [f64; 3], f64); 2] =
    [([-0.20, 0.05, -0.02], [-0.23, 0.05, 0.14], 0.05), ([0.19, 0.05, -0.04], [0.24, 0.05, 0.12], 0.05)];

/// Signed distance to the figure, figure frame.
pub(crate) fn figure_distance(p: &Point3<f64>) -> f64 {
    let one = |(a, b, r): &([f64; 3], [f64; 3], f64)| {
        let (a, b) = (Vector3::from(*a), Vector3::from(*b));
        let t = ((p.coords - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (p.coords - a - (b - a) * t).norm() - r
    };
    FIGURE.iter().chain(&FEET).map(one).fold(f64::INFINITY, f64::min)
}

/// Signed distance to a column with round ends, figure frame: it may turn without its surface moving.
pub(crate) fn column_distance(p: &Point3<f64>) -> f64 {
    (p.coords - Vector3::new(0.0, p.y.clamp(0.3, 1.4), 0.0)).norm() - 0.18
}

/// A smooth pattern without symmetry, figure frame.
fn paint(p: &Point3<f64>) -> [u8; 3] {
    let a = p.x.atan2(p.z);
    let wave = (2.0 * a + 4.0 * p.y).sin() + 0.8 * (5.0 * a - 9.0 * p.y).sin() + 0.7 * (7.0 * a + 14.0 * p.y).cos();
    [(128.0 + 45.0 * wave) as u8; 3]
}

/// The images that are rendered.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// Signed distance to the figure, figure frame.
    pub shape: fn(&Point3<f64>) -> f64,
    pub with_color: bool,
    pub camera: PinholeCamera,
    /// Resting camera in the room: +Y up, origin on the axis at the disk's top.
    pub room_from_camera: Rigid,
    pub with_floor: bool,
    pub with_wall: bool,
    /// Half width of uniform depth noise, metres.
    pub noise: f64,
    /// Half width of uniform noise that blocks of four pixels square share, metres.
    pub blotches: f64,
}

impl Scene {
    /// A small depth camera 2.3 m away at 1 m height, looking 5° down, rolled by 2°.
    pub(crate) fn new() -> Self {
        let look = UnitQuaternion::from_euler_angles(std::f64::consts::PI - 0.087, 0.0, 0.035);
        Self {
            shape: figure_distance,
            with_color: false,
            camera: PinholeCamera::ideal(176, 152, 150.0, 150.0, 87.5, 76.0),
            room_from_camera: Isometry3::from_parts(Translation3::new(0.02, 1.0, 2.3), look),
            with_floor: true,
            with_wall: true,
            noise: 0.002,
            blotches: 0.0,
        }
    }

    /// Depth in millimetres of the figure turned by `angle`, radians; `None`: an empty room.
    pub(crate) fn render(&self, angle: Option<f64>, seed: u64) -> DepthImage {
        let (w, h) = (self.camera.width, self.camera.height);
        let figure_from_room = angle.map(|a| Isometry3::rotation(Vector3::y() * -a));
        let pixel = |i: u32| {
            let ray = self.camera.unproject(f64::from(i % w), f64::from(i / w), 1.0).coords;
            let room = self.background(&ray);
            let body = figure_from_room.and_then(|f| trace(self.shape, &(f * self.room_from_camera), &ray));
            let depth = body.map_or(room, |b| b.min(room));
            if !depth.is_finite() || depth > 6.0 {
                return 0;
            }
            let noise = self.noise * (hash(seed << 32 | u64::from(i)) * 2.0 - 1.0);
            let block = u64::from(((i / w / 4) << 16) | (i % w / 4));
            let blotch = self.blotches * (hash(!seed << 32 | block) * 2.0 - 1.0);
            ((depth + noise + blotch) * 1000.0).round() as u16
        };
        DepthImage { width: w, height: h, values: (0..w * h).into_par_iter().map(pixel).collect() }
    }

    /// Colours of the figure turned by `angle`, registered to the depth.
    fn render_color(&self, angle: f64) -> RgbImage {
        let (w, h) = (self.camera.width, self.camera.height);
        let figure_from_camera = self.figure_from_camera(angle);
        let pixel = |i: u32| {
            let ray = self.camera.unproject(f64::from(i % w), f64::from(i / w), 1.0).coords;
            let hit = trace(self.shape, &figure_from_camera, &ray);
            hit.map_or([30; 3], |t| paint(&(figure_from_camera * Point3::from(ray * t))))
        };
        RgbImage { width: w, height: h, pixels: (0..w * h).into_par_iter().map(pixel).collect() }
    }

    /// Depth of floor, disk and wall along a camera ray.
    fn background(&self, ray: &Vector3<f64>) -> f64 {
        let eye = self.room_from_camera.translation.vector;
        let d = self.room_from_camera.rotation * ray;
        let mut depth = f64::INFINITY;
        if self.with_floor && d.y < 0.0 {
            let disk = -eye.y / d.y;
            let on = eye + d * disk;
            depth = if on.x.hypot(on.z) < 0.4 { disk } else { (-0.06 - eye.y) / d.y };
        }
        if self.with_wall && d.z < 0.0 {
            depth = depth.min((-1.3 - eye.z) / d.z);
        }
        depth
    }

    /// Truth: the camera in the figure's frame when it is turned by `angle`.
    pub(crate) fn figure_from_camera(&self, angle: f64) -> Rigid {
        Isometry3::rotation(Vector3::y() * -angle) * self.room_from_camera
    }

    pub(crate) fn rig(&self) -> Rig {
        let sensor = Sensor {
            name: "test".into(),
            identity: DeviceIdentity::default(),
            depth: self.camera,
            depth_scale: 0.001,
            color: None,
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps: 5.0,
        };
        Rig { sensors: vec![sensor] }
    }

    /// Frames at the given turns, 0.2 s apart.
    pub(crate) fn frames(&self, angles: &[Option<f64>]) -> Vec<Frame> {
        let frame = |(i, angle): (usize, &Option<f64>)| Frame {
            sensor: 0,
            index: i as u64,
            device_frame: i as u64,
            lost_before: 0,
            device_time_ns: 200_000_000 * i as i64,
            host_time_ns: 200_000_000 * i as i64,
            depth: Some(Arc::new(self.render(*angle, i as u64 + 1))),
            color: angle.filter(|_| self.with_color).map(|a| ColorImage::Rgb(Arc::new(self.render_color(a)))),
        };
        angles.iter().enumerate().map(frame).collect()
    }

    pub(crate) fn source(&self, angles: &[Option<f64>]) -> Memory {
        Memory { rig: self.rig(), frames: self.frames(angles), next: 0 }
    }
}

/// Turns in steps of `degrees`.
pub(crate) fn steps(count: usize, degrees: f64) -> Vec<Option<f64>> {
    (0..count).map(|i| Some((degrees * i as f64).to_radians())).collect()
}

fn trace(shape: fn(&Point3<f64>) -> f64, figure_from_camera: &Rigid, ray: &Vector3<f64>) -> Option<f64> {
    let length = ray.norm();
    let mut t = 1.2;
    for _ in 0..80 {
        let d = shape(&(figure_from_camera * Point3::from(ray * t)));
        if d < 1e-5 {
            return Some(t);
        }
        t += d / length;
        if t > 3.5 {
            return None;
        }
    }
    None
}

/// A uniform number from a counter.
fn hash(mut x: u64) -> f64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ x >> 31) >> 11) as f64 / (1u64 << 53) as f64
}

/// Frames in memory as a source.
pub(crate) struct Memory {
    pub rig: Rig,
    pub frames: Vec<Frame>,
    pub next: usize,
}

impl Source for Memory {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        self.next += 1;
        Ok(self.frames.get(self.next - 1).cloned())
    }

    fn frame_count(&self) -> Option<u64> {
        Some(self.frames.len() as u64)
    }
}
