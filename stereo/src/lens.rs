//! A camera with the lens model of OpenCV's calibration.

use nalgebra::{Point2, Vector2};

/// Pinhole with Brown–Conrady distortion, rational where k4 to k6 are given. Pixel centres at integers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Focal length along x, pixels.
    pub fx: f64,
    /// Focal length along y, pixels.
    pub fy: f64,
    /// Principal point, column.
    pub cx: f64,
    /// Principal point, row.
    pub cy: f64,
    /// k1 k2 p1 p2 k3 k4 k5 k6, OpenCV's order.
    pub distortion: [f64; 8],
}

/// Steps of [`Lens::normalized`]: as many as OpenCV takes, so that the rectified view it helps to choose is the same.
const STEPS: usize = 5;

impl Lens {
    /// Pixel of the ray (x, y, 1).
    pub fn pixel(&self, ray: Vector2<f64>) -> Point2<f64> {
        let (radial, tangential) = self.bend(ray);
        let bent = ray * radial + tangential;
        Point2::new(self.fx * bent.x + self.cx, self.fy * bent.y + self.cy)
    }

    /// The ray (x, y, 1) of a pixel, by a few steps of the usual fixed-point iteration. Towards the corners of strongly
    /// bent lenses it is an approximation: good to choose a view by, not to measure with.
    pub fn normalized(&self, pixel: Point2<f64>) -> Vector2<f64> {
        let start = Vector2::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy);
        let mut ray = start;
        for _ in 0..STEPS {
            let (radial, tangential) = self.bend(ray);
            let next = (start - tangential) / radial;
            if radial <= 0.0 || !next.iter().all(|x| x.is_finite()) {
                return start;
            }
            ray = next;
        }
        ray
    }

    /// The factor of a ray, and the offset that is added to it.
    fn bend(&self, ray: Vector2<f64>) -> (f64, Vector2<f64>) {
        let [k1, k2, p1, p2, k3, k4, k5, k6] = self.distortion;
        let (x, y) = (ray.x, ray.y);
        let r2 = x * x + y * y;
        let polynomial = |a: f64, b: f64, c: f64| 1.0 + r2 * (a + r2 * (b + r2 * c));
        let tangential =
            Vector2::new(2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
        (polynomial(k1, k2, k3) / polynomial(k4, k5, k6), tangential)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ray_and_pixel_are_inverse_for_mild_lenses() {
        let distortion = [-0.08, 0.02, 0.001, -0.0005, 0.001, 0.01, -0.003, 0.0005];
        let lens = Lens { fx: 500.0, fy: 505.0, cx: 320.0, cy: 240.0, distortion };
        for (u, v) in [(320.0, 240.0), (100.0, 60.0), (600.0, 400.0)] {
            let back = lens.pixel(lens.normalized(Point2::new(u, v)));
            assert!((back - Point2::new(u, v)).norm() < 0.01, "{u} {v}: {back}");
        }
    }
}
