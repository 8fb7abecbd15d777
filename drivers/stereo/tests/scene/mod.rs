//! A scene of known depth before two cameras with bent lenses: a tilted wall and a ball, textured all over.

use std::sync::{Arc, OnceLock};

use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use toile_capture::RgbImage;
use toile_stereo::{Lens, StereoCalibration};

/// Columns and rows of one view.
pub const SIZE: (u32, u32) = (400, 300);

/// Texture's finest cell, metres: some three pixels at the wall.
const CELL: f64 = 0.016;

/// Two cameras 11 cm apart, the right one turned a little, with different lenses.
pub fn calibration() -> StereoCalibration {
    let lens = |f: f64, cx: f64, cy: f64, distortion: [f64; 8]| Lens { fx: f, fy: f * 1.003, cx, cy, distortion };
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.008, -0.02, 0.006));
    StereoCalibration {
        left: lens(420.0, 203.2, 147.1, [-0.12, 0.05, 0.0007, -0.0004, 0.0, 0.0, 0.0, 0.0]),
        right: lens(418.0, 195.4, 151.8, [0.02, -0.03, -0.0005, 0.0006, 0.01, 0.08, 0.0, 0.0]),
        right_from_left: Isometry3::from_parts(Translation3::new(-0.11, 0.002, 0.003), rotation),
        rectified: None,
        image_size: Some(SIZE),
    }
}

/// Where a ray from `origin` meets the scene, all in the left camera's frame.
pub fn hit(origin: Point3<f64>, direction: Vector3<f64>) -> Point3<f64> {
    let (center, radius) = (Point3::new(0.05, 0.0, 1.25), 0.25);
    let to = origin - center;
    let (a, b, c) = (direction.norm_squared(), to.dot(&direction), to.norm_squared() - radius * radius);
    let root = b * b - a * c;
    if root > 0.0 {
        return origin + direction * ((-b - root.sqrt()) / a);
    }
    let (normal, offset) = (Vector3::new(0.25, 0.1, -1.0), -1.9);
    origin + direction * ((offset - normal.dot(&origin.coords)) / normal.dot(&direction))
}

/// The scene before both cameras; drawn once.
pub fn pictures() -> (Arc<RgbImage>, Arc<RgbImage>) {
    static PICTURES: OnceLock<(Arc<RgbImage>, Arc<RgbImage>)> = OnceLock::new();
    let draw = || {
        let c = calibration();
        let left = render(&c.left, &Isometry3::identity());
        (Arc::new(left), Arc::new(render(&c.right, &c.right_from_left.inverse())))
    };
    PICTURES.get_or_init(draw).clone()
}

/// The view through a lens, four rays a pixel.
fn render(lens: &Lens, left_from_camera: &Isometry3<f64>) -> RgbImage {
    let origin = left_from_camera * Point3::origin();
    let sample = |u: f64, v: f64| {
        let ray = unbend(lens, Point2::new(u, v));
        texture(hit(origin, left_from_camera * Vector3::new(ray.x, ray.y, 1.0)))
    };
    let pixel = |i: u32| {
        let (u, v) = (f64::from(i % SIZE.0), f64::from(i / SIZE.0));
        let four = [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)];
        let mean = four.iter().map(|(du, dv)| sample(u + du, v + dv)).sum::<f64>() / 4.0;
        [(30.0 + 200.0 * mean).round() as u8, (25.0 + 180.0 * mean).round() as u8, (40.0 + 150.0 * mean).round() as u8]
    };
    RgbImage { width: SIZE.0, height: SIZE.1, pixels: (0..SIZE.0 * SIZE.1).map(pixel).collect() }
}

/// The ray of a pixel; a dozen steps reach a millionth of a pixel through lenses as mild as these.
fn unbend(lens: &Lens, pixel: Point2<f64>) -> Vector2<f64> {
    let mut ray = Vector2::new((pixel.x - lens.cx) / lens.fx, (pixel.y - lens.cy) / lens.fy);
    for _ in 0..12 {
        let off = pixel - lens.pixel(ray);
        ray += Vector2::new(off.x / lens.fx, off.y / lens.fy);
    }
    ray
}

/// Smooth noise in space at two scales, 0 to 1.
fn texture(p: Point3<f64>) -> f64 {
    0.6 * value_noise(p / CELL) + 0.4 * value_noise(p / (3.0 * CELL))
}

fn value_noise(p: Point3<f64>) -> f64 {
    let base = p.map(f64::floor);
    let t = (p - base).map(|x| x * x * (3.0 - 2.0 * x));
    let mut sum = 0.0;
    for k in 0..8 {
        let corner = [k & 1, k >> 1 & 1, k >> 2];
        let weight: f64 = (0..3).map(|i| if corner[i] == 1 { t[i] } else { 1.0 - t[i] }).product();
        let cell = [0, 1, 2].map(|i| (base[i] as i64 + corner[i] as i64) as u64);
        sum += weight * hash(cell);
    }
    sum
}

fn hash([x, y, z]: [u64; 3]) -> f64 {
    let mut h = x.wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ y.wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ z.wrapping_mul(0x1656_67b1_9e37_79f9);
    h = (h ^ (h >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    ((h ^ (h >> 32)) & 0xffff) as f64 / 65535.0
}
