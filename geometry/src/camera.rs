//! Camera models.

use nalgebra::{Point2, Point3};
use serde::{Deserialize, Serialize};

/// A pinhole camera with optional Brown–Conrady lens distortion, rational where that is given. Camera frame: +X right, +Y down,
/// +Z forward; pixel centres at integers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PinholeCamera {
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Focal length along x, pixels.
    pub fx: f64,
    /// Focal length along y, pixels.
    pub fy: f64,
    /// Principal point, column.
    pub cx: f64,
    /// Principal point, row.
    pub cy: f64,
    /// Brown–Conrady coefficients k1 k2 p1 p2 k3 (OpenCV's order); all zero for an ideal lens.
    #[serde(default)]
    pub distortion: [f64; 5],
    /// The rational lens' k4 k5 k6 (OpenCV's order): the radial polynomial 1 + k1 r² + k2 r⁴ + k3 r⁶ is divided by
    /// 1 + k4 r² + k5 r⁴ + k6 r⁶. All zero for every other lens.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rational: [f64; 3],
}

/// Steps of the inverse of the lens at most: a polynomial one converges for the lenses of depth cameras in a few steps, a
/// rational one, which lenses of 120 degrees need, more slowly.
const STEPS: usize = 20;
const RATIONAL_STEPS: usize = 400;

fn is_zero(coefficients: &[f64; 3]) -> bool {
    coefficients.iter().all(|k| *k == 0.0)
}

impl PinholeCamera {
    /// An ideal pinhole camera.
    pub fn ideal(width: u32, height: u32, fx: f64, fy: f64, cx: f64, cy: f64) -> Self {
        Self { width, height, fx, fy, cx, cy, distortion: [0.0; 5], rational: [0.0; 3] }
    }

    /// The ideal camera of the same size, focal lengths and principal point.
    #[must_use]
    pub fn undistorted(&self) -> Self {
        Self::ideal(self.width, self.height, self.fx, self.fy, self.cx, self.cy)
    }

    /// True when every number is finite, the image has pixels and the focal lengths are positive.
    pub fn is_valid(&self) -> bool {
        let numbers = [self.fx, self.fy, self.cx, self.cy];
        self.width > 0
            && self.height > 0
            && self.fx > 0.0
            && self.fy > 0.0
            && numbers.iter().chain(&self.distortion).chain(&self.rational).all(|x| x.is_finite())
    }

    /// True when the lens bends rays.
    pub fn is_distorted(&self) -> bool {
        self.distortion.iter().chain(&self.rational).any(|&k| k != 0.0)
    }

    /// Pixel of a point in the camera frame; `None` at or behind the camera plane.
    pub fn project(&self, point: &Point3<f64>) -> Option<Point2<f64>> {
        if point.z <= 0.0 {
            return None;
        }
        let (x, y) = self.distort(point.x / point.z, point.y / point.z);
        Some(Point2::new(self.fx * x + self.cx, self.fy * y + self.cy))
    }

    /// The point at depth `z` (metres along +Z) seen at pixel (u, v).
    pub fn unproject(&self, u: f64, v: f64, z: f64) -> Point3<f64> {
        let (x, y) = self.undistort((u - self.cx) / self.fx, (v - self.cy) / self.fy);
        Point3::new(x * z, y * z, z)
    }

    /// Normalised ray slopes (x/z, y/z) of every pixel, row by row: compute once, unproject by one multiplication.
    pub fn rays(&self) -> Vec<[f32; 2]> {
        let pixel = |i: u32| (f64::from(i % self.width), f64::from(i / self.width));
        (0..self.width * self.height)
            .map(|i| {
                let (u, v) = pixel(i);
                let p = self.unproject(u, v, 1.0);
                [p.x as f32, p.y as f32]
            })
            .collect()
    }

    fn distort(&self, x: f64, y: f64) -> (f64, f64) {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let mut radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        if !is_zero(&self.rational) {
            let [k4, k5, k6] = self.rational;
            radial /= 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
        }
        (
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    /// Fixed-point inverse of [`Self::distort`], which stops where it has converged.
    fn undistort(&self, xd: f64, yd: f64) -> (f64, f64) {
        if !self.is_distorted() {
            return (xd, yd);
        }
        let (mut x, mut y) = (xd, yd);
        for _ in 0..if is_zero(&self.rational) { STEPS } else { RATIONAL_STEPS } {
            let (dx, dy) = self.distort(x, y);
            let next = (x + (xd - dx), y + (yd - dy));
            if next == (x, y) {
                break;
            }
            (x, y) = next;
        }
        (x, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unproject_inverts_project_with_distortion() {
        let mut camera = PinholeCamera::ideal(640, 480, 525.0, 520.0, 320.0, 240.0);
        camera.distortion = [0.08, -0.15, 0.001, -0.0007, 0.02];
        for (u, v) in [(0.0, 0.0), (320.0, 240.0), (600.0, 30.0), (13.5, 470.25)] {
            let p = camera.unproject(u, v, 1.7);
            let q = camera.project(&p).expect("in front of the camera");
            assert!((q.x - u).abs() < 1e-6 && (q.y - v).abs() < 1e-6, "{u} {v} came back as {q}");
        }
    }

    /// The lens of a time-of-flight camera of 120 degrees, whose polynomials nearly cancel.
    #[test]
    fn a_rational_lens_inverts_to_the_rim() {
        let mut camera = PinholeCamera::ideal(1024, 1024, 504.3, 504.4, 513.0, 515.0);
        (camera.distortion, camera.rational) = ([6.084, 4.375, 6.5e-5, -5.5e-5, 0.2362], [6.409, 6.418, 1.220]);
        // r² = 1: the radial factor is (1 + k1 + k2 + k3) / (1 + k4 + k5 + k6).
        let seen = camera.project(&Point3::new(1.0, 0.0, 1.0)).unwrap();
        let radial = (1.0 + 6.084 + 4.375 + 0.2362) / (1.0 + 6.409 + 6.418 + 1.220);
        assert!((seen.x - (504.3 * (radial - 5.5e-5 * 3.0) + 513.0)).abs() < 1e-9, "{seen}");
        for (u, v) in [(513.0, 515.0), (20.0, 515.0), (160.0, 170.0), (900.0, 830.0)] {
            let q = camera.project(&camera.unproject(u, v, 2.0)).expect("in front of the camera");
            assert!((q.x - u).abs() < 1e-3 && (q.y - v).abs() < 1e-3, "{u} {v} came back as {q}");
        }
        assert!(camera.is_distorted() && !camera.undistorted().is_distorted());
    }
}
